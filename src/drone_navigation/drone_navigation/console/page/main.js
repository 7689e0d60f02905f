// Joins the socket, the map, the route and the keys.

import { ActList } from "./acts.js";
import { Alerts } from "./alerts.js";
import { Confirm } from "./confirm.js";
import { Drafts, ofPage } from "./drafts.js";
import { FleetStrip } from "./fleet.js";
import { Heights } from "./heights.js";
import { Link } from "./link.js";
import { Map2D } from "./map.js";
import { setText, showPanel, unreachable } from "./panel.js";
import { showReadouts } from "./readouts.js";
import { Rehearsal } from "./rehearsal.js";
import { Replay } from "./replay.js";
import { Route } from "./route.js";
import { missionPoints, showScene } from "./scene.js";
import { drawSide } from "./side.js";
import { describedLanding, describedTarget, landing, target } from "./target.js";
import { Tiles } from "./tiles.js";
import { Together } from "./together.js";
import { WaypointList } from "./waypoints.js";
import { endText, joined, vehicleName } from "./words.js";

const $ = (id) => document.getElementById(id);
const link = new Link(new URLSearchParams(location.search).get("token") ?? "");
const route = new Route();
const drafts = new Drafts(route);
const confirm = new Confirm();
const map = new Map2D($("map"), route, scene);
map.tiles = new Tiles(link, () => vehicle()?.earth, () => map.draw());
let chosen = "";
let fitted = "";
let heightFor = "";
let side = { marks: [] };
const heights = new Heights($("side"), route, () => side, (index) => map.adopt(index));
new WaypointList($("waypoints"), route);
new ActList(route);

const replay = new Replay((message) => send({ type: "replay", vehicle: chosen, ...message }));
const vehicle = () => link.vehicles[chosen];
const names = () => Object.keys(link.vehicles).sort();
const isMine = (name) => link.control[name] === link.page && link.open;
const mine = () => isMine(chosen);
const label = vehicleName;
const alerts = new Alerts(label);
const strip = new FleetStrip($("fleet-list"), link, select);
// So near to a click a vehicle is meant, in pixels.
const REACH_PX = 22;
// A vehicle that is farther away is not on this map.
const FAR_M = 20000;
// Vehicles for which a person has chosen whether obstacles are avoided.
const avoidance = {};
// The question that stands now is about this flight, and whether its danger was asked about.
let asked = null;
const ends = {};
// Answers that belong together: of the vehicles that are still missing, and the texts that came.
let gathered = null;

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

const moved = (points, [dx, dy]) => points.map(([x, y, z]) => [x + dx, y + dy, z]);

// The other vehicles that can be placed in the map of this one: name, vehicle, and where its zero is.
function placed(v) {
  return names().flatMap((name) => {
    const other = link.vehicles[name];
    const shift = name !== chosen && v ? offset(v, other) : null;
    return shift && Math.hypot(...shift) < FAR_M ? [{ name, other, shift }] : [];
  });
}

function others(v) {
  return placed(v).filter(({ other }) => other.motion).map(({ name, other, shift }) => {
    return { vehicle: name, name: label(name), at: moved([other.motion.at], shift)[0], yaw: other.motion.yaw };
  });
}

// The other vehicles' routes and rehearsed paths, and where vehicles come nearest.
function inMap(v) {
  const shifts = Object.fromEntries([[chosen, [0, 0]], ...placed(v).map(({ name, shift }) => [name, shift])]);
  const drawn = placed(v).map(({ name, other, shift }) => {
    const points = drafts.of(name).points.length ? drafts.of(name).points : active(other);
    const at = other.motion?.at;
    const route = points.length && at ? [at, ...points.map((p) => [p.x, p.y, p.z])] : [];
    return { route: moved(route, shift), path: moved(together.result?.vehicles[name]?.rehearsal?.path_enu_m ?? [], shift) };
  });
  const meetings = together.meetings.filter(({ is_too_near: bad }, i) => bad || i === 0).flatMap(({ vehicles, positions_m: at, distance_m: gap, is_too_near: bad }) => {
    if (!vehicles.every((name) => shifts[name])) return [];
    const [from, to] = vehicles.map((name, i) => moved([at[i]], shifts[name])[0]);
    return [{ from, to, bad, text: `${bad ? "too near: " : ""}${gap.toFixed(1)} m` }];
  });
  return { others: drawn, meetings };
}

