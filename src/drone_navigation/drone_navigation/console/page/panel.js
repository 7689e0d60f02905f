// The texts of the page: facts about the vehicle, messages.

import { endText, eventText, failsafe } from "./words.js";

const $ = (id) => document.getElementById(id);

export function setText(element, text, bad = false) {
  if (element.textContent !== text) element.textContent = text;
  element.classList.toggle("bad", bad);
}

// Without a minus before zero.
const fixed = (value, digits) => (Math.round(value * 10 ** digits) / 10 ** digits + 0).toFixed(digits);
const number = (value, digits, unit) => (value === null || value === undefined ? "unknown" : `${fixed(value, digits)} ${unit}`);

function facts(v) {
  const status = v.status ?? {};
  const at = v.motion?.at;
  const home = v.home;
  const rows = [];
  const add = (name, text, bad = false) => rows.push([name, text, bad]);
  add("Autopilot", [status.autopilot, status.firmware].filter(Boolean).join(" ") || "unknown");
  add("Mode", `${status.mode || "unknown"}${status.in_control ? ", follows this server" : ""}`);
  add("Motors", [status.armed ? "armed" : "disarmed", status.landed].filter(Boolean).join(", "));
  if (status.failsafe) add("Failsafe", failsafe(status.failsafe), true);
  const link = v["vehicle link"];
  const quality = [link?.message ?? "connected"];
  if (link?.lost) quality.push(`${link.lost} lost`);
  if (link?.round_trip && link.round_trip !== "unknown") quality.push(link.round_trip);
  add("Link", status.connected ? quality.join(", ") : "no link to the vehicle", !status.connected || link?.level === "error");
  const gps = v.GPS;
  const satellites = gps?.satellites && gps.satellites !== "unknown" ? `, ${gps.satellites} satellites` : "";
  add("GPS", gps ? gps.message + satellites : "unknown", gps?.level === "error");
  const percent = v.battery?.percent;
  const volts = v.battery?.voltage ? `, ${v.battery.voltage} V` : "";
  add("Battery", (percent === null || percent === undefined ? "unknown" : `${percent} %`) + volts,
    percent !== null && percent !== undefined && percent < 100 * (status.reserve ?? 0));
  add("Climb", number(v.motion?.climb, 1, "m/s"));
  if (at) add("Position", `east ${fixed(at[0], 1)}, north ${fixed(at[1], 1)} m`, !status.position_valid);
  else add("Position", "unknown", true);
  if (at && home?.at) {
    const above = at[2] - home.at[2];
    add("Altitude", `${fixed(above, 1)} m above home, ${fixed(home.altitude + above, 1)} m AMSL`);
  } else if (at) add("Altitude", `${at[2].toFixed(1)} m above the map's origin`);
  const sensors = v["obstacle sensors"];
  if (sensors) add("Obstacles", sensors.message, sensors.level === "error");
  const loop = v["control loop"];
  if (loop && loop.level !== "ok") add("Server", loop.message, true);
  return rows;
}

function showFacts(v) {
  const list = $("facts");
  const rows = facts(v);
  while (list.children.length < 2 * rows.length) {
    list.append(document.createElement("dt"), document.createElement("dd"));
  }
  while (list.children.length > 2 * rows.length) list.lastChild.remove();
  rows.forEach(([name, text, bad], i) => {
    setText(list.children[2 * i], name);
    setText(list.children[2 * i + 1], text, bad);
  });
}

function showEvents(v, page) {
  const list = $("events");
  const events = [...(v.events ?? [])].reverse();
  const key = `${page} ${events[0]?.number ?? 0} ${events.length}`;
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  list.replaceChildren(...events.map((event) => {
    const item = document.createElement("li");
    const time = document.createElement("time");
    time.textContent = new Date(event.time * 1000).toLocaleTimeString([], { hour12: false });
    const text = document.createElement("span");
    text.textContent = eventText(event, page);
    if (event.kind === "rejected") text.className = "bad";
    item.append(time, text);
    return item;
  }));
}

export function banner(link, v) {
  if (!link.open) return "The console has ended, or its token is old. Trying again.";
  if (!v) return "Waiting for a navigation server.";
  if (v.replay) return "A recording: nothing is flown.";
  if (!v.alive) return "The navigation server is silent. The page is out of date; waiting for the server.";
  if (v.status?.other_server) return "Two servers offer the same actions: stop one of them.";
  if (!v.status?.connected) return "The server has no link to the vehicle.";
  return "";
}

// Why nothing that is sent reaches the vehicle, "" if it does.
export function unreachable(link, v) {
  if (!link.open) return "there is no connection to the console.";
  if (!v || v.replay) return "";
  if (!v.alive) return "the navigation server is silent.";
  return v.status?.connected ? "" : "the server has no link to the vehicle.";
}

// How old what is shown is, in s; null while it is up to date, NaN if it never was.
function age(link, v) {
  if (!v || v.replay) return null;
  if (!unreachable(link, v)) v.freshAt = Date.now();
  else return (Date.now() - (v.freshAt ?? NaN)) / 1000;
  return null;
}

function showAge(link, v) {
  const old = age(link, v);
  document.querySelector("aside").classList.toggle("old", old !== null);
  $("age").hidden = old === null;
  const text = Number.isNaN(old) ? "age unknown" : `${Math.round(old ?? 0)} s old`;
  setText($("age"), old === null ? "" : text, old !== null);
  return old !== null;
}

// Returns whether what is shown is old.
export function showPanel(link, v) {
  const old = showAge(link, v);
  const text = banner(link, v);
  $("banner").hidden = !text;
  setText($("banner"), text);
  showFacts(v ?? {});
  const remarks = v?.goal ? (v.remarks ?? []).join(" ") : "";
  $("remarks").hidden = !remarks;
  setText($("remarks"), remarks, Boolean(remarks));
  setText($("end"), v?.end ? endText(v.end, "last goal") : "No goal has ended yet.", Boolean(v?.end) && v.end.code !== "SUCCESS");
  $("end").dataset.number = v?.end?.number ?? 0;
  $("end").dataset.code = v?.end?.code ?? "";
  showEvents(v ?? {}, link.page);
  setText($("look"), link.pages > 1 ? `${link.pages} pages are open` : "");
  const rejected = Object.values(link.rejected).reduce((sum, count) => sum + count, 0);
  setText($("rejected"), rejected ? `Since the console started it has rejected ${rejected} requests that had no right to it, or made no sense.` : "");
  return old;
}
