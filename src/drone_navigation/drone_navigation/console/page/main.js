// Joins the socket, the map, the route and the keys.

import { Alerts } from "./alerts.js";
import { Confirm } from "./confirm.js";
import { Heights } from "./heights.js";
import { Link } from "./link.js";
import { Map2D } from "./map.js";
import { setText, showPanel, unreachable } from "./panel.js";
import { Rehearsal } from "./rehearsal.js";
import { Replay } from "./replay.js";
import { Route } from "./route.js";
import { missionPoints, showScene } from "./scene.js";
import { drawSide } from "./side.js";
import { Tiles } from "./tiles.js";
import { WaypointList } from "./waypoints.js";

const $ = (id) => document.getElementById(id);
const link = new Link(new URLSearchParams(location.search).get("token") ?? "");
const route = new Route();
const confirm = new Confirm();
const map = new Map2D($("map"), route, scene);
map.tiles = new Tiles(link, () => vehicle()?.earth, () => map.draw());
let chosen = "";
let fitted = "";
let side = { marks: [] };
const heights = new Heights($("side"), route, () => side, (index) => map.adopt(index));
new WaypointList($("waypoints"), route);

const replay = new Replay((message) => send({ type: "replay", vehicle: chosen, ...message }));
const vehicle = () => link.vehicles[chosen];
const mine = () => link.control[chosen] === link.page && link.open;
const label = (name) => (name === "/" ? "vehicle" : name.slice(1));
const alerts = new Alerts(label);
// Vehicles for which a person has chosen whether obstacles are avoided.
const avoidance = {};
// The question that stands now is about this flight, and whether its danger was asked about.
let asked = null;
const ends = {};

// --- what is drawn

function active(v) {
  const points = (v?.route?.waypoints ?? []).map(([x, y, z, hold], i) => ({ x, y, z, hold, number: i + 1 }));
  return points.slice(v?.feedback?.waypoint ?? 0);
}

function offset(from, to) {
  // Each vehicle has its own map; their homes, known on the earth and in the map, relate them.
  const [a, b] = [from.home, to.home];
  if (!a?.at || !b?.at) return null;
  const north = (b.latitude - a.latitude) * 111320;
  const east = (b.longitude - a.longitude) * 111320 * Math.cos((a.latitude * Math.PI) / 180);
  return [a.at[0] + east - b.at[0], a.at[1] + north - b.at[1]];
}

function others(v) {
  return Object.entries(link.vehicles).flatMap(([name, other]) => {
    const shift = name !== chosen && other.motion && v ? offset(v, other) : null;
    if (!shift) return [];
    const [x, y, z] = other.motion.at;
    return [{ name: label(name), at: [x + shift[0], y + shift[1], z], yaw: other.motion.yaw }];
  });
}

function scene() {
  const v = vehicle();
  const points = route.points.length ? route.points : active(v);
  return {
    vehicle: v?.motion ?? null, old: !v?.alive && !v?.replay, trail: link.trails[chosen] ?? [], plan: v?.plan ?? [],
    earlier: v?.earlier ?? [], obstacles: v?.obstacles, home: v?.home?.at,
    volume: v?.flight_volume, fence: v?.fence, rally: v?.rally_points, mission: v?.mission,
    others: others(v), active: active(v), editable: points, rehearsed: rehearsal?.result,
  };
}

function draw() {
  map.draw();
  side = drawSide($("side"), scene(), route.points, heights.state);
}

function fit() {
  const s = scene();
  const points = [...s.trail, ...s.plan, ...route.points.map((p) => [p.x, p.y]), ...s.active.map((p) => [p.x, p.y])];
  points.push(...missionPoints(s.mission).map((p) => [p.x, p.y]));
  map.fit([...points, ...(s.vehicle ? [s.vehicle.at] : []), ...(s.home ? [s.home] : [])]);
}

// --- what is shown