// The circle that would be flown around the only waypoint.
function ring() {
  const { waypoints: [centre], radius } = drafts.order(chosen) ?? { waypoints: [] };
  return radius ? { at: [centre.x, centre.y], radius: Math.abs(radius) } : null;
}

function scene() {
  const v = vehicle();
  const points = route.points.length ? route.points : active(v);
  return {
    vehicle: v?.motion ?? null, old: !v?.alive && !v?.replay, trail: link.trails[chosen] ?? [], plan: v?.plan ?? [],
    earlier: v?.earlier ?? [], obstacles: v?.obstacles, home: v?.home?.at,
    volume: v?.flight_volume, fence: v?.fence, rally: v?.rally_points, mission: v?.mission,
    others: others(v), active: active(v), editable: points, ring: ring(), area: route.area, holes: route.holes, rehearsed: rehearsal?.result,
    together: together ? inMap(v) : null, photos: v?.photos ?? [], target: v?.feedback?.target?.at ? v.feedback.target : null,
  };
}

function draw() {
  map.draw();
  side = drawSide($("side"), scene(), route.points, heights.state);
}

function fit() {
  const s = scene();
  const points = [...s.trail, ...s.plan, ...route.points.map((p) => [p.x, p.y]), ...s.active.map((p) => [p.x, p.y])];
  points.push(...missionPoints(s.mission).map((p) => [p.x, p.y]), ...s.others.map((other) => other.at));
  if (s.target) points.push(s.target.at);
  if (s.ring) points.push(...[-1, 1].map((side) => s.ring.at.map((at) => at + side * s.ring.radius)));
  points.push(...(s.together?.others ?? []).flatMap((other) => other.route));
  points.push(...(s.vehicle ? [s.vehicle.at] : []), ...(s.home ? [s.home] : []));
  map.fit(points, [$("glance"), document.querySelector(".tools")]);
}

// --- what is shown

function show() {
  const all = names();
  if (!all.includes(chosen)) chosen = all[0] ?? "";
  drafts.edit(chosen);
  strip.show(all, chosen, (name) => drafts.of(name).points.length > 0);
  setText($("vehicle"), all.length > 1 ? label(chosen) : "Vehicle");
  const v = vehicle();
  const shown = [chosen, ...others(v).map((other) => other.vehicle)].join();
  if (v?.motion && fitted !== shown) {
    fitted = shown;
    fit();
  }
  // Whether it is on the ground becomes known after where it is.
  const known = v?.motion ? `${chosen} ${Boolean(v.status?.landed)}` : heightFor;
  if (known !== heightFor) {
    heightFor = known;
    $("height").value = v.status?.landed === "on the ground" ? 5 : Math.round(v.motion.at[2]);
  }
  const holder = link.control[chosen];
  const who = mine() ? "You have control" : holder ? "Another page has control" : "Nobody has control";
  setText($("control"), who);
  $("control").classList.toggle("mine", mine());
  setText($("take").firstChild.parentElement.querySelector("span") ?? wrapTake(), mine() ? "Give control" : holder ? "Take over" : "Take control");
  $("take").disabled = !link.open || !v;
  for (const id of Object.keys(COMMANDS)) $(id).disabled = !mine() || Boolean(senseless(id));
  // Nothing is published about obstacles where none are known and no sensor reports.
  $("avoid").checked = avoids(chosen);
  const why = unreachable(link, v);
  $("hold-note").hidden = !why;
  setText($("hold-note"), why && "cannot reach the vehicle");
  showEnds();
  replay.show(link.open ? v?.replay : null);
  $("fly").disabled = !mine() || !route.points.length;
  const drawn = orders();
  $("together").hidden = all.length < 2;
  $("hold-all").hidden = all.length < 2;
  $("fly-all").disabled = drawn.length < 2 || !drawn.every(({ vehicle: name }) => isMine(name));
  $("take-all").disabled = !link.open || all.every(isMine);
  $("undo").disabled = !route.past.length;
  $("clear").disabled = !route.points.length && !route.holes.length;
  $("save").disabled = !route.points.length;
  $("open").disabled = !v;
  $("track").disabled = !mine() || !target();
  $("photo").disabled = $("point").disabled = !mine();
  if (!mine() && isPointing()) setPointing(false);
  $("hole").disabled = route.points.length < 3 || route.area.length > 0;
  $("survey").disabled = corners().length < 3 || !v?.alive || Boolean(v.replay);
  const hint = mine() ? "Click the map for a goal, again for a route." : "Take control to fly. Click the map to draw a route.";
  setText($("route-hint"), hint);
  $("route-hint").hidden = route.points.length > 0;
  document.body.dataset.ready = String(Boolean(link.open && v?.alive && v.status?.position_valid));
  document.body.dataset.goal = v?.goal ?? "";
  alerts.look(link.vehicles);
  document.body.dataset.control = mine() ? "mine" : String(holder ?? "");
  const old = showPanel(link, v);
  showReadouts(v, link.page, old);
  showScene(v);
  rehearsal.look();
  together.look();
  draw();
}

