// The bar of a recording: play, pause, position and speed.

const SPEEDS = [0.5, 1, 2, 5, 10, 50];
const STEP_S = 10;
// Between two positions that are asked for while the slider is dragged.
const PAUSE_MS = 250;
const LOST_MS = 5000;

const $ = (id) => document.getElementById(id);

function clock(seconds) {
  const whole = Math.max(0, Math.floor(seconds));
  const [hours, minutes] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60];
  const two = (value) => String(value).padStart(2, "0");
  return hours ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

export class Replay {
  constructor(send) {
    this.send = send;
    this.state = null;
    this.wanted = null;
    this.sent = -PAUSE_MS;
    this.timer = 0;
    this.slider = $("replay-seek");
    $("replay-speed").replaceChildren(...SPEEDS.map((speed) => new Option(`${speed}\u00d7`, speed)));
    $("replay-speed").onchange = (event) => this.send({ name: "speed", speed: Number(event.target.value) });
    $("replay-start").onclick = () => this.start();
    $("replay-play").onclick = () => this.toggle();
    this.slider.oninput = () => this.seek(this.slider.valueAsNumber);
    // The slider's own keys are not those of the map.
    this.slider.onkeydown = (event) => /^(Arrow|Page|Home|End)/.test(event.key) && event.stopPropagation();
    this.keys = [
      [" ", "Recording: play or pause", () => this.toggle()],
      [",", `Recording: back by ${STEP_S} s`, () => this.step(-STEP_S)],
      [".", `Recording: on by ${STEP_S} s`, () => this.step(STEP_S)],
      ["x", "Recording: next speed", () => this.faster()],
      ["Home", "Recording: from the start", () => this.start()],
    ];
  }

  start() {
    if (this.state) this.send({ name: "start" });
  }

  toggle() {
    if (!this.state) return;
    if (this.state.ended) this.send({ name: "start" });
    else this.send({ name: this.state.paused ? "resume" : "pause" });
  }

  faster() {
    if (!this.state) return;
    this.send({ name: "speed", speed: SPEEDS.find((speed) => speed > this.state.speed) ?? SPEEDS[0] });
  }

  step(seconds) {
    if (!this.state) return;
    const from = this.wanted ?? this.state.position;
    const to = Math.max(0, Math.min(this.state.duration || Infinity, from + seconds));
    this.slider.value = to;
    this.seek(to);
  }

  // Of the positions that a drag passes, those are asked for that there is time for, and the last.
  seek(position) {
    this.wanted = position;
    this.showTime();
    this.ask();
  }

  ask() {
    if (this.wanted === null || this.timer) return;
    const wait = this.sent + PAUSE_MS - performance.now();
    if (wait > 0) {
      this.timer = setTimeout(() => { this.timer = 0; this.ask(); }, wait);
      return;
    }
    this.sent = performance.now();
    this.asked = this.wanted;
    this.jumps = this.state?.jumps;
    this.send({ name: "seek", position: this.wanted });
  }

  show(state) {
    const there = Boolean(state && state.position !== undefined);
    $("replay").hidden = !there;
    this.state = there ? state : null;
    if (!there) { this.wanted = null; return; }
    if (this.wanted !== null && this.wanted === this.asked && !state.seeking
      && (state.jumps !== this.jumps || performance.now() - this.sent > LOST_MS)) this.wanted = null;
    const { position, duration, paused, ended, seeking, speed } = state;
    const play = $("replay-play");
    const text = ended ? "Play again" : paused ? "Play" : "Pause";
    if (play.textContent !== text) play.textContent = text;
    this.slider.max = Math.max(duration, position);
    this.slider.disabled = !duration;
    if (this.wanted === null && !seeking) this.slider.value = position;
    const select = $("replay-speed");
    if (document.activeElement !== select && Number(select.value) !== speed) {
      // Of another client, one that is not among these.
      if (!SPEEDS.includes(speed)) select.replaceChildren(new Option(speed ? `${speed}\u00d7` : "fastest", speed), ...SPEEDS.map((each) => new Option(`${each}\u00d7`, each)));
      select.value = speed;
    }
    this.showTime();
    document.body.dataset.replay = seeking ? "seeking" : ended ? "ended" : paused ? "paused" : "playing";
  }

  showTime() {
    if (!this.state) return;
    const { position, duration, seeking } = this.state;
    const text = `${clock(this.wanted ?? position)} / ${duration ? clock(duration) : "?"}${seeking ? " \u2026" : ""}`;
    if ($("replay-time").textContent !== text) $("replay-time").textContent = text;
    this.slider.setAttribute("aria-valuetext", text);
  }
}
