// The map: metres, north up. Draws the scene and turns pointers into changes of the route.

import { colours, label, prepared, roundStep } from "./colours.js";
import { drawRehearsal } from "./rehearsal.js";
import { drawScene } from "./scene.js";

const NEAR_PX = { mouse: 16, pen: 16, touch: 26 };
const CLICK_PX = 5;

export class Map2D extends EventTarget {
  constructor(canvas, route, scene) {
    super();
    this.canvas = canvas;
    this.route = route;
    this.scene = scene;
    this.view = { x: 0, y: 0, scale: 8 };
    this.cross = null;
    this.following = false;
    this.pointers = new Map();
    this.drag = null;
    this.reach = NEAR_PX.mouse;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.up(event, true));
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  toScreen(x, y) {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    return [w / 2 + (x - this.view.x) * this.view.scale, h / 2 - (y - this.view.y) * this.view.scale];
  }

  toMap(px, py) {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    return [this.view.x + (px - w / 2) / this.view.scale, this.view.y - (py - h / 2) / this.view.scale];
  }

  zoom(factor, px = this.canvas.clientWidth / 2, py = this.canvas.clientHeight / 2) {
    const [x, y] = this.toMap(px, py);
    this.view.scale = Math.max(0.05, Math.min(200, this.view.scale * factor));
    const [nowX, nowY] = this.toMap(px, py);
    this.view.x += x - nowX;
    this.view.y += y - nowY;
    this.draw();
  }

  fit(points) {
    if (!points.length) return;
    const [xs, ys] = [points.map((p) => p[0]), points.map((p) => p[1])];
    const [west, east, south, north] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const { clientWidth: w, clientHeight: h } = this.canvas;
    const scale = Math.min(w / Math.max(east - west, 20), h / Math.max(north - south, 20)) * 0.75;
    this.view = { x: (west + east) / 2, y: (south + north) / 2, scale };
    this.draw();
  }

  // --- pointers

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  near(px, py, x, y) {
    const [sx, sy] = this.toScreen(x, y);
    return Math.hypot(px - sx, py - sy) <= this.reach;
  }

  hit(px, py) {
    const points = this.scene().editable;
    const index = points.findIndex((p) => this.near(px, py, p.x, p.y));
    if (index >= 0) return { index };
    for (let i = 0; i + 1 < this.route.points.length; i += 1) {
      const [a, b] = [this.route.points[i], this.route.points[i + 1]];
      if (this.near(px, py, (a.x + b.x) / 2, (a.y + b.y) / 2)) return { after: i };
    }
    return {};
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    const at = this.place(event);
    this.reach = NEAR_PX[event.pointerType] ?? NEAR_PX.mouse;
    this.pointers.set(event.pointerId, at);
    if (this.pointers.size === 1) this.drag = { from: at, last: at, moved: false, ...this.hit(...at) };
    else this.drag = null;
  }

