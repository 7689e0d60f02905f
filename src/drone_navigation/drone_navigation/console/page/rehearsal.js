// The route that is drawn, flown in the simulator before it is confirmed: asked for, told, drawn.

import { label } from "./colours.js";
import { setText } from "./panel.js";
import { Question } from "./question.js";
import { duration, withoutCode } from "./words.js";

export class Rehearsal extends Question {
  // `order` returns what would be flown, null for nothing; `from` where the vehicle is and how;
  // `draw` draws the map.
  constructor(element, link, order, from, draw) {
    super(link, "rehearse", order, from);
    this.element = element;
    link.addEventListener("rehearsal", ({ detail }) => this.hear(detail));
    this.addEventListener("change", () => { this.show(); draw(); });
    this.show();
  }

  hear({ number, rehearsal, lost, error, lacks }) {
    if (!this.isNewest(number)) return;
    const result = lost ? { ...this.result, lost } : { rehearsal, error, lacks };
    this.take(result, lost || !rehearsal?.accepted);
  }

  get isAnswered() {
    return Boolean(this.result?.rehearsal);
  }

  lines() {
    if (!this.asked) return [];
    if (!this.result) return ["Rehearsing …"];
    const { rehearsal: flown, lost, error } = this.result;
    if (error) return [`No rehearsal: ${error}`];
    if (!flown.accepted) return [rejected(flown)];
    const lines = [this.danger, ...summary(flown)].filter(Boolean);
    if (lost) {
      const [x, y, z] = lost.position_enu_m;
      const where = `east ${whole(x)}, north ${whole(y)}`;
      const how = lost.landed ? `ends with the motors off at ${where}` : `keeps it at ${where}, up ${whole(z)} m`;
      const hits = lost.approach?.clearance_m === 0 ? `, and it would hit ${met(lost.approach)}` : "";
      lines.push(`Link lost half way: ${lost.mode} ${how}${hits}.`);
    }
    const lacks = this.result.lacks ?? [];
    if (lacks.length) lines.push(`Not considered: ${lacks.join(", ")}.`);
    return lines;
  }

  get danger() {
    return danger(this.result?.rehearsal);
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

// Without a minus before zero.
const whole = (value) => String(Math.round(value) + 0);

export const rejected = (flown) => `It would be rejected: ${withoutCode(flown.text, flown.code)}`;

// How it ends, and how long it takes; of one that is accepted.
export function summary(flown) {
  const left = flown.battery === null ? "battery unknown" : `battery ${(100 * flown.battery).toFixed(0)} %`;
  const parts = [duration(flown.duration_s), `${left} at the end`];
  if (flown.approach) parts.push(`least clearance ${flown.approach.clearance_m.toFixed(1)} m`);
  const end = flown.code === "SUCCESS" ? [] : [`It would not arrive: ${withoutCode(flown.text, flown.code)}`];
  return [...end, `Rehearsed: ${parts.join(", ")}.`];
}

// What the flight hits, or passes too near to; "" for nothing.
export function danger(flown) {
  const near = flown?.approach;
  if (!near?.is_too_near) return "";
  if (near.clearance_m === 0) return `DANGER: it would hit ${met(near)}.`;
  return `DANGER: only ${near.clearance_m.toFixed(1)} m from ${met(near)}; ${near.margin_m.toFixed(1)} m are to be kept.`;
}

// Which obstacle, and at which metre of the path.
function met({ obstacle, along_m, position_enu_m: [x, y, z] }) {
  return `${obstacle} after ${along_m.toFixed(0)} m, at east ${whole(x)}, north ${whole(y)}, up ${whole(z)} m`;
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
