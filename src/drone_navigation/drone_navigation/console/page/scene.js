// What the vehicle stores and may not leave: fence, flight volume, rally points, mission; battery.

import { colours, label } from "./colours.js";
import { drawTogether } from "./together.js";
import { missionItem } from "./words.js";

const HATCH_PX = 9;
const FENCE_DASH = [14, 4, 3, 4];
const OFF_DASH = [2, 6];
const VOLUME_DASH = [12, 6];
const $ = (id) => document.getElementById(id);

// The mission's items that have a place, as points; z is null where the height is unknown.
export function missionPoints(mission) {
  return (mission?.items ?? []).filter((item) => item.at).map((item) => {
    const [x, y, z] = item.at;
    return { x, y, z, number: item.number, current: item.number === mission.current };
  });
}

// --- on the map

function outline(map, context, area) {
  const points = area.points.map(([x, y]) => map.toScreen(x, y));
  context.beginPath();
  if (area.radius === null) {
    points.forEach(([px, py], i) => (i ? context.lineTo(px, py) : context.moveTo(px, py)));
    context.closePath();
  } else context.arc(...points[0], Math.max(area.radius * map.scale, 2), 0, 2 * Math.PI);
}

// Where one may not be is hatched: the inside of an exclusion.
function hatch(map, context, area, colour) {
  const { width, height } = map;
  context.save();
  outline(map, context, area);
  context.clip();
  context.globalAlpha = 0.45;
  context.lineWidth = 1.5;
  context.strokeStyle = colour;
  context.beginPath();
  for (let x = -height; x < width; x += HATCH_PX) {
    context.moveTo(x, height);
    context.lineTo(x + height, 0);
  }
  context.stroke();
  context.restore();
}

function drawAreas(map, context, fence, colour, dash, c) {
  for (const area of fence?.areas ?? []) {
    if (!area.points.length) continue;
    if (area.in_force && !area.inclusion) hatch(map, context, area, colour);
    outline(map, context, area);
    context.lineWidth = area.in_force ? 2 : 1.5;
    context.setLineDash(area.in_force ? dash : OFF_DASH);
    context.strokeStyle = area.in_force ? colour : c.soft;
    context.stroke();
    context.setLineDash([]);
  }
}

function diamond(context, px, py, size) {
  context.beginPath();
  context.moveTo(px, py - size);
  context.lineTo(px + size, py);
  context.lineTo(px, py + size);
  context.lineTo(px - size, py);
  context.closePath();
}

function drawMission(map, context, mission, c) {
  const points = missionPoints(mission);
  map.line(context, points.map((p) => [p.x, p.y]), c.mission, 1.5);
  for (const p of points) {
    const [px, py] = map.toScreen(p.x, p.y);
    diamond(context, px, py, p.current ? 11 : 8);
    context.fillStyle = p.current ? c.mission : c.halo;
    context.fill();
    context.lineWidth = 2;
    context.strokeStyle = c.mission;
    context.stroke();
    label(context, `M${p.number}${p.z === null ? "" : ` ${p.z.toFixed(0)} m`}`, px + 12, py + 14, c.mission, c.halo);
  }
}

function drawRally(map, context, rally, c) {
  for (const item of rally?.items ?? []) {
    if (!item.at) continue;
    const [px, py] = map.toScreen(item.at[0], item.at[1]);
    context.lineWidth = 2;
    context.strokeStyle = context.fillStyle = c.home;
    context.beginPath();
    context.moveTo(px, py);
    context.lineTo(px, py - 18);
    context.stroke();
    context.beginPath();
    context.moveTo(px, py - 18);
    context.lineTo(px + 12, py - 14);
    context.lineTo(px, py - 10);
    context.fill();
    label(context, `rally ${item.number + 1}`, px + 4, py + 12, c.soft, c.halo);
  }
}

export function drawScene(map, context, scene, c) {
  drawAreas(map, context, scene.volume, c.volume, VOLUME_DASH, c);
  drawAreas(map, context, scene.fence, c.known, FENCE_DASH, c);
  drawMission(map, context, scene.mission, c);
  drawRally(map, context, scene.rally, c);
  drawTogether(map, context, scene.together, c);
  const count = (list) => list?.length ?? 0;
  const drawn = `fence ${count(scene.fence?.areas)} rally ${count(scene.rally?.items)} mission ${missionPoints(scene.mission).length}`;
  if (map.element.dataset.scene !== drawn) map.element.dataset.scene = drawn;
}

// --- from the side

