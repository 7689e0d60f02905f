// Draws the plots and maps of the page, in its colours, and leads from one to the other.

import { FlightMap } from "./flight_map.js";
import { Player } from "./player.js";

(() => {
  const errors = document.getElementById("errors");
  const tell = (text) => {
    errors.hidden = false;
    errors.textContent += `A part of this page could not be drawn: ${text} `;
  };
  window.addEventListener("error", (event) => tell(event.message));
  window.addEventListener("unhandledrejection", (event) => tell(String(event.reason)));

  const { figures, tracks } = JSON.parse(document.getElementById("plots").textContent);
  const config = { responsive: true, displaylogo: false, scrollZoom: false,
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  const shownAround = 10, charWidth = 8;
  let fixed = {};

  const colour = (name) => fixed[name] ??
    getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const paint = (value) => {
    if (typeof value === "string") return /^@[a-z]+\d?$/.test(value) ? colour(value.slice(1)) || value : value;
    if (Array.isArray(value)) return typeof value[0] === "number" ? value : value.map(paint);
    if (value === null || typeof value !== "object") return value;
    return Object.fromEntries(Object.entries(value).map(([key, part]) => [key, paint(part)]));
  };
  // The name of a mode is left out where its bar is too narrow for it.
  const named = (shapes, layout, width) => {
    const { margin, xaxis } = layout, [begin, end] = xaxis.range ?? [0, 1];
    const perUnit = (width - margin.l - margin.r) / (end - begin);
    return shapes.map((shape) => (shape.label && (shape.x1 - shape.x0) * perUnit < shape.label.text.length * charWidth
      ? { ...shape, label: { ...shape.label, text: "" } } : shape));
  };
  const layoutOf = (layout, id) => {
    const painted = paint(layout);
    if (painted.shapes) painted.shapes = named(painted.shapes, layout, document.getElementById(id).clientWidth);
    for (const key of Object.keys(painted)) {
      if (/^[xy]axis/.test(key)) {
        painted[key] = { gridcolor: colour("grid"), linecolor: colour("rule"), tickcolor: colour("rule"), ...painted[key] };
        painted[key].title = { ...painted[key].title, font: { size: 12, color: colour("soft") } };
      }
    }
    return { ...painted, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: colour("ink") },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("faint"), activecolor: colour("ink"), orientation: "h" },
      hoverlabel: { ...painted.hoverlabel, bgcolor: colour("raised"), bordercolor: colour("rule"), font: { color: colour("ink") } } };
  };

  const plots = Object.entries(figures).filter(([id]) => !id.endsWith("-map"));
  const draw = () => Promise.all(plots.map(([id, figure]) =>
    Plotly.react(id, paint(figure.data), layoutOf(figure.layout, id), config)));

  // Where a time is in a plot, and the other way round.
  const axis = (plot) => {
    const { margin, xaxis } = plot.layout, [begin, end] = xaxis.range;
    const perUnit = (plot.clientWidth - margin.l - margin.r) / (end - begin);
    return { begin, end, place: (time) => margin.l + (time - begin) * perUnit, time: (place) => begin + (place - margin.l) / perUnit };
  };
  const mark = (plot, line, time) => {
    const { begin, end, place } = axis(plot);
    line.hidden = time < begin || time > end;
    line.style.left = `${place(time)}px`;
  };

  const maps = [];
  const show = (id) => {
    const section = id.replace(/-map$/, ""), places = tracks[section] ?? [];
    const plot = document.getElementById(`${section}-time`), [begin, end] = figures[`${section}-time`].layout.xaxis.range;
    const map = new FlightMap(document.getElementById(id), figures[id], places);
    const player = new Player(document.getElementById(`${section}-player`), begin, end);
    const line = Object.assign(document.createElement("div"), { className: "now" });
    plot.append(line);
    const moved = () => { map.show(player.time); mark(plot, line, player.time); };
    const timeOf = ({ event }) => axis(plot).time(event.clientX - plot.getBoundingClientRect().left);
    const go = (time) => { player.play(false); player.set(time); };
    player.addEventListener("time", moved);
    map.addEventListener("time", ({ detail }) => go(detail));
    plot.on("plotly_click", (event) => go(timeOf(event)));
    plot.on("plotly_hover", (event) => map.point(timeOf(event)));
    plot.on("plotly_unhover", () => map.point(-Infinity));
    plot.on("plotly_afterplot", () => mark(plot, line, player.time));
    document.addEventListener("click", (event) => {
      const link = event.target.closest("a.at");
      if (link?.dataset.section !== section) return;
      const at = Number(link.dataset.time);
      Plotly.relayout(plot, { "xaxis.range": [at - shownAround, at + shownAround] });
      go(at);
    });
    maps.push(map);
    moved();
  };

  const theme = () => {
    document.documentElement.dataset.theme = Object.keys(fixed).length || !dark.matches ? "day" : "night";
    for (const map of maps) map.paint();
  };
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const follow = () => {
    Object.keys(figures).filter((id) => id.endsWith("-map")).forEach(show);
    theme();
  };

  const done = () => {
    document.documentElement.dataset.drawn = document.querySelectorAll(".plot .main-svg").length;
  };
  draw().then(follow).then(done).catch((error) => tell(String(error)));
  dark.addEventListener("change", () => { draw(); theme(); });
  // Paper is white, whatever the screen is.
  const onPaper = { paper: "#fff", ink: "#111", soft: "#444", rule: "#ccc", grid: "#e6e6e6", raised: "#fff",
    track: "#0072b2", second: "#a65600", plan: "#7a5195", goal: "#00795a", mode: "#55606e", bad: "#c23b00",
    warn: "#8a6100", other: "#d55e00", tint1: "#d6e8f5", tint2: "#fbe5cf", tint3: "#d8efe6", faint: "#999" };
  addEventListener("beforeprint", () => { fixed = onPaper; draw(); theme(); });
  addEventListener("afterprint", () => { fixed = {}; draw(); theme(); });
})();
