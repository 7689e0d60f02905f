// The route that is drawn, flown in the simulator before it is confirmed: asked for, told, drawn.

import { label } from "./colours.js";
import { setText } from "./panel.js";

const SETTLED_MS = 400;
const AGAIN_MS = 5000;
// So long an answer is waited for before it is asked for again.
const LATE_MS = 20000;

export class Rehearsal {
  // `order` returns what would be flown, null for nothing; `from` where the vehicle is and how;
  // `draw` draws the map.
  constructor(element, link, order, from, draw) {
    Object.assign(this, { element, link, order, from, draw, number: 0, timer: 0, result: null });
    this.asked = this.begun = "";
    this.late = 0;
    link.addEventListener("rehearsal", ({ detail }) => this.take(detail));
    this.show();
  }

  // The route or the vehicle has changed, or may have. It never keeps anything waiting.
  look() {
    const order = this.order();
    const key = order ? JSON.stringify(order) : "";
    if (key !== this.asked) {
      this.asked = key;
      this.result = null;
      this.number += 1;
      clearTimeout(this.timer);
      this.late = 0;
      if (order) this.timer = setTimeout(() => this.ask(), SETTLED_MS);
      this.show();
    }
  }

  // Again while the route is there, if the vehicle has moved on.
  ask() {
    const order = this.order();
    clearTimeout(this.timer);
    if (!order) return;
    this.timer = setTimeout(() => this.ask(), AGAIN_MS);
    const from = JSON.stringify(this.from());
    if (Date.now() < this.late || from === this.begun && this.result?.rehearsal) return;
    this.late = Date.now() + LATE_MS;
    this.begun = from;
    this.number += 1;
    this.sent = this.number;
    this.link.send({ type: "rehearse", number: this.number, ...order });
  }

  take({ number, rehearsal, lost, error, lacks }) {
    if (number !== this.sent || number !== this.number) return;
    if (lost) this.result = { ...this.result, lost };
    else this.result = { rehearsal, error, lacks };
    if (lost || !rehearsal?.accepted) this.late = 0;
    this.show();
    this.draw();
  }

  lines() {
    if (!this.asked) return [];
    if (!this.result) return ["Rehearsing …"];
    const { rehearsal: flown, lost, error } = this.result;
    if (error) return [`No rehearsal: ${error}`];
    if (!flown.accepted) return [`It would be rejected. ${flown.code}: ${flown.text}`];
    const left = flown.battery === null ? "battery unknown" : `battery ${(100 * flown.battery).toFixed(0)} %`;
    const parts = [`${flown.duration_s.toFixed(0)} s`, `${left} at the end`];
    if (flown.approach) parts.push(`least clearance ${flown.approach.clearance_m.toFixed(1)} m`);
    const end = flown.code === "SUCCESS" ? "Rehearsed" : `Would end with ${flown.text}`;
    const lines = [this.danger, `${end}: ${parts.join(", ")}.`].filter(Boolean);
    if (lost) {
      const [x, y, z] = lost.position_enu_m;
      const where = `east ${x.toFixed(0)}, north ${y.toFixed(0)}`;
      const how = lost.landed ? `stopped, motors off, at ${where}` : `staying at ${where}, up ${z.toFixed(0)} m`;
      const hits = lost.approach?.clearance_m === 0 ? `, and it would hit ${met(lost.approach)}` : "";
      lines.push(`Link lost half way: ${lost.mode}, ${how}${hits}.`);
    }
    const lacks = this.result.lacks ?? [];
    if (lacks.length) lines.push(`Not considered: ${lacks.join(", ")}.`);
    return lines;
  }

  // What the rehearsal hits, or passes too near to; "" for nothing.
  get danger() {
    const near = this.result?.rehearsal?.approach;
    if (!near?.is_too_near) return "";
    if (near.clearance_m === 0) return `DANGER: it would hit ${met(near)}.`;
    return `DANGER: only ${near.clearance_m.toFixed(1)} m from ${met(near)}; ${near.margin_m.toFixed(1)} m are to be kept.`;
  }

  // Whether nothing is known yet of what is drawn now.
  get pending() {
    return Boolean(this.asked) && !this.result;
  }

  show() {
    const lines = this.lines();
    const flown = this.result?.rehearsal;
    this.element.hidden = !lines.length;
    const bad = this.danger || this.result?.error || flown && flown.code !== "SUCCESS";
    setText(this.element, lines.join(" "), Boolean(bad));
    this.element.dataset.danger = this.danger;
    this.element.dataset.code = flown?.code ?? "";
    this.element.dataset.lost = this.result?.lost?.mode ?? "";
  }
}

// Which obstacle, and at which metre of the path.
function met({ obstacle, along_m, position_enu_m: [x, y, z] }) {
  return `${obstacle} after ${along_m.toFixed(0)} m, at east ${x.toFixed(0)}, north ${y.toFixed(0)}, up ${z.toFixed(0)} m`;
}

function cross(map, context, place, c, colour, text) {
  const [px, py] = map.toScreen(place[0], place[1]);
  context.lineWidth = 2.5;
  map.stroke(context, [[px - 6, py - 6], [px + 6, py + 6]], colour);
  map.stroke(context, [[px - 6, py + 6], [px + 6, py - 6]], colour);
  label(context, text, px + 9, py - 8, c.ink, c.halo);
}

export function drawRehearsal(map, context, result, c) {
  if (!result?.rehearsal) return;
  const { rehearsal, lost } = result;
  const near = rehearsal.approach;
  map.line(context, rehearsal.path_enu_m, near?.is_too_near ? c.known : c.rehearsed, 4, [3, 6]);
  if (near?.is_too_near) cross(map, context, near.position_enu_m, c, c.known, near.clearance_m ? "too near" : "hit");
  if (!lost) return;
  map.line(context, lost.path_enu_m, c.rehearsed, 1.5, [2, 8]);
  cross(map, context, lost.position_enu_m, c, c.rehearsed, "link lost");
}
