// The strip of all vehicles: each with its state, battery and goal; a click selects it.

import { setText, unreachable } from "./panel.js";
import { duration, failsafe as failsafeWords, status, vehicleName } from "./words.js";

const isKnown = (value) => value !== null && value !== undefined;

function state(link, v) {
  if (unreachable(link, v)) return ["No contact", true];
  const { armed, landed, failsafe } = v.status ?? {};
  if (failsafe) return [`Failsafe: ${failsafeWords(failsafe)}`, true];
  if (landed && landed !== "on the ground") return [landed[0].toUpperCase() + landed.slice(1), false];
  return [armed ? "Armed" : "Disarmed", false];
}

function battery(v) {
  const percent = v.battery?.percent;
  if (!isKnown(percent)) return ["battery unknown", false];
  const need = 100 * ((v.status?.reserve ?? 0) + (v.status?.return_share ?? 0));
  return [`${percent} %`, percent < need];
}

function goal(v, isDrawn) {
  if (!v.goal) return isDrawn ? "Route drawn" : "No goal";
  const f = v.feedback;
  if (!f) return "Goal active";
  const left = isKnown(f.time) && f.status === "NAVIGATING" ? `, ${duration(f.time)} left` : "";
  return status(f.status) + left;
}

export class FleetStrip {
  // `list` is filled with a button for each vehicle, `select` is called with the name of one.
  constructor(list, link, select) {
    Object.assign(this, { list, link, select, cards: new Map() });
  }

  // `drawn` tells whether a route is drawn for a vehicle.
  show(names, chosen, drawn) {
    this.list.parentElement.hidden = names.length < 2;
    if (this.list.dataset.names !== names.join()) {
      this.list.dataset.names = names.join();
      this.cards = new Map(names.map((name) => [name, this.card(name)]));
      this.list.replaceChildren(...[...this.cards.values()].map(({ item }) => item));
    }
    for (const [name, card] of this.cards) {
      const v = this.link.vehicles[name];
      card.button.setAttribute("aria-pressed", String(name === chosen));
      card.button.dataset.goal = v.goal ?? "";
      const holder = this.link.control[name];
      setText(card.control, holder === this.link.page ? "yours" : holder ? "another page" : "");
      setText(card.state, ...state(this.link, v));
      setText(card.battery, ...battery(v));
      setText(card.goal, goal(v, drawn(name)));
    }
  }

  card(name) {
    const item = document.createElement("li");
    const button = Object.assign(document.createElement("button"), { type: "button", onclick: () => this.select(name) });
    button.dataset.vehicle = name;
    const part = (kind, text = "") => {
      const element = Object.assign(document.createElement("span"), { className: kind, textContent: text });
      button.append(element, " ");
      return element;
    };
    part("name", vehicleName(name));
    const card = { item, button, control: part("control"), state: part("state"), battery: part("charge"), goal: part("goal") };
    item.append(button);
    return card;
  }
}
