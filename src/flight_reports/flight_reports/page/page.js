"use strict";
// Draws the plots of the page, in its colours, and leads from the tables into them.
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

  const draw = () => Promise.all(Object.entries(figures).map(([id, figure]) =>
    Plotly.react(id, paint(figure.data), layoutOf(figure.layout, id), config)));

  const pointAt = (section, time) => {
    const track = tracks[section], map = figures[`${section}-map`];
    if (!track || !map) return;
    const places = Array.isArray(track) ? track : [track];
    const found = places.map((place) => {
      const after = place.t.findIndex((t) => t >= time);
      return after < 0 ? place.t.length - 1 : after;
    });
    Plotly.restyle(`${section}-map`, { x: [places.map((p, i) => p.x[found[i]])],
      y: [places.map((p, i) => p.y[found[i]])] }, [map.data.length - 1]);
  };

  const follow = () => {
    for (const section of Object.keys(tracks)) {
      document.getElementById(`${section}-time`).on("plotly_hover", (event) => pointAt(section, event.xvals ? event.xvals[0] : event.points[0].x));
    }
    document.addEventListener("click", (event) => {
      const link = event.target.closest("a.at");
      if (!link) return;
      const { section, time } = link.dataset, at = Number(time), id = `${section}-time`;
      const shapes = (layoutOf(figures[id].layout, id).shapes || []).concat({ type: "line", xref: "x",
        yref: "paper", x0: at, x1: at, y0: 0, y1: 1, line: { color: colour("ink"), width: 2 } });
      Plotly.relayout(id, { "xaxis.range": [at - shownAround, at + shownAround], shapes });
      pointAt(section, at);
    });
  };

  const done = () => {
    document.documentElement.dataset.drawn = document.querySelectorAll(".plot .main-svg").length;
  };
  draw().then(follow).then(done).catch((error) => tell(String(error)));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  // Paper is white, whatever the screen is.
  const onPaper = { paper: "#fff", ink: "#111", soft: "#444", rule: "#ccc", grid: "#e6e6e6", raised: "#fff",
    track: "#0072b2", second: "#a65600", plan: "#7a5195", goal: "#00795a", mode: "#55606e", bad: "#c23b00",
    warn: "#8a6100", other: "#d55e00", tint1: "#d6e8f5", tint2: "#fbe5cf", tint3: "#d8efe6", faint: "#999" };
  addEventListener("beforeprint", () => { fixed = onPaper; draw(); });
  addEventListener("afterprint", () => { fixed = {}; draw(); });
})();
