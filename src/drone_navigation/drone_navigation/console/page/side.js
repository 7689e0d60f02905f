// Heights from the side: where the vehicle has been (left) and what lies before it (right).

import { colours, label, prepared, roundStep } from "./colours.js";
import { drawLimits, drawMissionHeights, missionPoints } from "./scene.js";

const PAST_PART = 0.3;
const NEAR_M = 2;

// Points [x, y, z] as [distance along, z].
function along(points) {
  let length = 0;
  return points.map((p, i) => {
    if (i) length += Math.hypot(p[0] - points[i - 1][0], p[1] - points[i - 1][1]);
    return [length, p[2]];
  });
}

// What is left of a plan for a vehicle at a place: the points after the leg that is nearest to it.
function planAhead(plan, [x, y, z]) {
  let nearest = Infinity;
  let after = plan.length;
  for (let i = 0; i + 1 < plan.length; i += 1) {
    const [ax, ay, az] = plan[i];
    const [dx, dy, dz] = [plan[i + 1][0] - ax, plan[i + 1][1] - ay, plan[i + 1][2] - az];
    const part = ((x - ax) * dx + (y - ay) * dy + (z - az) * dz) / (dx * dx + dy * dy + dz * dz || 1);
    const on = Math.max(0, Math.min(1, part));
    const distance = Math.hypot(x - ax - on * dx, y - ay - on * dy, z - az - on * dz);
    if (distance < nearest) [nearest, after] = [distance, i + 1];
  }
  return plan.slice(after);
}

// The distance along a path at which it passes a place, or null if it does not.
function passed(path, profile, x, y) {
  let best = null;
  let nearest = NEAR_M;
  for (let i = 0; i + 1 < path.length; i += 1) {
    const [ax, ay] = path[i];
    const [dx, dy] = [path[i + 1][0] - ax, path[i + 1][1] - ay];
    const part = Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
    const distance = Math.hypot(x - ax - part * dx, y - ay - part * dy);
    if (distance < nearest) {
      nearest = distance;
      best = profile[i][0] + part * (profile[i + 1][0] - profile[i][0]);
    }
  }
  return best;
}

// Draws, and returns where the waypoints are and how pixels become heights. While a waypoint is
// dragged the scale stays as it was.
export function drawSide(canvas, scene, drawn, dragged) {
  const [context, width, height] = prepared(canvas);
  const c = colours();
  context.fillStyle = c.back;
  context.fillRect(0, 0, width, height);
  const here = scene.vehicle?.at;
  const numbered = drawn.length ? drawn : scene.active;
  // Without a goal or a route: the mission in the vehicle.
  const mission = numbered.length ? [] : missionPoints(scene.mission).filter((p) => p.z !== null);
  const ahead = mission.length ? mission.map((p) => [p.x, p.y, p.z]) : drawn.length || !here ? numbered.map((p) => [p.x, p.y, p.z]) : planAhead(scene.plan, here);
  const path = here ? [here, ...ahead] : ahead;
  const future = along(path);
  const past = along([...scene.trail, ...(here ? [here] : [])]);
  const flown = past.length ? past[past.length - 1][0] : 0;
  const length = Math.max(20, ...future.map((p) => p[0]));
  const ground = scene.home ? scene.home[2] : 0;
  const top = dragged?.top ?? Math.max(ground + 8, ...future.map((p) => p[1]), ...numbered.map((p) => p.z), ...past.map((p) => p[1])) + 2;
  const [left, right, bottom, high] = [44, width - 24, height - 22, 14];
  const zero = left + (right - left) * PAST_PART;
  const scale = (right - zero) / length;
  const px = (d) => zero + d * scale;
  const py = (z) => bottom - ((z - ground) / (top - ground)) * (bottom - high);
  const line = (points, colour, widthPx, dash = []) => {
    context.setLineDash(dash);
    context.lineWidth = widthPx;
    context.strokeStyle = colour;
    context.beginPath();
    points.forEach(([d, z], i) => (i ? context.lineTo(px(d), py(z)) : context.moveTo(px(d), py(z))));
    context.stroke();
    context.setLineDash([]);
  };
  const step = roundStep((bottom - high) / (top - ground), 26);
  for (let z = 0; ground + z <= top; z += step) {
    context.lineWidth = 1;
    line([[(left - zero) / scale, ground + z], [length, ground + z]], z ? c.grid : c.ink, 1);
    label(context, `${+z.toFixed(1)} m`, 4, py(ground + z) + 4, c.soft, c.back);
  }
  context.save();
  context.beginPath();
  context.rect(left, 0, width - left, height);
  context.clip();
  for (const [x, y, half, low, up] of [...(scene.obstacles?.posts ?? []), ...(scene.obstacles?.seen ?? [])]) {
    const at = passed(path, future, x, y);
    if (at === null) continue;
    context.fillStyle = c.seen;
    context.globalAlpha = 0.35;
    context.fillRect(px(at - half), py(up), Math.max(2 * half * scale, 2), Math.max(py(Math.max(low, ground)) - py(up), 1));
    context.globalAlpha = 1;
  }
  line(past.map(([d, z]) => [d - flown, z]), c.trail, 3);
  context.restore();
  drawLimits(context, scene, ground, left, right, py, c);
  line(future, mission.length ? c.mission : drawn.length ? c.draft : c.plan, 2, drawn.length ? [] : [8, 4]);
  drawMissionHeights(context, mission, future.slice(here ? 1 : 0).map(([d, z]) => [px(d), py(z)]), c);
  const marks = [];
  numbered.forEach((p, i) => {
    const d = drawn.length || !here ? future[here ? i + 1 : i][0] : passed(path, future, p.x, p.y);
    if (d === null) return;
    marks.push({ index: i, x: px(d), y: py(p.z) });
    const half = drawn.length && i === dragged?.selected ? 7 : 5;
    context.fillStyle = drawn.length ? c.draft : c.goal;
    context.fillRect(px(d) - half, py(p.z) - half, 2 * half, 2 * half);
    label(context, `${p.number ?? i + 1}`, px(d) - 3, py(p.z) - 10, c.ink, c.halo);
  });
  if (here) {
    context.fillStyle = c.vehicle;
    context.beginPath();
    context.arc(px(0), py(here[2]), 5, 0, 2 * Math.PI);
    context.fill();
  }
  canvas.dataset.marks = JSON.stringify(marks.map(({ x, y }) => [x, y]));
  const hint = marks.length && width > 500 ? "; drag a waypoint up or down" : "";
  label(context, `Height above home, along the route${hint}`, left, height - 6, c.soft, c.back);
  const perMetre = (bottom - high) / (top - ground);
  return { marks, top, perMetre, heightAt: (y) => ground + Math.max((bottom - y) / perMetre, 0) };
}
