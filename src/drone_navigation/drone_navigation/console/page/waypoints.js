// The list of waypoints, with numbers to type in.

const FIELDS = [["x", "East"], ["y", "North"], ["z", "Up"], ["hold", "Hold s"]];

export class WaypointList {
  constructor(list, route) {
    this.list = list;
    this.route = route;
    route.addEventListener("change", () => this.show());
    this.show();
  }

  show() {
    const { points, selected } = this.route;
    if (this.list.children.length !== points.length + (points.length ? 1 : 0)) {
      this.list.replaceChildren(...(points.length ? [this.head(), ...points.map((_, i) => this.row(i))] : []));
    }
    points.forEach((point, i) => {
      const row = this.list.children[i + 1];
      row.classList.toggle("selected", i === selected);
      FIELDS.forEach(([name], k) => {
        const input = row.querySelectorAll("input")[k];
        if (input !== document.activeElement) input.value = point[name];
      });
    });
  }

  head() {
    const item = document.createElement("li");
    item.className = "head";
    const names = FIELDS.map(([, name]) => Object.assign(document.createElement("span"), { textContent: name }));
    const start = Object.assign(document.createElement("span"), { className: "number" });
    item.append(start, ...names, Object.assign(document.createElement("span"), { className: "gap" }));
    return item;
  }

  row(index) {
    const item = document.createElement("li");
    const number = Object.assign(document.createElement("span"), { className: "number", textContent: index + 1 });
    number.onclick = () => this.route.select(index);
    item.append(number, ...FIELDS.map(([name, title]) => this.input(index, name, title)));
    item.append(
      this.button("+", `Insert after waypoint ${index + 1}`, () => this.route.insertAfter(index)),
      this.button("×", `Delete waypoint ${index + 1}`, () => this.route.remove(index)),
    );
    return item;
  }

  input(index, name, title) {
    const input = Object.assign(document.createElement("input"), { type: "number", step: "0.5" });
    input.setAttribute("aria-label", `${title} of waypoint ${index + 1}`);
    if (name === "hold") input.min = "0";
    input.onchange = () => {
      const value = input.valueAsNumber;
      if (Number.isFinite(value) && !input.validity.rangeUnderflow) this.route.move(index, { [name]: value });
      else this.show();
    };
    return input;
  }

  button(text, title, act) {
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: text, title, onclick: act });
    button.setAttribute("aria-label", title);
    return button;
  }
}
