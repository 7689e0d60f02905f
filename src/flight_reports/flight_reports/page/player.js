// The bar that plays a flight: a time, that anything may set.

const SPEEDS = [1, 2, 5, 10, 50];

function clock(seconds) {
  const whole = Math.floor(Math.abs(seconds));
  return `${seconds < 0 ? "\u2212" : ""}${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

export class Player extends EventTarget {
  // From `begin` to `end`, in s; each change of the time is the event "time".
  constructor(element, begin, end) {
    super();
    Object.assign(this, { element, begin, end, time: begin, speed: 1, playing: false });
    this.button = Object.assign(document.createElement("button"), { type: "button", onclick: () => this.play(!this.playing) });
    this.slider = Object.assign(document.createElement("input"), { type: "range", min: begin, max: end, step: 0.1, value: begin });
    this.slider.setAttribute("aria-label", "Time of the flight");
    this.slider.oninput = () => this.set(this.slider.valueAsNumber);
    this.output = document.createElement("output");
    const faster = document.createElement("select");
    faster.setAttribute("aria-label", "Speed");
    faster.append(...SPEEDS.map((speed) => new Option(`${speed}\u00d7`, speed)));
    faster.onchange = () => { this.speed = Number(faster.value); };
    element.append(this.button, this.slider, this.output, faster);
    this.play(false);
    this.set(begin);
  }

  set(time) {
    this.time = Math.max(this.begin, Math.min(this.end, time));
    this.slider.value = this.time;
    this.output.textContent = `${clock(this.time)} / ${clock(this.end)}`;
    this.slider.setAttribute("aria-valuetext", this.output.textContent);
    this.element.dataset.time = this.time.toFixed(2);
    this.dispatchEvent(new Event("time"));
  }

  play(on) {
    this.playing = on;
    this.button.textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (this.time >= this.end) this.set(this.begin);
    let last = performance.now();
    const step = (now) => {
      if (!this.playing) return;
      this.set(this.time + ((now - last) / 1000) * this.speed);
      last = now;
      if (this.time >= this.end) this.play(false);
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}
