// Routes of several vehicles, rehearsed together: how each would go, and how near they come.

import { label } from "./colours.js";
import { setText } from "./panel.js";
import { Question } from "./question.js";
import { danger, rejected, summary } from "./rehearsal.js";
import { duration, joined, vehicleName } from "./words.js";

const $ = (id) => document.getElementById(id);
const SHOWN = 3;

function nearest(meeting) {
  const names = joined(meeting.vehicles.map(vehicleName));
  const when = `after ${duration(meeting.time_s)}`;
  if (!meeting.is_too_near) return `${names} come nearest ${when}: ${meeting.distance_m.toFixed(1)} m.`;
  const [beside, above] = meeting.required_m;
  const gap = `${meeting.horizontal_m.toFixed(1)} m beside and ${meeting.vertical_m.toFixed(1)} m above each other`;
  return `TOO NEAR: ${names} come to ${meeting.distance_m.toFixed(1)} m ${when}, ${gap}; ${beside} m or ${above} m are to be kept.`;
}

export class Together extends Question {
  // `orders` returns the routes of all vehicles that have one; `from` where the vehicles are.
  constructor(link, orders, from, draw) {
    super(link, "rehearse_together", () => {
      const routes = orders();
      return routes.length && Object.keys(link.vehicles).length > 1 ? { routes } : null;
    }, from);
    this.orders = orders;
    link.addEventListener("together", ({ detail }) => this.isNewest(detail.number) && this.take(detail, true));
    this.addEventListener("change", () => { this.show(); draw(); });
    this.show();
  }

  get isAnswered() {
    const results = Object.values(this.result?.vehicles ?? {});
    return results.length > 0 && results.every(({ rehearsal }) => rehearsal);
  }

  // What is hit, or too near, of all; "" for nothing.
  get danger() {
    return [...this.meetings.filter((meeting) => meeting.is_too_near).map(nearest), ...this.dangers].join(" ");
  }

  get dangers() {
    return Object.entries(this.result?.vehicles ?? {}).flatMap(([name, { rehearsal }]) => {
      const text = danger(rehearsal);
      return text ? [`${vehicleName(name)}: ${text}`] : [];
    });
  }

  get meetings() {
    return this.result?.meetings ?? [];
  }

  // A line for each vehicle: its name, a text, and whether that is bad.
  rows() {
    return this.orders().map(({ vehicle, waypoints }) => {
      const route = waypoints.length === 1 ? "a goal" : `${waypoints.length} waypoints`;
      const result = this.result?.vehicles[vehicle];
      const { rehearsal: flown, error } = result ?? {};
      if (!result) return [`${vehicleName(vehicle)}: ${route}. ${this.asked ? "Rehearsing …" : ""}`, false];
      if (error) return [`${vehicleName(vehicle)}: ${route}. No rehearsal: ${error}`, true];
      if (!flown.accepted) return [`${vehicleName(vehicle)}: ${route}. ${rejected(flown)}`, true];
      const text = [danger(flown), ...summary(flown)].filter(Boolean).join(" ");
      return [`${vehicleName(vehicle)}: ${route}. ${text}`, Boolean(danger(flown)) || flown.code !== "SUCCESS"];
    });
  }

  separation() {
    if (!this.result) return "";
    const bad = this.meetings.filter((meeting) => meeting.is_too_near);
    const lines = (bad.length ? bad : this.meetings.slice(0, 1)).slice(0, SHOWN).map(nearest);
    if (bad.length > SHOWN) lines.push(`${bad.length - SHOWN} more pairs come too near.`);
    if (bad.length && this.result.is_separated) lines.push("The server has one of them wait.");
    if (bad.length && this.result.is_separated === false) lines.push("The server does not keep them apart: its separation is disabled.");
    if (this.result.lacks.length) lines.push(`Not considered: ${this.result.lacks.join("; ")}.`);
    return lines.join(" ");
  }

  show() {
    const rows = this.rows();
    $("together-routes").replaceChildren(...rows.map(([text, bad]) => {
      const item = document.createElement("li");
      setText(item, text, bad);
      return item;
    }));
    const text = this.separation();
    $("separation").hidden = !text;
    const bad = this.meetings.some((meeting) => meeting.is_too_near);
    setText($("separation"), text, bad);
    $("separation").dataset.state = this.result ? (bad ? "near" : "apart") : "";
  }
}

// Other vehicles' routes and rehearsed paths, and where two come nearest; all in the map's frame.
export function drawTogether(map, context, together, c) {
  for (const { route, path } of together?.others ?? []) {
    map.line(context, path, c.rehearsed, 3, [3, 6]);
    map.line(context, route, c.other, 2);
    for (const [x, y] of route.slice(1)) {
      const [px, py] = map.toScreen(x, y);
      context.beginPath();
      context.arc(px, py, 6, 0, 2 * Math.PI);
      context.fillStyle = c.halo;
      context.fill();
      context.lineWidth = 2;
      context.strokeStyle = c.other;
      context.stroke();
    }
  }
}

// Where two come nearest to each other; above all lines.
export function drawMeetings(map, context, together, c) {
  for (const { from, to, text, bad } of together?.meetings ?? []) {
    const colour = bad ? c.known : c.rehearsed;
    map.line(context, [from, to], colour, bad ? 4 : 2);
    const [px, py] = map.toScreen((from[0] + to[0]) / 2, (from[1] + to[1]) / 2);
    label(context, text, px + 8, py - 8, c.ink, c.halo);
  }
}
