// A map of a local frame, metres east and north: Leaflet's view, and a canvas that is drawn on it.

import { label, prepared, roundStep } from "./colours.js";

const SCALE_MIN = 0.05;
const SCALE_MAX = 200;
const CLICK_PX = 6;
// That much is seen around a single point.
const LEAST_M = 10;
// Between a point and what lies over the map.
const CLEAR_PX = 24;

// A press that moves less is a click, not a drag.
L.Draggable.mergeOptions({ clickTolerance: CLICK_PX });

// Leaflet's longitude is metres east, its latitude metres north; at zoom 0 a metre is a pixel.
export const place = (x, y) => L.latLng(y, x);

export class LocalMap extends EventTarget {
  constructor(element) {
    super();
    this.element = element;
    this.following = false;
    // Under a finger or a mouse button, or still rolling on from it.
    this.moving = false;
    this.leaflet = L.map(element, {
      crs: L.CRS.Simple, center: place(0, 0), zoom: 3, minZoom: Math.log2(SCALE_MIN), maxZoom: Math.log2(SCALE_MAX),
      zoomSnap: 0, wheelPxPerZoomLevel: 100, zoomControl: false, attributionControl: false, keyboard: false,
      doubleClickZoom: false, boxZoom: false, zoomAnimation: false, fadeAnimation: false, trackResize: false,
    });
    const pane = this.leaflet.createPane("drawing");
    pane.style.zIndex = 350;
    pane.style.pointerEvents = "none";
    this.canvas = document.createElement("canvas");
    pane.append(this.canvas);
    L.control.scale({ imperial: false }).addTo(this.leaflet);
    this.looked();
    this.leaflet.on("move viewreset resize", () => { this.looked(); this.draw(); });
    this.leaflet.on("movestart", () => { this.moving = true; });
    this.leaflet.on("moveend", () => { this.moving = false; this.draw(); });
    this.leaflet.on("dragstart", () => this.setFollowing(false));
    new ResizeObserver(() => {
      this.leaflet.invalidateSize({ animate: false });
      this.draw();
    }).observe(element);
  }

  // --- the view

  looked() {
    const { x, y } = this.leaflet.getSize();
    const corner = this.leaflet.getPixelBounds().min;
    const zero = this.leaflet.project(place(0, 0));
    this.width = x;
    this.height = y;
    this.scale = 2 ** this.leaflet.getZoom();
    this.zero = [zero.x - corner.x, zero.y - corner.y];
  }

  // Metres in the middle, and pixels of a metre.
  get view() {
    const [x, y] = this.toMap(this.width / 2, this.height / 2);
    return { x, y, scale: this.scale };
  }

  look(x, y, scale = this.scale) {
    this.leaflet.setView(place(x, y), Math.log2(scale), { animate: false });
  }

  // What is seen stays when Leaflet's pixels are counted from elsewhere.
  frame(transformation) {
    const { x, y } = this.view;
    this.leaflet.options.crs = L.extend({}, L.CRS.Simple, { transformation });
    this.look(x, y);
  }

  toScreen(x, y) {
    return [this.zero[0] + x * this.scale, this.zero[1] - y * this.scale];
  }

  toMap(px, py) {
    return [(px - this.zero[0]) / this.scale, (this.zero[1] - py) / this.scale];
  }

  zoom(factor, px = this.width / 2, py = this.height / 2) {
    this.leaflet.setZoomAround(L.point(px, py), this.leaflet.getZoom() + Math.log2(factor), { animate: false });
  }

  // Left and upper padding that keeps clear of what lies over the map: rows at its top, columns at its left.
  padding(over) {
    const map = this.element.getBoundingClientRect();
    let [left, top] = [this.width / 8, this.height / 8];
    for (const box of over.map((element) => element.getBoundingClientRect())) {
      if (box.width > box.height) top = Math.max(top, box.bottom - map.top + CLEAR_PX);
      else left = Math.max(left, box.right - map.left + CLEAR_PX);
    }
    return [Math.min(left, this.width / 2), Math.min(top, this.height / 2)];
  }

  // Shows the points clear of elements over the map; what the map can never show together with the last one is left out.
  fit(points, over = []) {
    if (!points.length) return;
    const [x, y] = points.at(-1);
    const far = (0.4 * Math.min(this.width, this.height)) / SCALE_MIN;
    const near = points.filter((p) => Math.hypot(p[0] - x, p[1] - y) <= far);
    const bounds = L.latLngBounds(near.map((p) => place(p[0], p[1])));
    const { lat, lng } = bounds.getCenter();
    bounds.extend(place(lng - LEAST_M, lat - LEAST_M)).extend(place(lng + LEAST_M, lat + LEAST_M));
    const side = [this.width / 8, this.height / 8];
    this.leaflet.fitBounds(bounds, { animate: false, paddingTopLeft: this.padding(over), paddingBottomRight: side });
  }

  setFollowing(on) {
    if (on === this.following) return;
    this.following = on;
    this.dispatchEvent(new Event("following"));
  }

  // Keeps what is followed in the middle, as far as whole pixels go.
  follow([x, y]) {
    const [px, py] = this.toScreen(x, y);
    if (Math.hypot(px - this.width / 2, py - this.height / 2) > 1) this.look(x, y);
  }

  // --- drawing

  draw() {
    if (this.next) return;
    this.next = requestAnimationFrame(() => {
      this.next = 0;
      this.paint();
    });
  }

  // Empties the canvas for a view that is final; returns its context, width and height.
  begin(c) {
    const { style } = this.canvas;
    [style.width, style.height] = [`${this.width}px`, `${this.height}px`];
    L.DomUtil.setPosition(this.canvas, this.leaflet.containerPointToLayerPoint([0, 0]));
    this.element.style.background = c.back;
    const { x, y, scale } = this.view;
    this.element.dataset.view = `${x} ${y} ${scale}`;
    return prepared(this.canvas);
  }

  grid(context, width, height, c) {
    const step = roundStep(this.scale, 60);
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

  north(context, x, c) {
    context.lineWidth = 2;
    this.stroke(context, [[x, 52], [x, 24], [x - 6, 34], [x, 24], [x + 6, 34]], c.ink);
    label(context, "N", x - 4, 18, c.ink, c.halo);
  }
}
