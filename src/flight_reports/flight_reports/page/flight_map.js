// The map of a report: what was flown, and each vehicle where it was at a time.

import { colours } from "./colours.js";
import { LocalMap, place } from "./local_map.js";

const GLYPHS = { circle: "\u25CF", square: "\u25A0", "square-open": "\u25A1", diamond: "\u25C6", "triangle-up": "\u25B2", x: "\u2715" };
const LINE = "\u2501";
const VEHICLE = '<svg viewBox="-12 -12 24 24"><path d="M0-11 7 9 0 5-7 9z"/></svg>';
const MOVED_M = 0.3;
const HOVER_PX = 12;

const css = (colour) => (colour?.startsWith("@") ? `var(--${colour.slice(1)})` : colour);

// Lines of a trace, which null breaks, as Leaflet's places.
function parts(trace) {
  const found = [[]];
  trace.x.forEach((x, i) => (x === null ? found.push([]) : found.at(-1).push(place(x, trace.y[i]))));
  return found.filter((part) => part.length > 1);
}

// Index of the last time that is not after a time; -1 before the first.
function latest(times, time) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

// Position and heading in degrees of a track {t, x, y, heading} at a time; null before it begins.
export function at(track, time) {
  const i = latest(track.t, time);
  if (i < 0) return null;
  const j = Math.min(i + 1, track.t.length - 1);
  const part = j > i && track.t[j] - track.t[i] < track.gap ? (time - track.t[i]) / (track.t[j] - track.t[i]) : 0;
  const between = (values) => values[i] + part * (values[j] - values[i]);
  return { x: between(track.x), y: between(track.y), heading: track.heading[i] ?? course(track, i) };
}

// Where it moved to last, in degrees from north, for a log without headings.
function course(track, i) {
  for (let k = i; k >= 0; k -= 1) {
    const [dx, dy] = [track.x[i] - track.x[k], track.y[i] - track.y[k]];
    if (Math.hypot(dx, dy) > MOVED_M) return (Math.atan2(dx, dy) * 180) / Math.PI;
  }
  return 0;
}

export class FlightMap extends LocalMap {
  // A click on what was flown is the event "time", in s.
  constructor(element, figure, tracks) {
    super(element);
    this.tracks = tracks;
    const overlays = {};
    for (const trace of figure.data) {
      const layer = trace.mode === "lines" ? this.lines(trace) : this.marks(trace);
      const sign = trace.mode === "lines" ? LINE : GLYPHS[trace.marker.symbol ?? "circle"];
      overlays[`<span style="color:${css(trace.line?.width ? trace.line.color : trace.marker?.color ?? trace.fillcolor)}">${sign}</span> ${trace.name}`] = layer.addTo(this.leaflet);
    }
    L.control.zoom().addTo(this.leaflet);
    L.control.layers(null, overlays, { collapsed: element.clientWidth < 500 }).addTo(this.leaflet);
    this.vehicles = tracks.map((track) => this.mark(place(0, 0), `vehicle ${track.colour}`, VEHICLE, 1000));
    this.pointer = this.mark(place(0, 0), "pointer", "", 900);
    const all = figure.data.flatMap((trace) => trace.x.map((x, i) => [x, trace.y[i]])).filter(([x]) => x !== null);
    this.fit(all);
  }

  lines(trace) {
    const colour = css(trace.line.width ? trace.line.color : trace.fillcolor);
    const look = { weight: trace.line.width, opacity: trace.opacity ?? 1, dashArray: trace.line.dash ? "7 6" : null };
    const area = { stroke: false, fill: true, fillOpacity: trace.opacity, smoothFactor: 0 };
    const line = trace.fill ? L.polygon(parts(trace), area) : L.polyline(parts(trace), { ...look, interactive: Boolean(trace.customdata) });
    // Styles, unlike attributes, follow the page's choice of light or dark.
    line.on("add", () => Object.assign(line.getElement().style, { [trace.fill ? "fill" : "stroke"]: colour }));
    if (!trace.customdata) return line;
    line.bindTooltip("", { sticky: true });
    // The line is thin for a finger or a hand that shakes.
    const grip = L.polyline(parts(trace), { weight: 2 * HOVER_PX, opacity: 0 });
    grip.bindTooltip("", { sticky: true });
    grip.on("mousemove", ({ latlng }) => grip.setTooltipContent(this.about(trace, this.nearest(trace, latlng))));
    grip.on("click", ({ latlng }) => {
      const [time] = trace.customdata[this.nearest(trace, latlng)];
      this.dispatchEvent(new CustomEvent("time", { detail: time }));
    });
    return L.layerGroup([line, grip]);
  }

  nearest(trace, { lat, lng }) {
    let [best, least] = [0, Infinity];
    trace.x.forEach((x, i) => {
      const distance = x === null ? Infinity : Math.hypot(x - lng, trace.y[i] - lat);
      if (distance < least) [best, least] = [i, distance];
    });
    return best;
  }

  about(trace, i) {
    const [time, up, speed] = trace.customdata[i];
    return `${trace.name}: ${time.toFixed(1)} s<br>east ${trace.x[i].toFixed(1)} m, north ${trace.y[i].toFixed(1)} m, up ${up.toFixed(1)} m<br>${speed.toFixed(1)} m/s`;
  }

  // Texts of a log are escaped already.
  marks(trace) {
    const texts = trace.hovertext ?? trace.text;
    const named = trace.mode.includes("text");
    return L.layerGroup(trace.x.map((x, i) => {
      const name = named ? `<b>${trace.text[i]}</b>` : "";
      const html = `<i>${GLYPHS[trace.marker.symbol ?? "circle"]}</i>${name}`;
      const mark = L.marker(place(x, trace.y[i]), {
        icon: L.divIcon({ className: "sign", iconSize: null, html }), keyboard: false,
      });
      mark.on("add", () => { mark.getElement().style.color = css(trace.marker.color); });
      return mark.bindTooltip(texts[i]);
    }));
  }

  mark(at, className, html, zIndexOffset) {
    const icon = L.divIcon({ className, iconSize: null, html });
    const mark = L.marker(at, { icon, zIndexOffset, interactive: false, keyboard: false }).addTo(this.leaflet);
    mark.getElement().hidden = true;
    return mark;
  }

  put(mark, found) {
    const element = mark.getElement();
    element.hidden = !found;
    if (found) mark.setLatLng(place(found.x, found.y));
    const drawing = element.firstElementChild;
    if (drawing && found) drawing.style.transform = `rotate(${found.heading}deg)`;
  }

  // Shows the vehicles at a time, and keeps the first of them on the map.
  show(time) {
    this.tracks.forEach((track, i) => this.put(this.vehicles[i], at(track, time)));
    const first = this.tracks.length ? at(this.tracks[0], time) : null;
    this.element.dataset.at = first ? `${first.x.toFixed(2)} ${first.y.toFixed(2)} ${first.heading.toFixed(0)}` : "";
    if (first) this.leaflet.panInside(place(first.x, first.y), { padding: [40, 40], animate: false });
  }

  // Where the mouse is in the plots.
  point(time) {
    this.put(this.pointer, this.tracks.length ? at(this.tracks[0], time) : null);
  }

  paint() {
    const c = colours();
    const [context, width, height] = this.begin(c);
    this.grid(context, width, height, c);
    this.north(context, 70, c);
  }
}
