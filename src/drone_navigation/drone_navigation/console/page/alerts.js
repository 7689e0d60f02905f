// What a person must not miss: over the whole width, with sound by choice, until acknowledged.

import { failsafe } from "./words.js";

const BEEP_MS = 2000;
const BEEP_S = 0.25;
const BEEP_HZ = 880;
const $ = (id) => document.getElementById(id);

// The alerts that hold now for a vehicle: a key for each occurrence, and a sentence.
function conditions(v) {
  const found = [];
  const status = v.status ?? {};
  if (v.replay || !v.status) return found;
  if (status.failsafe) found.push([`failsafe ${status.failsafe}`, `Failsafe: ${failsafe(status.failsafe)}.`]);
  const percent = v.battery?.percent;
  const reserve = 100 * (status.reserve ?? 0);
  const need = Math.min(reserve + 100 * (status.return_share ?? 0), 100);
  if (percent !== null && percent !== undefined && status.connected) {
    if (percent < reserve) found.push(["reserve", `Battery ${percent} %: below the reserve of ${reserve.toFixed(0)} %.`]);
    else if (percent < need && status.armed) found.push(["return", `Battery ${percent} %: the return takes it below the reserve; turn back.`]);
  }
  if (v.end?.code === "DISARMED") found.push([`disarmed ${v.end.number}`, v.end.text]);
  else if (v.fell) found.push([`fell ${v.fell}`, "The motors were disarmed in the air."]);
  if (v.alive && !status.connected && v.wasConnected) found.push(["link", "The link to the vehicle is lost."]);
  if (!v.alive && (status.armed || v.goal)) found.push(["silent", "The navigation server is silent while the motors are armed."]);
  return found;
}

export class Alerts {
  // `name` makes the name of a vehicle for people.
  constructor(name) {
    Object.assign(this, { name, open: new Map(), seen: new Map(), beep: 0, audio: null });
    let kept = null;
    try { kept = localStorage.getItem("sound"); } catch { /* none is kept */ }
    this.sound = kept === "on";
    $("acknowledge").onclick = () => this.acknowledge();
    $("sound").onclick = () => this.toggle();
    this.show();
  }

  // What changes from armed to disarmed in the air has fallen.
  watch(v) {
    const status = v.status ?? {};
    const up = status.landed === "in the air" || status.landed === "taking off";
    if (v.wasUp && !status.armed && v.alive) v.fell = (v.fell ?? 0) + 1;
    v.wasUp = Boolean(status.armed) && up;
    v.wasConnected ||= Boolean(status.connected);
  }

  // Of all vehicles, whichever is chosen. What is over stays until it is acknowledged.
  look(vehicles) {
    for (const [vehicle, v] of Object.entries(vehicles)) {
      this.watch(v);
      const now = conditions(v);
      const before = this.seen.get(vehicle) ?? new Set();
      for (const [key, text] of now) {
        if (!before.has(key) || this.open.has(`${vehicle} ${key}`)) this.open.set(`${vehicle} ${key}`, `${this.name(vehicle)}: ${text}`);
      }
      // The end of the goal says more than that the motors were disarmed.
      if (now.some(([key]) => key.startsWith("disarmed"))) {
        for (const key of this.open.keys()) if (key.startsWith(`${vehicle} fell`)) this.open.delete(key);
      }
      this.seen.set(vehicle, new Set(now.map(([key]) => key)));
    }
    this.show();
  }

  acknowledge() {
    this.open.clear();
    this.show();
  }

  toggle() {
    this.sound = !this.sound;
    try { localStorage.setItem("sound", this.sound ? "on" : "off"); } catch { /* not kept then */ }
    this.show();
  }

  show() {
    const texts = [...this.open.values()];
    $("alerts").hidden = !texts.length;
    if ($("alert-text").textContent !== texts.join(" ")) $("alert-text").textContent = texts.join(" ");
    $("sound").setAttribute("aria-pressed", String(this.sound));
    const beeps = this.sound && texts.length > 0;
    if (beeps && !this.beep) this.beep = setInterval(() => this.play(), BEEP_MS);
    if (!beeps) this.beep = clearInterval(this.beep) ?? 0;
  }

  play() {
    this.audio ??= new AudioContext();
    const tone = this.audio.createOscillator();
    tone.frequency.value = BEEP_HZ;
    tone.connect(this.audio.destination);
    tone.start();
    tone.stop(this.audio.currentTime + BEEP_S);
  }
}