  moved(event) {
    if (!this.pointers.has(event.pointerId)) return;
    const at = this.place(event);
    const before = this.pointers.get(event.pointerId);
    this.pointers.set(event.pointerId, at);
    if (this.pointers.size === 2) {
      const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, p]) => p);
      const length = (p) => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 1);
      this.zoom(length(at) / length(before), (at[0] + other[0]) / 2, (at[1] + other[1]) / 2);
      return;
    }
    const drag = this.drag;
    if (!drag) return;
    const first = !drag.moved;
    if (first && Math.hypot(at[0] - drag.from[0], at[1] - drag.from[1]) < CLICK_PX) return;
    drag.moved = true;
    if (first && drag.after !== undefined) {
      this.route.insertAfter(drag.after);
      drag.index = drag.after + 1;
      drag.inserted = true;
    }
    if (drag.index !== undefined) {
      const [x, y] = this.toMap(...at);
      if (first && !drag.inserted) {
        drag.index = this.adopt(drag.index);
        if (drag.index < 0) { this.drag = null; return; }
      }
      const rounded = { x: Math.round(x * 10) / 10, y: Math.round(y * 10) / 10 };
      this.route.move(drag.index, rounded, first && !drag.inserted);
    } else {
      this.setFollowing(false);
      this.view.x -= (at[0] - drag.last[0]) / this.view.scale;
      this.view.y += (at[1] - drag.last[1]) / this.view.scale;
      drag.last = at;
      this.draw();
    }
  }

  up(event, cancelled = false) {
    const drag = this.drag;
    this.pointers.delete(event.pointerId);
    this.drag = null;
    if (!drag || drag.moved || cancelled) return;
    if (drag.index !== undefined && this.route.points.length) this.route.select(drag.index);
    else if (drag.after !== undefined) this.route.insertAfter(drag.after);
    else if (drag.index === undefined) this.click(...this.toMap(...drag.from));
  }

  // Waypoints in flight become the route that is drawn, as soon as one is dragged.
  adopt(index) {
    const event = new CustomEvent("adopt", { detail: { index } });
    this.dispatchEvent(event);
    return event.detail.index;
  }

  click(x, y) {
    const detail = { x: Math.round(x * 10) / 10, y: Math.round(y * 10) / 10 };
    this.dispatchEvent(new CustomEvent("place", { detail }));
  }

  wheel(event) {
    event.preventDefault();
    this.zoom(Math.exp(-event.deltaY * 0.0015), ...this.place(event));
  }

  setFollowing(on) {
    if (on === this.following) return;
    this.following = on;
    this.dispatchEvent(new Event("following"));
  }

  // The cross that the arrow keys move.
  moveCross(dx, dy) {
    this.cross ??= { x: Math.round(this.view.x), y: Math.round(this.view.y) };
    this.cross.x += dx;
    this.cross.y += dy;
    const [px, py] = this.toScreen(this.cross.x, this.cross.y);
    const { clientWidth: w, clientHeight: h } = this.canvas;
    if (px < 20 || py < 20 || px > w - 20 || py > h - 20) Object.assign(this.view, this.cross);
    this.draw();
  }

  // --- drawing

  draw() {
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.paint();
    });
  }

  paint() {
    const scene = this.scene();
    if (this.following && scene.vehicle && !this.drag) {
      [this.view.x, this.view.y] = scene.vehicle.at;
    }
    const [context, width, height] = prepared(this.canvas);
    const c = colours();
    context.fillStyle = c.back;
    context.fillRect(0, 0, width, height);
    const tiled = this.tiles?.draw(context, this) ?? 0;
    this.canvas.dataset.view = `${this.view.x} ${this.view.y} ${this.view.scale}`;
    this.grid(context, width, height, tiled ? { ...c, grid: c.axis, axis: c.soft } : c);
    drawScene(this, context, scene, c);
    this.obstacles(context, scene.obstacles, c);
    for (const path of scene.earlier) this.line(context, path, c.earlier, 1.5, [3, 5]);
    this.canvas.dataset.trail = scene.trail.length;
    this.line(context, scene.trail, c.trail, 3);
    this.line(context, scene.plan, c.plan, 3, [10, 5]);
    drawRehearsal(this, context, scene.rehearsed, c);
    if (scene.home) this.home(context, scene.home, c);
    for (const other of scene.others) this.arrow(context, other, c.other, 9, other.name, c);
    this.waypoints(context, scene.active, c.goal, c, false);
    this.waypoints(context, this.route.points, c.draft, c, true);
    if (scene.vehicle) this.arrow(context, scene.vehicle, scene.old ? c.other : c.vehicle, 13, "", c);
    if (this.cross) this.crossHair(context, c);
    this.legend(context, width, height, c);
  }

  grid(context, width, height, c) {
    const step = roundStep(this.view.scale, 60);
    const [west, north] = this.toMap(0, 0);
    const [east, south] = this.toMap(width, height);
    for (let x = Math.ceil(west / step) * step; x <= east; x += step) {
      const px = Math.round(this.toScreen(x, 0)[0]) + 0.5;
      this.stroke(context, [[px, 0], [px, height]], Math.abs(x) < step / 2 ? c.axis : c.grid, 1);
      if (px < width - 50) label(context, String(+x.toFixed(2)), px + 3, height - 6, c.soft, c.back);
    }
    for (let y = Math.ceil(south / step) * step; y <= north; y += step) {
      const py = Math.round(this.toScreen(0, y)[1]) + 0.5;
      this.stroke(context, [[0, py], [width, py]], Math.abs(y) < step / 2 ? c.axis : c.grid, 1);
      const text = String(+y.toFixed(2));
      label(context, text, width - 6 - context.measureText(text).width, py - 4, c.soft, c.back);
    }
  }

  stroke(context, points, colour, width = context.lineWidth) {
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.beginPath();
    points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.stroke();
  }

  line(context, path, colour, width, dash = []) {
    if (!path || path.length < 2) return;
    context.lineWidth = width;
    context.setLineDash(dash);
    this.stroke(context, path.map(([x, y]) => this.toScreen(x, y)), colour);
    context.setLineDash([]);
  }

  circle(context, x, y, radius, { stroke, fill, dash = [] }) {
    const [px, py] = this.toScreen(x, y);
    context.beginPath();
    context.arc(px, py, Math.max(radius * this.view.scale, 2), 0, 2 * Math.PI);
    context.globalAlpha = 0.45;
    if (fill) { context.fillStyle = fill; context.fill(); }
    context.globalAlpha = 1;
    context.lineWidth = 1.5;
    context.setLineDash(dash);
    context.strokeStyle = stroke;
    context.stroke();
    context.setLineDash([]);
  }

  obstacles(context, found, c) {
    if (!found) return;
    for (const [x, y, radius] of found.posts) this.circle(context, x, y, radius, { stroke: c.known, fill: c.known });
    for (const [x, y, halfLength, halfWidth, yaw] of found.boxes) {
      const corner = (u, v) => this.toScreen(
        x + u * halfLength * Math.cos(yaw) - v * halfWidth * Math.sin(yaw),
        y + u * halfLength * Math.sin(yaw) + v * halfWidth * Math.cos(yaw));
      context.lineWidth = 1.5;
      this.stroke(context, [corner(1, 1), corner(-1, 1), corner(-1, -1), corner(1, -1), corner(1, 1)], c.known);
      context.globalAlpha = 0.45;
      context.fillStyle = c.known;
      context.fill();
      context.globalAlpha = 1;
    }
    context.fillStyle = c.seen;
    for (const [x, y, half] of found.seen) {
      const [px, py] = this.toScreen(x - half, y + half);
      const size = Math.max(2 * half * this.view.scale, 2);
      context.fillRect(px, py, size, size);
    }
  }

  home(context, [x, y], c) {
    const [px, py] = this.toScreen(x, y);
    context.lineWidth = 2;
    this.stroke(context, [[px - 7, py], [px, py - 8], [px + 7, py], [px + 5, py], [px + 5, py + 7], [px - 5, py + 7], [px - 5, py], [px - 7, py]], c.home);
    label(context, "home", px + 10, py + 14, c.soft, c.halo);
  }

  arrow(context, vehicle, colour, size, name, c) {
    const [px, py] = this.toScreen(vehicle.at[0], vehicle.at[1]);
    context.save();
    context.translate(px, py);
    context.rotate(-(vehicle.yaw ?? Math.PI / 2));
    context.beginPath();
    context.moveTo(size, 0);
    context.lineTo(-size * 0.8, size * 0.65);
    context.lineTo(-size * 0.4, 0);
    context.lineTo(-size * 0.8, -size * 0.65);
    context.closePath();
    context.fillStyle = colour;
    context.fill();
    context.lineWidth = 2;
    context.strokeStyle = c.halo;
    context.stroke();
    context.restore();
    if (name) label(context, name, px + size + 2, py + 4, colour, c.halo);
  }

  waypoints(context, points, colour, c, drawn) {
    if (!points.length) return;
    this.line(context, points.map((p) => [p.x, p.y]), colour, 2, drawn ? [] : [6, 4]);
    if (drawn) {
      for (let i = 0; i + 1 < points.length; i += 1) {
        const [a, b] = [points[i], points[i + 1]];
        const [px, py] = this.toScreen((a.x + b.x) / 2, (a.y + b.y) / 2);
        label(context, "+", px - 4, py + 4, colour, c.halo);
      }
    }
    points.forEach((p, i) => {
      const [px, py] = this.toScreen(p.x, p.y);
      const chosen = drawn && i === this.route.selected;
      context.beginPath();
      if (drawn) context.arc(px, py, 11, 0, 2 * Math.PI);
      else context.rect(px - 10, py - 10, 20, 20);
      context.fillStyle = chosen ? colour : c.halo;
      context.fill();
      context.lineWidth = 2.5;
      context.strokeStyle = colour;
      context.stroke();
      const number = String(p.number ?? i + 1);
      context.fillStyle = chosen ? c.halo : c.ink;
      context.fillText(number, px - context.measureText(number).width / 2, py + 4);
      const hold = p.hold ? `, ${p.hold} s` : "";
      label(context, `${p.z} m${hold}`, px + 14, py - 8, c.ink, c.halo);
    });
  }

  crossHair(context, c) {
    const [px, py] = this.toScreen(this.cross.x, this.cross.y);
    context.lineWidth = 1.5;
    this.stroke(context, [[px - 12, py], [px + 12, py]], c.ink);
    this.stroke(context, [[px, py - 12], [px, py + 12]], c.ink);
    label(context, `${this.cross.x}, ${this.cross.y}`, px + 8, py + 18, c.ink, c.halo);
  }

  legend(context, width, height, c) {
    const step = roundStep(this.view.scale, 80);
    const length = step * this.view.scale;
    const y = height - 26;
    context.lineWidth = 3;
    this.stroke(context, [[14, y - 5], [14, y], [14 + length, y], [14 + length, y - 5]], c.ink);
    label(context, `${step} m`, 14 + length / 2 - 12, y - 6, c.ink, c.halo);
    const x = width - 40;
    context.lineWidth = 2;
    this.stroke(context, [[x, 52], [x, 24], [x - 6, 34], [x, 24], [x + 6, 34]], c.ink);
    label(context, "N", x - 4, 18, c.ink, c.halo);
  }
}
