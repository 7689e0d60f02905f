// Okabe and Ito's colours, which colour-blind people tell apart; shapes differ, too.

const DAY = {
  back: "#eef2f5", grid: "#d5dde3", axis: "#b4c0ca", ink: "#14202b", soft: "#526270", halo: "#ffffff",
  vehicle: "#0072b2", other: "#526270", trail: "#56b4e9", plan: "#e69f00", earlier: "#b39a62",
  goal: "#009e73", draft: "#7a3b9a", known: "#d55e00", seen: "#cc79a7", home: "#14202b", volume: "#526270", mission: "#7a4a00",
  rehearsed: "#7d6b00",
};
const NIGHT = {
  back: "#10181f", grid: "#1f2b35", axis: "#33434f", ink: "#e6edf3", soft: "#9db0c0", halo: "#10181f",
  vehicle: "#56b4e9", other: "#9db0c0", trail: "#2f7fae", plan: "#e69f00", earlier: "#7d6a3c",
  goal: "#00c08b", draft: "#cba6e8", known: "#f08a3c", seen: "#e39cc4", home: "#e6edf3", volume: "#9db0c0", mission: "#d8b365",
  rehearsed: "#f0e442",
};

export const colours = () => (document.documentElement.dataset.theme === "night" ? NIGHT : DAY);

// Makes a canvas as fine as the screen; returns its context, width and height in CSS pixels.
export function prepared(canvas) {
  const ratio = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "12px system-ui, sans-serif";
  context.lineJoin = "round";
  return [context, width, height];
}

export function label(context, text, x, y, colour, halo) {
  context.lineWidth = 3;
  context.strokeStyle = halo;
  context.strokeText(text, x, y);
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

// The round number of metres (1, 2, 5, 10 ...) that is at least so many pixels long.
export function roundStep(pixelsPerMetre, pixelsMin) {
  const least = pixelsMin / pixelsPerMetre;
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= least);
}
