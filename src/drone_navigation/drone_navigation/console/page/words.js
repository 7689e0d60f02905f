// The words of the page: what a pilot would say for statuses, actions, pages and events.

const STATUSES = {
  PREPARING: "Getting ready", ARMING: "Arming", TAKING_OFF: "Taking off", NAVIGATING: "Under way", SETTLING: "Settling at the target",
  HOLDING: "Holding, the position is in doubt", PAUSED: "Paused", BLOCKED: "Blocked", WAITING_FOR_TRAFFIC: "Waiting for other vehicles",
  UPLOADING: "Sending the mission", RETURNING: "Returning", LANDING: "Landing", CANCELLING: "Stopping", LINK_LOST: "Link lost",
};
const ACTIONS = { navigate_to_waypoint: "Goal", navigate_waypoints: "Route", follow_target: "Following", orbit: "Orbit", takeoff: "Take-off", land: "Landing", return_to_launch: "Return" };
const FAILSAFES = {
  VEHICLE_FAILSAFE: "the autopilot's own", FAILSAFE_BATTERY: "battery", FAILSAFE_FENCE: "fence", FAILSAFE_RC: "radio control lost",
  FAILSAFE_GCS: "ground station lost", FAILSAFE_GPS: "position lost", FAILSAFE_OFFBOARD: "setpoints lost",
};
const ITEMS = {
  NAV_WAYPOINT: "Waypoint", NAV_TAKEOFF: "Take off", NAV_LAND: "Land", NAV_RETURN_TO_LAUNCH: "Return to launch", NAV_LOITER_UNLIM: "Loiter",
  NAV_LOITER_TIME: "Loiter", NAV_LOITER_TURNS: "Circle", DO_JUMP: "Jump", DO_CHANGE_SPEED: "Change speed", NAV_SPLINE_WAYPOINT: "Curved waypoint",
};
// What the first parameters of a mission's item mean, where they are set.
const PARAMETERS = {
  NAV_WAYPOINT: ([hold]) => hold && `hold ${hold} s`,
  NAV_SPLINE_WAYPOINT: ([hold]) => hold && `hold ${hold} s`,
  NAV_LOITER_TIME: ([time]) => time && `for ${time} s`,
  NAV_LOITER_TURNS: ([turns]) => turns && `${turns} ${turns === 1 ? "turn" : "turns"}`,
  NAV_TAKEOFF: () => "",
  NAV_LAND: () => "",
  NAV_LOITER_UNLIM: () => "",
  NAV_RETURN_TO_LAUNCH: () => "",
  DO_JUMP: ([to, times]) => `to item ${to}, ${times < 0 ? "again and again" : `${times} ${times === 1 ? "time" : "times"}`}`,
  DO_CHANGE_SPEED: ([, speed]) => speed > 0 && `${speed} m/s`,
};

// "WAITING_FOR_SOMETHING" as "Waiting for something".
const sentence = (word) => (word ? word[0] + word.slice(1).toLowerCase().replaceAll("_", " ") : "");

export const status = (code) => STATUSES[code] ?? sentence(code ?? "");
export const action = (name) => ACTIONS[name] ?? sentence((name ?? "").toUpperCase());

export const failsafe = (code) => FAILSAFES[code] ?? sentence(code);

// A vehicle's namespace as its name.
export const vehicleName = (namespace) => (namespace === "/" ? "vehicle" : namespace.slice(1));

// Who sent a goal: `by` names the page, as the console does; empty for another program.
export function sender(by, page) {
  if (!by) return "another program";
  return by === `page ${page}` ? "this page" : "another page";
}

// An item of a mission: its name, and what its first parameters mean.
export function missionItem(name, values) {
  const first = values.slice(0, 4).filter((value) => value);
  const meaning = PARAMETERS[name] ? PARAMETERS[name](values) : first.length && `parameters ${first.join(", ")}`;
  return [ITEMS[name] ?? sentence(name.replace(/^(NAV|DO)_/, "")), meaning || ""];
}

// The outcome of a goal without its code, which is for programs.
export const withoutCode = (text, code) => (code && text.startsWith(`${code}: `) ? text.slice(code.length + 2) : text);

export function eventText(event, page) {
  const { kind, text, code, by } = event;
  if (kind === "vehicle") return `Autopilot: ${text}`;
  if (kind === "accepted") return `Accepted from ${sender(by, page)}: ${text}.`;
  if (kind === "rejected") return `Rejected: ${text}`;
  if (kind === "status") return [`${status(code)}${text ? ":" : "."}`, text].filter(Boolean).join(" ");
  if (kind === "ended") return code === "SUCCESS" ? `Done: ${text}` : `Ended: ${text}`;
  return text;
}

// How a goal ended; `about` names it.
export function endText(end, about = "") {
  const how = end.event === "REJECTED" ? "rejected" : end.code === "SUCCESS" ? "done" : "ended";
  const words = `${about} ${how}`.trim();
  return `${words[0].toUpperCase()}${words.slice(1)}: ${end.text}`;
}

// A time in s as m:ss, below a minute in s.
export function duration(seconds) {
  const whole = Math.max(0, Math.round(seconds));
  return whole < 60 ? `${whole} s` : `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")} min`;
}

// A position on the earth, in degrees.
export function coordinates(latitude, longitude) {
  const part = (value, positive, negative) => `${Math.abs(value).toFixed(6)}° ${value < 0 ? negative : positive}`;
  return `${part(latitude, "N", "S")}, ${part(longitude, "E", "W")}`;
}

export function joined(names) {
  return names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names[names.length - 1]}`;
}