// Shows and edits another vehicle; its route is kept, and so is that of the one before.
function select(name) {
  if (name === chosen) return;
  chosen = name;
  confirm.close();
  show();
}

// The last word about a goal is its end, not that it was accepted. Of all vehicles.
function showEnds() {
  for (const [name, v] of Object.entries(link.vehicles)) {
    const number = v.end?.number ?? 0;
    const isNew = ends[name] !== undefined && number > ends[name];
    // That of this vehicle is read aloud once, where the goal stands.
    if (isNew) say(of(name) + endText(v.end), v.end.code !== "SUCCESS", name === chosen ? "off" : "polite");
    ends[name] = number;
  }
}

// A sentence is about one of several vehicles.
const of = (name) => (name && names().length > 1 ? `${label(name)}: ` : "");

// Why a command would make no sense now; "" if it does.
function senseless(id) {
  const { status, feedback, goal, interrupted } = vehicle() ?? {};
  const paused = feedback?.status === "PAUSED";
  if (id === "takeoff" && status?.landed !== "on the ground") return "The vehicle is not on the ground.";
  if (id === "land" && status?.landed === "on the ground") return "The vehicle is on the ground.";
  if (id === "pause" && (!goal || paused)) return goal ? "The goal is paused already." : "There is no goal to pause.";
  if (id === "resume" && !paused) return "There is no paused goal.";
  if (id === "continue" && !interrupted) return "There is no interrupted route.";
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
const BESIDE = { fly: "fly-answer", survey: "survey-answer", follow: "track-answer", command: "command-answer", photo: "command-answer", point: "command-answer", fly_all: "together-answer" };

function sayBeside(kind, text) {
  for (const element of new Set(Object.values(BESIDE))) {
    const own = BESIDE[kind] === element ? text : "";
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

// Tried for every vehicle, also one that seems out of reach.
function holdAll() {
  confirm.close();
  const all = names();
  gather("hold", all);
  const missed = all.filter((name) => {
    const sent = link.send({ type: "hold", vehicle: name });
    return !sent || unreachable(link, link.vehicles[name]);
  });
  if (missed.length) say(`HOLD ALL cannot reach ${joined(missed.map(label))}.`, true);
}

function takeControlOfAll() {
  const wanted = names().filter((name) => !isMine(name));
  const held = wanted.filter((name) => link.control[name]);
  const take = () => wanted.forEach((name) => send({ type: "take", vehicle: name, over: held.includes(name) }));
  asked = null;
  if (!held.length) take();
  else confirm.ask(`Another page has control of ${joined(held.map(label))}. Take control of all?`, take);
}

function takeControl() {
  if (!vehicle()) return;
  if (mine()) send({ type: "give", vehicle: chosen });
  else if (!link.control[chosen]) send({ type: "take", vehicle: chosen, over: false });
  else {
    const name = chosen;
    asked = null;
    confirm.ask(`Another page has control of ${label(name)}. Take it over?`, () => {
      send({ type: "take", vehicle: name, over: true });
    });
  }
}

const needsControl = () => mine() || (say("Take control first.", true), false);

const avoids = (name) => avoidance[name] ?? Boolean(link.vehicles[name]?.obstacles);

// What would be flown by a vehicle; null without a route.
function orderOf(name) {
  const order = drafts.order(name);
  return order && { ...order, avoid: avoids(name) };
}

// What would be flown by all that are there and have a route.
const orders = () => names().filter((name) => link.vehicles[name].alive && !link.vehicles[name].replay).map(orderOf).filter(Boolean);
const where = (v) => [v?.motion?.at.map(Math.round), v?.status?.landed, v?.obstacles?.seen.length];

const rehearsal = new Rehearsal($("rehearsal"), link, () => {
  return vehicle()?.alive && !vehicle().replay ? orderOf(chosen) : null;
}, () => where(vehicle()), draw);
const together = new Together(link, orders, () => names().map((name) => where(link.vehicles[name])), draw);

function described({ vehicle: name, waypoints, radius, laps }) {
  const [first] = waypoints;
  if (radius) {
    const times = laps > 1 ? `${laps} times ` : "";
    return `${times}${radius < 0 ? "clockwise" : "anticlockwise"} on a circle of ${Math.abs(radius)} m around east ${first.x}, north ${first.y}, up ${first.z} m`;
  }
  const turn = drafts.turn(name);
  const turning = turn ? `, turning ${turn < 0 ? "left" : "right"} with ${Math.abs(turn)}°/s` : "";
  if (drafts.of(name).area.length) return `the survey by ${waypoints.length} waypoints${turning}`;
  if (turn && waypoints.length === 1) return `to east ${first.x}, north ${first.y}, up ${first.z} m${turning}`;
  return waypoints.length > 1 ? `the route of ${waypoints.length} waypoints${turning}` : `to east ${first.x}, north ${first.y}, up ${first.z} m`;
}

const mayTakeOff = (list) => (list.some((name) => link.vehicles[name]?.status?.landed === "on the ground") ? " It may arm and take off." : "");

// Asks before a flight: about its danger first, if there is one. `flight` has the sentence, what
// is known of it, and what sends it.
function askToFly(flight) {
  const danger = flight.rehearsed.danger;
  const untried = flight.rehearsed.pending ? " It is not rehearsed yet." : "";
  const usual = () => confirm.ask(`${flight.text}${untried}`, flight.go);
  asked = { flight, key: flight.key(), danger };
  if (danger) confirm.ask(`${danger} Fly into this danger all the same?`, usual, true);
  else usual();
}

// The result of the rehearsal may come, or change, while the usual question stands.
function askAboutDanger() {
  if (!confirm.asking || !asked || asked.danger || !asked.flight.rehearsed.danger) return;
  if (asked.key === asked.flight.key()) askToFly(asked.flight);
}

function fly() {
  if (!route.points.length) return say("Click the map first: there is no waypoint.", true);
  if (!needsControl()) return undefined;
  const name = chosen;
  const order = orderOf(name);
  return askToFly({
    text: `${label(name)}: fly ${described(order)}?${mayTakeOff([name])}`,
    rehearsed: rehearsal,
    key: () => JSON.stringify(orderOf(chosen)),
    go: (confirmed) => {
      sayBeside("", "");
      send({ type: "fly", confirmed, ...order, turn: drafts.turn(name) });
    },
  });
}

function flyAll() {
  const all = orders();
  const missing = all.map(({ vehicle: name }) => name).filter((name) => !isMine(name));
  if (all.length < 2) return say("Draw routes for two vehicles or more first.", true);
  if (missing.length) return say(`Take control of ${joined(missing.map(label))} first.`, true);
  const flown = joined(all.map((order) => `${label(order.vehicle)} ${described(order)}`));
  return askToFly({
    text: `Fly all ${all.length} together: ${flown}?${mayTakeOff(all.map((order) => order.vehicle))}`,
    rehearsed: together,
    key: () => JSON.stringify(orders()),
    go: (confirmed) => {
      sayBeside("", "");
      gather("fly", all.map((order) => order.vehicle));
      for (const order of all) send({ type: "fly", confirmed, ...order, turn: drafts.turn(order.vehicle) });
    },
  });
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
  if (id === "land") Object.assign(message, landing());
  if (id === "pause") send(message);
  else confirm.ask(`${text(message)} ${label(name)}?${id === "continue" ? mayTakeOff([name]) : ""}`, (confirmed) => send({ ...message, confirmed }));
}

const COMMANDS = {
  takeoff: (m) => `Take off to ${m.height ? `${m.height} m` : "the default height"} with`,
  land: describedLanding,
  return: () => "Return to launch with",
  pause: () => "Pause",
  resume: () => "Resume the goal of",
  continue: () => `Continue the route at waypoint ${vehicle().interrupted.next} of ${vehicle().interrupted.waypoints} with`,
};

// The camera: neither moves the vehicle, so that they are not confirmed.
function photo() {
  if (needsControl()) send({ type: "photo", vehicle: chosen });
}

function setPointing(pointing) {
  $("point").setAttribute("aria-pressed", String(pointing));
  if (pointing) say("Click the map where the camera shall look, at the height of home.");
}

const isPointing = () => $("point").getAttribute("aria-pressed") === "true";

function point(x, y) {
  setPointing(false);
  send({ type: "point", vehicle: chosen, x, y, z: vehicle()?.home?.at?.[2] ?? 0 });
}

const togglePointing = () => needsControl() && setPointing(!isPointing());

// It is not rehearsed: nobody knows how the target moves. The vehicle has to fly already.
function track() {
  const found = target();
  if (!found) return say("Name the target's topic, frame or system first.", true);
  if (!needsControl()) return undefined;
  const name = chosen;
  asked = null;
  return confirm.ask(`${label(name)}: follow ${describedTarget(found)}?`, (confirmed) => {
    sayBeside("", "");
    send({ type: "follow", vehicle: name, confirmed, ...found });
  });
}

// --- surveys

// Corners of the area: those of the survey that is drawn, or else the waypoints.
const corners = () => (route.area.length ? route.area : route.points.map(({ x, y }) => ({ x, y })));

function survey() {
  if ($("survey").disabled) return say("Draw three corners of the area, or more, first.", true);
  sayBeside("", "");
  const camera = surveyCamera();
  return send({
    type: "survey", vehicle: chosen, corners: corners(), holes: route.holes, height: $("height").valueAsNumber || 0, camera,
    spacing: Math.max($("spacing").valueAsNumber || 0, camera ? 0 : 0.5), speed: Math.max($("speed").valueAsNumber || 0, 0),
  });
}

// The camera of a survey; null without a focal length.
function surveyCamera() {
  const [width, height, focal, side, front] = ["width", "height", "focal", "side", "front"].map((name) => $(`camera-${name}`).valueAsNumber || 0);
  return focal > 0 ? { width, height, focal, side: side / 100, front: front / 100 } : null;
}

function hole() {
  if (!$("hole").disabled) route.makeHole();
}

link.addEventListener("survey", ({ detail }) => {
  if (detail.vehicle !== chosen) return;
  route.replace(detail.waypoints, detail.corners.map(([x, y]) => ({ x, y })), route.holes);
  fit();
  const photos = detail.photos ? ` ${detail.photos} photos.` : "";
  say(`The survey is on the map: ${detail.area.toFixed(0)} m². ${detail.text}${photos}`);
});

// --- plans

function openPlan(file) {
  if (!file || !chosen) return;
  file.text().then((text) => send({ type: "read_plan", vehicle: chosen, text }));
}

function savePlan() {
  const waypoints = route.points.map(ofPage);
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
// The answers of several vehicles are shown together.
function gather(kind, list) {
  gathered = { kind, left: new Set(list), texts: [], bad: false };
}

link.addEventListener("answer", ({ detail }) => {
  const { to, vehicle: name, success } = detail;
  let text = of(name) + detail.text;
  let bad = !success;
  const isOne = gathered?.kind === to && gathered.left.delete(name);
  if (isOne) {
    gathered.texts.push(text);
    gathered.bad ||= bad;
    [text, bad] = [gathered.texts.join(" "), gathered.bad];
  }
  say(text, bad);
  sayBeside(isOne && to === "fly" ? "fly_all" : to, bad ? text : "");
  // From now on it is the vehicle's; a rejected one stays, to be mended.
  if (to === "fly" && success) drafts.clear(name);
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
  ["H", "Hold all vehicles", holdAll],
  ["c", "Cancel the goal", () => stop("cancel")],
  ["v", "Take or give control", takeControl],
  ["g", "Fly the route", fly],
  ["G", "Fly the routes of all vehicles", flyAll],
  ["e", "Next vehicle", () => select(names()[(names().indexOf(chosen) + 1) % names().length] ?? "")],
  ...Object.entries(COMMANDS).map(([id, text], i) => ["tlbprk"[i], $(id).firstChild.textContent.trim(), () => command(id, text)]),
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
  ["y", "Survey the area whose corners are drawn", survey],
  ["w", "Follow the target that is named", track],
  ["j", "Take a photo", photo],
  ["q", "Point the camera at the next click on the map", togglePointing],
  ["u", "Undo", () => route.undo()],
  ["o", "Open a .plan", () => $("file").click()],
  ["s", "Save a .plan", savePlan],
  ["m", "Use the vehicle's mission as route", () => stored("route")],
  ["+", "Zoom in", () => map.zoom(1.3)],
  ["-", "Zoom out", () => map.zoom(1 / 1.3)],
  ["z", "Show all", fit],
  ["f", "Follow the vehicle", () => map.setFollowing(!map.following)],
  ["a", "Acknowledge the alerts", () => alerts.acknowledge()],
  ["d", "Day or night", theme],
  ...replay.keys,
  ["?", "Show the keys", help],
];

addEventListener("keydown", (event) => {
  if (event.ctrlKey && event.key === "z") return route.undo();
  if (event.target instanceof HTMLInputElement && event.target.type === "text") return undefined;
  // A list that scrolls keeps the arrows, as a field does.
  const typing = event.target instanceof HTMLInputElement && event.target.type === "number" || event.target instanceof HTMLOListElement;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const pressing = event.target instanceof HTMLButtonElement || event.target instanceof HTMLSelectElement;
  if (event.ctrlKey || event.metaKey || event.repeat && "hcvgtlbprk".includes(key)) return undefined;
  if (typing && !/^[a-z?]$/.test(key) || pressing && !/^[a-z?+-]$/.test(key)) return undefined;
  const found = KEYS.find(([name]) => name === (event.shiftKey ? key.toUpperCase() : key)) ?? KEYS.find(([name]) => name === key);
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

function keyName(key) {
  if (/^[A-Z]$/.test(key)) return `Shift ${key}`;
  return key.replace("ArrowLeft", "Arrows").replace(" ", "Space").toUpperCase();
}

function help() {
  $("key-rows").replaceChildren(...KEYS.filter(([, what]) => what).map(([key, what]) => {
    const row = document.createElement("tr");
    row.append(...[keyName(key), what].map((text) => Object.assign(document.createElement("td"), { textContent: text })));
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
  take: takeControl, fly, undo: () => route.undo(), clear: () => route.replace([]), save: savePlan, survey, hole, track, photo, point: togglePointing,
  open: () => $("file").click(), "mission-route": () => stored("route"), "mission-save": () => stored("file"), theme, help, hold: () => stop("hold"), cancel: () => stop("cancel"),
  "hold-all": holdAll, "fly-all": flyAll, "take-all": takeControlOfAll,
  "zoom-in": () => map.zoom(1.3), "zoom-out": () => map.zoom(1 / 1.3), fit, follow: () => map.setFollowing(!map.following),
};
for (const [id, act] of Object.entries(CLICKS)) $(id).onclick = act;
$("file").onchange = (event) => { openPlan(event.target.files[0]); event.target.value = ""; };
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => { event.preventDefault(); openPlan(event.dataTransfer.files[0]); });
map.addEventListener("place", ({ detail: { x, y } }) => {
  if (isPointing()) return point(x, y);
  const [px, py] = map.toScreen(x, y);
  const near = others(vehicle()).find(({ at }) => {
    const [ax, ay] = map.toScreen(at[0], at[1]);
    return Math.hypot(ax - px, ay - py) <= REACH_PX;
  });
  return near ? select(near.vehicle) : place(x, y);
});
map.addEventListener("following", () => { $("follow").setAttribute("aria-pressed", String(map.following)); draw(); });
map.addEventListener("adopt", (event) => {
  if (!route.points.length) route.replace(active(vehicle()));
  if (!route.points[event.detail.index]) event.detail.index = -1;
});
route.addEventListener("change", () => { confirm.close(); show(); });
link.addEventListener("state", show);
rehearsal.addEventListener("change", askAboutDanger);
together.addEventListener("change", askAboutDanger);
for (const id of ["speed", "laps", "radius", "turn"]) $(id).onchange = show;
$("target-name").oninput = show;
$("avoid").onchange = () => { avoidance[chosen] = $("avoid").checked; show(); };
// Ages grow also while nothing arrives.
setInterval(show, 1000);
addEventListener("resize", draw);
show();
