// Acts at the selected waypoint: photos, the camera, the gripper, a wait.

const $ = (id) => document.getElementById(id);
const ACTS_MAX = 20;
// By kind of act its name, and of each number its member, its label, its first value and its limits.
const KINDS = {
  photo: ["Photo", []],
  distance: ["Photos every", [["metres", "Metres", 5, 0, 1000]]],
  point: ["Point the camera", [["up", "Up °", -90, -90, 90], ["right", "Right °", 0, -180, 180]]],
  neutral: ["Camera to its default", []],
  wait: ["Wait", [["seconds", "Seconds", 5, 0.1, 3600]]],
  grab: ["Grab", []],
  release: ["Release", []],
};

function describedAct(act) {
  if (act.kind === "distance") return act.metres ? `photos every ${act.metres} m` : "no more photos by distance";
  if (act.kind === "point") return `camera ${Math.abs(act.up)}° ${act.up < 0 ? "down" : "up"}${act.right ? `, ${Math.abs(act.right)}° ${act.right < 0 ? "left" : "right"}` : ""}`;
  if (act.kind === "wait") return `wait ${act.seconds} s`;
  return KINDS[act.kind][0].toLowerCase();
}

export class ActList {
  constructor(route) {
    this.route = route;
    $("act-kind").replaceChildren(...Object.entries(KINDS).map(([kind, [name]]) => new Option(name, kind)));
    $("act-kind").onchange = () => this.fields();
    $("act-add").onclick = () => this.add();
    route.addEventListener("change", () => this.show());
    this.fields();
    this.show();
  }

  get point() {
    return this.route.points[this.route.selected];
  }

  fields() {
    const [, numbers] = KINDS[$("act-kind").value];
    $("act-numbers").replaceChildren(...numbers.map(([name, title, value, min, max]) => {
      const field = Object.assign(document.createElement("label"), { className: "field", textContent: `${title} ` });
      const input = Object.assign(document.createElement("input"), { type: "number", step: "any", value, min, max });
      input.dataset.name = name;
      field.append(input);
      return field;
    }));
  }

  add() {
    const acts = this.point?.acts ?? [];
    const inputs = [...$("act-numbers").querySelectorAll("input")];
    if (!this.point || acts.length >= ACTS_MAX || !inputs.every((input) => input.value && input.checkValidity())) return;
    const numbers = Object.fromEntries(inputs.map((input) => [input.dataset.name, input.valueAsNumber]));
    this.route.move(this.route.selected, { acts: [...acts, { kind: $("act-kind").value, ...numbers }] });
  }

  show() {
    const { point } = this;
    $("acts").hidden = !point;
    if (!point) return;
    const acts = point.acts ?? [];
    $("acts-of").textContent = `At waypoint ${this.route.selected + 1}`;
    $("act-add").disabled = acts.length >= ACTS_MAX;
    $("act-list").replaceChildren(...acts.map((act, i) => {
      const row = Object.assign(document.createElement("li"), { textContent: `${describedAct(act)} ` });
      const remove = Object.assign(document.createElement("button"), { type: "button", textContent: "×" });
      remove.setAttribute("aria-label", `Delete: ${describedAct(act)}`);
      remove.onclick = () => this.route.move(this.route.selected, { acts: acts.filter((_, k) => k !== i) });
      row.append(remove);
      return row;
    }));
  }
}