function show() {
  const names = Object.keys(link.vehicles).sort();
  if (!names.includes(chosen)) chosen = names[0] ?? "";
  const select = $("vehicle");
  if (select.dataset.names !== names.join()) {
    select.dataset.names = names.join();
    select.replaceChildren(...names.map((name) => new Option(label(name), name)));
  }
  if (select.value !== chosen) select.value = chosen;
  const v = vehicle();
  if (v?.motion && fitted !== chosen) {
    fitted = chosen;
    fit();
    $("height").value = v.status?.landed === "on the ground" ? 5 : Math.round(v.motion.at[2]);
  }
  const holder = link.control[chosen];
  const who = mine() ? "You have control" : holder ? `Page ${holder} has control` : "Nobody has control";
  setText($("control"), who);
  $("control").classList.toggle("mine", mine());
  setText($("take").firstChild.parentElement.querySelector("span") ?? wrapTake(), mine() ? "Give control" : holder ? "Take over" : "Take control");
  $("take").disabled = !link.open || !v;
  for (const id of Object.keys(COMMANDS)) $(id).disabled = !mine() || Boolean(senseless(id));
  // Nothing is published about obstacles where none are known and no sensor reports.
  $("avoid").checked = avoidance[chosen] ?? Boolean(v?.obstacles);
  const why = unreachable(link, v);
  $("hold-note").hidden = !why;
  setText($("hold-note"), why && "cannot reach the vehicle");
  showEnd(v);
  replay.show(link.open ? v?.replay : null);
  $("fly").disabled = !mine() || !route.points.length;
  $("undo").disabled = !route.past.length;
  $("clear").disabled = $("save").disabled = !route.points.length;
  $("open").disabled = !v;
  const hint = mine() ? "Click the map for a goal, again for a route." : "Take control to fly. Click the map to draw a route.";
  setText($("route-hint"), hint);
  $("route-hint").hidden = route.points.length > 0;
  document.body.dataset.ready = String(Boolean(link.open && v?.alive && v.status?.position_valid));
  document.body.dataset.goal = v?.goal ?? "";
  alerts.look(link.vehicles);
  document.body.dataset.control = mine() ? "mine" : String(holder ?? "");
  showPanel(link, v);
  showScene(v);
  rehearsal.look();
  draw();
}

// The last word about a goal is its end, not that it was accepted.
function showEnd(v) {
  const number = v?.end?.number ?? 0;
  // Read aloud once, where the goal stands.
  if (ends[chosen] !== undefined && number > ends[chosen]) say(v.end.text, v.end.code !== "SUCCESS", "off");
  if (v) ends[chosen] = number;
}

// Why a command would make no sense now; "" if it does.
function senseless(id) {
  const { status, feedback, goal } = vehicle() ?? {};
  const paused = feedback?.status === "PAUSED";
  if (id === "takeoff" && status?.landed !== "on the ground") return "The vehicle is not on the ground.";
  if (id === "land" && status?.landed === "on the ground") return "The vehicle is on the ground.";
  if (id === "pause" && (!goal || paused)) return goal ? "The goal is paused already." : "There is no goal to pause.";
  if (id === "resume" && !paused) return "There is no paused goal.";
  return "";
}

function wrapTake() {
  const text = document.createElement("span");
  const button = $("take");
  button.firstChild.remove();
  button.prepend(text, " ");
  return text;
}

// What went wrong is also told beside the button that caused it.
const BESIDE = { fly: "fly-answer", command: "command-answer" };

function sayBeside(kind, text) {
  for (const [id, element] of Object.entries(BESIDE)) {
    const own = id === kind ? text : "";
    $(element).hidden = !own;
    setText($(element), own, true);
  }
}

function say(text, bad = false, live = "polite") {
  $("answer").ariaLive = live;
  setText($("answer"), text, bad);
  $("answer").dataset.count = Number($("answer").dataset.count ?? 0) + 1;
}

// --- what is sent

const send = (message) => link.send(message) || say("Not sent: there is no connection to the console.", true);
const stop = (type) => {
  confirm.close();
  const why = unreachable(link, vehicle());
  // Tried all the same.
  const sent = link.send({ type, vehicle: chosen });
  if (why || !sent) say(`${type.toUpperCase()} cannot reach the vehicle: ${why || "there is no connection to the console."}`, true);
};

function takeControl() {
  if (!vehicle()) return;
  if (mine()) send({ type: "give", vehicle: chosen });
  else if (!link.control[chosen]) send({ type: "take", vehicle: chosen, over: false });
  else {
    const name = chosen;
    asked = null;
    confirm.ask(`Take control of ${label(name)} from page ${link.control[name]}?`, () => {
      send({ type: "take", vehicle: name, over: true });
    });
  }
}

const needsControl = () => mine() || (say("Take control first.", true), false);

function drawn() {
  const waypoints = route.points.map(({ x, y, z, hold }) => ({ x, y, z, hold }));
  const value = (id, least) => Math.max($(id).valueAsNumber || 0, least);
  return { waypoints, speed: value("speed", 0), laps: Math.round(value("laps", 1)), avoid: $("avoid").checked };
}

const rehearsal = new Rehearsal($("rehearsal"), link, () => {
  return route.points.length && vehicle()?.alive && !vehicle().replay ? { vehicle: chosen, ...drawn() } : null;
}, () => [vehicle()?.motion?.at.map(Math.round), vehicle()?.status?.landed, vehicle()?.obstacles?.seen.length], draw);