export function drawLimits(context, scene, ground, left, right, py, c) {
  for (const [fence, colour, dash, name] of [[scene.volume, c.volume, VOLUME_DASH, "flight volume"], [scene.fence, c.known, FENCE_DASH, "fence"]]) {
    for (const height of [fence?.low, fence?.high]) {
      const y = height === null || height === undefined ? -1 : py(ground + height);
      if (y < 0 || y > py(ground)) continue;
      context.setLineDash(dash);
      context.lineWidth = 1.5;
      context.strokeStyle = colour;
      context.beginPath();
      context.moveTo(left, y);
      context.lineTo(right, y);
      context.stroke();
      context.setLineDash([]);
      label(context, name, right - context.measureText(name).width, y - 4, colour, c.back);
    }
  }
}

export function drawMissionHeights(context, points, places, c) {
  points.forEach((p, i) => {
    diamond(context, ...places[i], p.current ? 8 : 6);
    context.fillStyle = c.mission;
    context.fill();
    label(context, `M${p.number}`, places[i][0] - 6, places[i][1] - 10, c.ink, c.halo);
  });
}

// --- beside the map

const FRAMES = { 0: "above sea level", 5: "above sea level", 3: "above home", 6: "above home", 10: "above the ground", 11: "above the ground" };

function describe(item) {
  const height = item.values[6];
  const where = (item.at || height) && height !== null ? `, ${height} m ${FRAMES[item.frame] ?? ""}` : "";
  const [name, meaning] = missionItem(item.name, item.values);
  return `${name}${where}${meaning ? `, ${meaning}` : ""}`;
}

function showMission(mission) {
  const items = mission?.items ?? [];
  $("mission-box").hidden = !items.length;
  const list = $("mission-items");
  const key = JSON.stringify(mission ?? null);
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  list.replaceChildren(...items.map((item) => {
    const row = document.createElement("li");
    row.textContent = `${item.number}  ${describe(item)}`;
    if (item.number === mission.current) row.setAttribute("aria-current", "step");
    return row;
  }));
}

function showBattery(v) {
  const bar = $("battery");
  const percent = v?.battery?.percent;
  bar.hidden = percent === null || percent === undefined;
  if (bar.hidden) return;
  const reserve = 100 * (v.status?.reserve ?? 0);
  const back = v.status?.return_share;
  const need = Math.min(reserve + 100 * (back ?? 0), 100);
  $("battery-fill").style.width = `${percent}%`;
  $("battery-fill").classList.toggle("low", percent < need);
  $("battery-reserve").style.width = `${reserve}%`;
  $("battery-return").style.left = `${need}%`;
  bar.setAttribute("aria-valuenow", percent);
  const text = back === null || back === undefined ? "" : `Turn back at ${need.toFixed(0)} %: ${(100 * back).toFixed(0)} % for the return, ${reserve.toFixed(0)} % in reserve`;
  bar.title = text;
  if ($("battery-text").textContent !== text) $("battery-text").textContent = text;
}

// Colour, dash and width of a line, or a shape, by what it means.
const LEGEND = [
  ["trail", "flown", []], ["plan", "planned path", [10, 5]], ["goal", "goal (squares)", [6, 4]], ["draft", "drawn route (circles)", []],
  ["mission", "mission in the vehicle (diamonds)", []], ["known", "fence; hatched: keep out", FENCE_DASH], ["soft", "stored, not in force", OFF_DASH],
  ["volume", "flight volume", VOLUME_DASH], ["seen", "obstacles, sensed", null], ["known", "obstacles, known", null],
  ["vehicle", "this vehicle", null], ["other", "other vehicles", null],
];

function showLegend() {
  const theme = document.documentElement.dataset.theme;
  const box = $("legend");
  if (box.dataset.theme === theme) return;
  box.dataset.theme = theme;
  const c = colours();
  $("legend-rows").replaceChildren(...LEGEND.map(([name, text, dash]) => {
    const row = document.createElement("li");
    const sample = Object.assign(document.createElement("canvas"), { width: 34, height: 12 });
    const context = sample.getContext("2d");
    context.strokeStyle = context.fillStyle = c[name];
    context.lineWidth = 3;
    if (dash === null) context.fillRect(8, 1, 16, 10);
    else {
      context.setLineDash(dash);
      context.beginPath();
      context.moveTo(0, 6);
      context.lineTo(34, 6);
      context.stroke();
    }
    row.append(sample, text);
    return row;
  }));
}

export function showScene(v) {
  showMission(v?.mission);
  showBattery(v);
  showLegend();
}
