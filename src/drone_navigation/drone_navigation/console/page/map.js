// The map of the console: draws the scene, and turns clicks and drags into changes of the route.

import { colours, label } from "./colours.js";
import { LocalMap, place } from "./local_map.js";
import { drawRehearsal } from "./rehearsal.js";
import { drawScene } from "./scene.js";
import { drawMeetings } from "./together.js";

const rounded = (value) => Math.round(value * 10) / 10;

export class Map2D extends LocalMap {
  constructor(element, route, scene) {
    super(element);
    this.route = route;
    this.scene = scene;
    this.cross = null;
    this.dragged = null;
    this.waypointHandles = [];
    this.middleHandles = [];
    this.leaflet.on("click", ({ latlng }) => this.click(latlng.lng, latlng.lat));
  }

  // --- clicks and drags

  // Waypoints, and the middles between them, are Leaflet's markers; they are drawn on the canvas.
  handles(scene) {
    const points = scene.editable;
    const middles = this.route.points.slice(1).map((b, i) => {
      const a = this.route.points[i];
      return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 };
    });
    this.setHandles(this.waypointHandles, points, (index) => this.waypointHandle(index));
    this.setHandles(this.middleHandles, middles, (index) => this.middleHandle(index));
  }

  setHandles(handles, points, make) {
    while (handles.length > points.length) handles.pop().remove();
    while (handles.length < points.length) handles.push(make(handles.length));
    handles.forEach((handle, i) => handle !== this.dragged && handle.setLatLng(place(points[i].x, points[i].y)));
  }

  waypointHandle(index) {
    return this.handle(1000, () => this.route.points.length && this.route.select(index), () => [this.adopt(index), true]);
  }

  middleHandle(index) {
    const insert = () => this.route.insertAfter(index);
    return this.handle(0, insert, () => { insert(); return [index + 1, false]; });
  }

  // `begin` returns the waypoint that a drag moves, -1 for none, and whether that is a step of its own to undo.
  handle(zIndexOffset, click, begin) {
    const icon = L.divIcon({ className: "handle", iconSize: null });
    const handle = L.marker(place(0, 0), { icon, zIndexOffset, draggable: true, keyboard: false });
    let [index, first] = [-1, false];
    handle.on("click", click);
    handle.on("dragstart", () => {
      this.dragged = handle;
      handle.getElement().classList.add("dragged");
      [index, first] = begin();
    });
    handle.on("drag", ({ latlng }) => {
      if (index >= 0) this.route.move(index, { x: rounded(latlng.lng), y: rounded(latlng.lat) }, first);
      first = false;
    });
    handle.on("dragend", () => {
      this.dragged = null;
      handle.getElement()?.classList.remove("dragged");
      this.draw();
    });
    return handle.addTo(this.leaflet);
  }

  // Waypoints in flight become the route that is drawn, as soon as one is dragged.
  adopt(index) {
    const event = new CustomEvent("adopt", { detail: { index } });
    this.dispatchEvent(event);
    return event.detail.index;
  }

  click(x, y) {
    this.dispatchEvent(new CustomEvent("place", { detail: { x: rounded(x), y: rounded(y) } }));
  }

  // The cross that the arrow keys move.
  moveCross(dx, dy) {
    this.cross ??= { x: Math.round(this.view.x), y: Math.round(this.view.y) };
    this.cross.x += dx;
    this.cross.y += dy;
    this.leaflet.panInside(place(this.cross.x, this.cross.y), { padding: [20, 20], animate: false });
    this.draw();
  }

  // --- drawing

  paint() {
    const c = colours();
    const scene = this.scene();
    if (this.following && scene.vehicle && !this.dragged && !this.moving) this.follow(scene.vehicle.at);
    const tiled = this.tiles?.show(this);
    const [context, width, height] = this.begin(c);
    this.handles(scene);
    this.element.dataset.trail = scene.trail.length;
    this.element.dataset.photos = scene.photos.length;
    this.element.dataset.target = scene.target?.at.join(" ") ?? "";
    this.grid(context, width, height, tiled ? { ...c, grid: c.axis, axis: c.soft } : c);
    drawScene(this, context, scene, c);
    this.obstacles(context, scene.obstacles, c);
    for (const path of scene.earlier) this.line(context, path, c.earlier, 1.5, [3, 5]);
    this.line(context, scene.trail, c.trail, 3);
    this.line(context, scene.plan, c.plan, 3, [10, 5]);
    drawRehearsal(this, context, scene.rehearsed, c);
    if (scene.home) this.home(context, scene.home, c);
    for (const other of scene.others) this.arrow(context, other, c.other, 9, other.name, c);
    this.waypoints(context, scene.active, c.goal, c, false);
    for (const area of [scene.area, ...scene.holes].filter((each) => each.length)) {
      this.line(context, [...area, area[0]].map((p) => [p.x, p.y]), c.draft, 2, [2, 4]);
    }
    this.waypoints(context, this.route.points, c.draft, c, true);
    if (scene.ring) this.ring(context, scene.ring, c);
    this.photos(context, scene.photos, c);
    if (scene.target) this.target(context, scene.target, c);
    if (scene.vehicle) this.arrow(context, scene.vehicle, scene.old ? c.other : c.vehicle, 13, "", c);
    drawMeetings(this, context, scene.together, c);
    if (this.cross) this.crossHair(context, c);
    this.north(context, width - 40, c);
  }

  // Fills and strokes the path that was begun.
  solid(context, colour) {
    context.globalAlpha = 0.45;
    context.fillStyle = colour;
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = 1.5;
    context.strokeStyle = colour;
    context.stroke();
  }

  obstacles(context, found, c) {
    if (!found) return;
    for (const [x, y, radius] of found.posts) {
      context.beginPath();
      context.arc(...this.toScreen(x, y), Math.max(radius * this.scale, 2), 0, 2 * Math.PI);
      this.solid(context, c.known);
    }
    for (const [x, y, halfLength, halfWidth, yaw] of found.boxes) {
      const corner = (u, v) => this.toScreen(
        x + u * halfLength * Math.cos(yaw) - v * halfWidth * Math.sin(yaw),
        y + u * halfLength * Math.sin(yaw) + v * halfWidth * Math.cos(yaw));
      context.beginPath();
      for (const [u, v] of [[1, 1], [-1, 1], [-1, -1], [1, -1]]) context.lineTo(...corner(u, v));
      context.closePath();
      this.solid(context, c.known);
    }
    context.fillStyle = c.seen;
    for (const [x, y, half] of found.seen) {
      const [px, py] = this.toScreen(x - half, y + half);
      const size = Math.max(2 * half * this.scale, 2);
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
      const acts = p.acts?.length ? `, ${p.acts.length} ${p.acts.length === 1 ? "act" : "acts"}` : "";
      label(context, `${p.z} m${hold}${acts}`, px + 14, py - 8, c.ink, c.halo);
    });
  }

  ring(context, { at, radius }, c) {
    context.beginPath();
    context.arc(...this.toScreen(...at), radius * this.scale, 0, 2 * Math.PI);
    context.lineWidth = 2;
    context.strokeStyle = c.draft;
    context.stroke();
  }

  // Where photos were taken, as small frames.
  photos(context, places, c) {
    context.lineWidth = 1.5;
    context.strokeStyle = c.ink;
    for (const [x, y] of places) {
      const [px, py] = this.toScreen(x, y);
      context.strokeRect(px - 4, py - 3, 8, 6);
    }
  }

  // The target that is followed; hollow while it is lost.
  target(context, { at, state }, c) {
    const [px, py] = this.toScreen(at[0], at[1]);
    context.beginPath();
    context.arc(px, py, 7, 0, 2 * Math.PI);
    context.lineWidth = 2.5;
    context.strokeStyle = c.goal;
    context.stroke();
    if (state === "FOLLOWING") {
      context.beginPath();
      context.arc(px, py, 3, 0, 2 * Math.PI);
      context.fillStyle = c.goal;
      context.fill();
    }
    label(context, state === "LOST" ? "target, lost" : "target", px + 11, py + 4, c.ink, c.halo);
  }

  crossHair(context, c) {
    const [px, py] = this.toScreen(this.cross.x, this.cross.y);
    context.lineWidth = 1.5;
    this.stroke(context, [[px - 12, py], [px + 12, py]], c.ink);
    this.stroke(context, [[px, py - 12], [px, py + 12]], c.ink);
    label(context, `${this.cross.x}, ${this.cross.y}`, px + 8, py + 18, c.ink, c.halo);
  }
}