function fly() {
  if (!route.points.length) return say("Click the map first: there is no waypoint.", true);
  if (!needsControl()) return undefined;
  const name = chosen;
  const order = drawn();
  const { waypoints } = order;
  const first = waypoints[0];
  const what = waypoints.length > 1 ? `the route of ${waypoints.length} waypoints` : `to east ${first.x}, north ${first.y}, up ${first.z} m`;
  const ground = vehicle()?.status?.landed === "on the ground" ? " It may arm and take off." : "";
  const untried = rehearsal.pending ? " It is not rehearsed yet." : "";
  const danger = rehearsal.danger;
  const usual = () => confirm.ask(`${label(name)}: fly ${what}?${ground}${untried}`, (confirmed) => {
    sayBeside("", "");
    send({ type: "fly", vehicle: name, confirmed, ...order });
  });
  asked = { key: JSON.stringify(order), danger };
  if (!danger) return usual();
  return confirm.ask(`${danger} Fly into this danger all the same?`, usual, true);
}

// The result of the rehearsal may come, or change, while the usual question stands.
function askAboutDanger() {
  if (!confirm.asking || !asked || asked.danger || !rehearsal.danger) return;
  if (asked.key === JSON.stringify(drawn())) fly();
}

function command(id, text) {
  if (!needsControl()) return;
  asked = null;
  const why = senseless(id);
  if (why) {
    say(why, true);
    sayBeside("command", why);
    return;
  }
  sayBeside("", "");
  const name = chosen;
  const message = { type: "command", vehicle: name, name: id };
  if (id === "takeoff") message.height = Math.max($("height").valueAsNumber || 0, 0);
  if (id === "pause") send(message);
  else confirm.ask(`${text(message)} ${label(name)}?`, (confirmed) => send({ ...message, confirmed }));
}

const COMMANDS = {
  takeoff: (m) => `Take off to ${m.height ? `${m.height} m` : "the default height"} with`,
  land: () => "Land",
  return: () => "Return to launch with",
  pause: () => "Pause",
  resume: () => "Resume the goal of",
};

// --- plans

function openPlan(file) {
  if (!file || !chosen) return;
  file.text().then((text) => send({ type: "read_plan", vehicle: chosen, text }));
}

function savePlan() {
  const waypoints = route.points.map(({ x, y, z, hold }) => ({ x, y, z, hold }));
  if (waypoints.length) send({ type: "save_plan", vehicle: chosen, waypoints });
}

const stored = (form) => vehicle()?.mission?.items.length && send({ type: "mission", vehicle: chosen, form });

