// What is read at a glance, over the map: the goal's progress, and how the vehicle flies.

import { setText } from "./panel.js";
import { followed } from "./target.js";
import { coordinates, duration, sender, status } from "./words.js";

const UNKNOWN = "–";
const PIXELS_PER_DEGREE = 0.6;
const PITCH_SHOWN_DEG = 40;
const $ = (id) => document.getElementById(id);
const isKnown = (value) => value !== null && value !== undefined;
const degrees = (radians) => (radians * 180) / Math.PI;
// Without a minus before zero.
const fixed = (value, digits) => (Math.round(value * 10 ** digits) / 10 ** digits + 0).toFixed(digits);

// Number and unit of a length in m.
function length(metres) {
  if (!isKnown(metres)) return [UNKNOWN, ""];
  return metres >= 10000 ? [fixed(metres / 1000, 1), "km"] : [fixed(metres, Math.abs(metres) < 100 ? 1 : 0), "m"];
}

export function progress(v, page) {
  if (!v.goal) return "No goal.";
  const f = v.feedback;
  if (v.replay && !f) return "A recorded goal is active.";
  const from = sender(v.route?.by, page);
  const by = v.replay || from === "this page" ? "" : `, from ${from}`;
  if (!f) return `A goal is active${by}.`;
  const parts = [`${status(f.status)}${by}`];
  if (f.waypoint !== null) {
    const lap = f.lap ? `, lap ${f.lap + 1}, ${f.waypoints_left} to go` : ` of ${f.waypoint + f.waypoints_left}`;
    parts.push(`waypoint ${f.waypoint + 1}${lap}`);
  }
  if (f.target) parts.push(followed(f.target));
  if (f.replans) parts.push(f.replans === 1 ? "1 new path" : `${f.replans} new paths`);
  return parts.join(" · ");
}

function show(id, [value, unit], bad = false) {
  setText($(id).firstElementChild, value);
  setText($(id).lastElementChild, unit);
  $(id).classList.toggle("low", bad);
}

// The horizon as it is seen ahead: it turns against the roll, and sinks when the nose rises.
function showHorizon(motion) {
  const known = isKnown(motion?.roll) && isKnown(motion?.pitch);
  const [roll, pitch] = known ? [degrees(motion.roll), degrees(motion.pitch)] : [0, 0];
  const shown = Math.max(-PITCH_SHOWN_DEG, Math.min(PITCH_SHOWN_DEG, pitch));
  $("horizon-scene").setAttribute("transform", `rotate(${(-roll).toFixed(1)}) translate(0 ${(PIXELS_PER_DEGREE * shown).toFixed(1)})`);
  const side = (value, positive, negative) => `${Math.abs(value).toFixed(0)}° ${value < 0 ? negative : positive}`;
  const text = known ? `Attitude: roll ${side(roll, "right", "left")}, pitch ${side(pitch, "up", "down")}` : "Attitude: unknown";
  if ($("horizon").getAttribute("aria-label") !== text) $("horizon").setAttribute("aria-label", text);
  $("horizon").classList.toggle("unknown", !known);
}

function showCompass(motion) {
  const known = isKnown(motion?.yaw);
  const heading = known ? Math.round(90 - degrees(motion.yaw) + 720) % 360 : 0;
  $("compass-card").setAttribute("transform", `rotate(${-heading})`);
  const text = known ? `${String(heading).padStart(3, "0")}°` : UNKNOWN;
  setText($("compass-heading"), text);
  const label = known ? `Heading ${heading}°` : "Heading unknown";
  if ($("compass").getAttribute("aria-label") !== label) $("compass").setAttribute("aria-label", label);
}

function battery(v) {
  const percent = v.battery?.percent;
  if (!isKnown(percent)) return [[UNKNOWN, ""], false];
  const need = 100 * ((v.status?.reserve ?? 0) + (v.status?.return_share ?? 0));
  return [[fixed(percent, 0), "%"], percent < Math.min(need, 100)];
}

export function showReadouts(v, page, isOld) {
  $("glance").hidden = !v;
  if (!v) return;
  $("glance").classList.toggle("old", isOld);
  const { motion, home, feedback, fix } = v;
  const above = motion?.at ? motion.at[2] - (home?.at?.[2] ?? 0) : null;
  show("out-distance", length(feedback?.distance));
  const left = isKnown(feedback?.time) ? duration(feedback.time).split(" ") : [UNKNOWN, ""];
  show("out-time", left);
  show("out-speed", isKnown(motion?.speed) ? [fixed(motion.speed, 1), "m/s"] : [UNKNOWN, ""]);
  show("out-height", length(above));
  show("out-battery", ...battery(v));
  setText($("progress"), progress(v, page));
  $("progress").dataset.status = feedback?.status ?? "";
  $("progress").dataset.target = feedback?.target?.state ?? "";
  showHorizon(motion);
  showCompass(motion);
  const place = isKnown(fix?.latitude) && isKnown(fix?.longitude) ? coordinates(fix.latitude, fix.longitude) : "Latitude and longitude unknown";
  setText($("coordinates"), place);
}