link.addEventListener("plan", ({ detail }) => {
  route.replace(detail.waypoints);
  fit();
  say(["The plan is on the map.", ...detail.notes].join(" "));
});
link.addEventListener("plan_file", ({ detail }) => {
  const address = URL.createObjectURL(new Blob([detail.text], { type: "application/json" }));
  Object.assign(document.createElement("a"), { href: address, download: "route.plan" }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
});
link.addEventListener("answer", ({ detail }) => {
  say(detail.text, !detail.success);
  sayBeside(detail.to, detail.success ? "" : detail.text);
  // From now on it is the vehicle's; a rejected one stays, to be mended.
  if (detail.to === "fly" && detail.success) route.replace([]);
});

// --- keys

const selectedMove = (dx, dy, dz) => {
  const p = route.points[route.selected];
  if (p) route.move(route.selected, { x: p.x + dx, y: p.y + dy, z: p.z + dz });
};
const arrow = (event, dx, dy) => {
  const step = event.shiftKey ? 10 : 1;
  if (event.altKey) selectedMove(dx * step, dy * step, 0);
  else map.moveCross(dx * step, dy * step);
};
const place = (x, y) => route.add({ x, y, z: $("height").valueAsNumber || 0, hold: 0 });
const choose = (by) => route.points.length && route.select((route.selected + by + route.points.length) % route.points.length);
const KEYS = [
  ["h", "Hold: end the goal and hold", () => stop("hold")],
  ["c", "Cancel the goal", () => stop("cancel")],
  ["v", "Take or give control", takeControl],
  ["g", "Fly the route", fly],
  ...Object.entries(COMMANDS).map(([id, text], i) => ["tlbpr"[i], $(id).firstChild.textContent.trim(), () => command(id, text)]),
  ["ArrowLeft", "Move the cross by 1 m; with Shift 10 m; with Alt the waypoint", (e) => arrow(e, -1, 0)],
  ["ArrowRight", "", (e) => arrow(e, 1, 0)],
  ["ArrowUp", "", (e) => arrow(e, 0, 1)],
  ["ArrowDown", "", (e) => arrow(e, 0, -1)],
  ["Enter", "Add a waypoint at the cross", () => map.cross && place(map.cross.x, map.cross.y)],
  ["n", "Next waypoint", () => choose(1)],
  ["i", "Insert a waypoint after it", () => route.selected >= 0 && route.insertAfter(route.selected)],
  ["Delete", "Delete it", () => route.remove(route.selected)],
  ["PageUp", "Raise it by 1 m", () => selectedMove(0, 0, 1)],
  ["PageDown", "Lower it by 1 m", () => selectedMove(0, 0, -1)],
  ["u", "Undo", () => route.undo()],
  ["o", "Open a .plan", () => $("file").click()],
  ["s", "Save a .plan", savePlan],
  ["m", "Use the vehicle's mission as route", () => stored("route")],
  ["+", "Zoom in", () => map.zoom(1.3)],
  ["-", "Zoom out", () => map.zoom(1 / 1.3)],
  ["f", "Follow the vehicle", () => map.setFollowing(!map.following)],
  ["a", "Acknowledge the alerts", () => alerts.acknowledge()],
  ["d", "Day or night", theme],
  ...replay.keys,
  ["?", "Show the keys", help],
];

addEventListener("keydown", (event) => {
  if (event.ctrlKey && event.key === "z") return route.undo();
  // A list that scrolls keeps the arrows, as a field does.
  const typing = event.target instanceof HTMLInputElement && event.target.type === "number" || event.target instanceof HTMLOListElement;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const pressing = event.target instanceof HTMLButtonElement || event.target instanceof HTMLSelectElement;
  if (event.ctrlKey || event.metaKey || event.repeat && "hcvgtlbpr".includes(key)) return undefined;
  if (typing && !/^[a-z?]$/.test(key) || pressing && !/^[a-z?+-]$/.test(key)) return undefined;
  const found = KEYS.find(([name]) => name === key);
  if (key === "Escape") $("keys").close();
  if (!found) return undefined;
  event.preventDefault();
  found[2](event);
  return draw();
});

function theme() {
  const root = document.documentElement;
  root.dataset.theme = root.dataset.theme === "night" ? "day" : "night";
  try { localStorage.setItem("theme", root.dataset.theme); } catch { /* not kept then */ }
  draw();
}

function help() {
  $("key-rows").replaceChildren(...KEYS.filter(([, what]) => what).map(([key, what]) => {
    const row = document.createElement("tr");
    row.append(...[key.replace("ArrowLeft", "Arrows").replace(" ", "Space").toUpperCase(), what].map((text) => Object.assign(document.createElement("td"), { textContent: text })));
    return row;
  }));
  // Not modal: what stops the vehicle stays in reach.
  if ($("keys").open) $("keys").close();
  else $("keys").show();
}

// --- wiring

let kept = null;
try { kept = localStorage.getItem("theme"); } catch { /* none is kept */ }
document.documentElement.dataset.theme = kept ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "night" : "day");
for (const id of Object.keys(COMMANDS)) $(id).onclick = () => command(id, COMMANDS[id]);
const CLICKS = {
  take: takeControl, fly, undo: () => route.undo(), clear: () => route.replace([]), save: savePlan,
  open: () => $("file").click(), "mission-route": () => stored("route"), "mission-save": () => stored("file"), theme, help, hold: () => stop("hold"), cancel: () => stop("cancel"),
  "zoom-in": () => map.zoom(1.3), "zoom-out": () => map.zoom(1 / 1.3), fit, follow: () => map.setFollowing(!map.following),
};
for (const [id, act] of Object.entries(CLICKS)) $(id).onclick = act;
$("file").onchange = (event) => { openPlan(event.target.files[0]); event.target.value = ""; };
$("vehicle").onchange = (event) => {
  chosen = event.target.value;
  confirm.close();
  route.past = [];
  route.points = [];
  route.changed();
  show();
};
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => { event.preventDefault(); openPlan(event.dataTransfer.files[0]); });
map.addEventListener("place", ({ detail }) => place(detail.x, detail.y));
map.addEventListener("following", () => { $("follow").setAttribute("aria-pressed", String(map.following)); draw(); });
map.addEventListener("adopt", (event) => {
  if (!route.points.length) route.replace(active(vehicle()));
  if (!route.points[event.detail.index]) event.detail.index = -1;
});
route.addEventListener("change", () => { confirm.close(); show(); });
link.addEventListener("state", show);
link.addEventListener("rehearsal", askAboutDanger);
$("avoid").onchange = () => { avoidance[chosen] = $("avoid").checked; show(); };
// Ages grow also while nothing arrives.
setInterval(show, 1000);
addEventListener("resize", draw);
show();
