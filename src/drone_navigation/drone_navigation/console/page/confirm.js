// What starts something is confirmed by a slide, or by holding the space bar: never by a click.

const HOLD_MS = 1500;

export class Confirm {
  constructor() {
    this.box = document.getElementById("confirm");
    this.text = document.getElementById("confirm-text");
    this.slide = document.getElementById("slide");
    this.knob = document.getElementById("knob");
    this.fill = document.getElementById("slide-fill");
    this.act = null;
    this.held = 0;
    this.frame = 0;
    document.getElementById("abort").onclick = () => this.close();
    this.knob.onpointerdown = (event) => this.grab(event);
    addEventListener("keydown", (event) => this.press(event), true);
    addEventListener("keyup", (event) => { if (event.code === "Space") this.release(); }, true);
    addEventListener("blur", () => this.release());
  }

  // `danger`: a question of its own, in another colour, before the usual one.
  ask(text, act, danger = false) {
    this.release();
    this.act = act;
    this.box.classList.toggle("danger", danger);
    this.text.textContent = text;
    this.box.hidden = false;
    // A focused button would take the space bar for a click.
    if (document.activeElement instanceof HTMLElement) document.activeElement.blur();
  }

  close() {
    this.release();
    this.act = null;
    this.box.hidden = true;
  }

  get asking() {
    return this.act !== null;
  }

  done(how) {
    const act = this.act;
    this.close();
    act?.(how);
  }

  show(part) {
    const width = this.slide.clientWidth - this.knob.offsetWidth - 4;
    this.knob.style.transform = `translateX(${part * width}px)`;
    this.fill.style.width = `${part * 100}%`;
  }

  grab(event) {
    if (!this.act) return;
    const from = event.clientX;
    const width = this.slide.clientWidth - this.knob.offsetWidth - 4;
    this.knob.setPointerCapture(event.pointerId);
    const part = (moved) => Math.max(0, Math.min(1, (moved.clientX - from) / width));
    this.knob.onpointermove = (moved) => this.show(part(moved));
    this.knob.onpointerup = (moved) => {
      this.knob.onpointermove = this.knob.onpointerup = null;
      if (part(moved) > 0.95) this.done("slide");
      else this.show(0);
    };
    this.knob.onpointercancel = () => {
      this.knob.onpointermove = this.knob.onpointerup = null;
      this.show(0);
    };
  }

  press(event) {
    if (!this.act) return;
    if (event.code === "Escape") this.close();
    if (event.code !== "Space") return;
    event.preventDefault();
    event.stopPropagation();
    if (event.repeat || this.held) return;
    this.held = performance.now();
    const step = () => {
      const part = (performance.now() - this.held) / HOLD_MS;
      this.show(Math.min(part, 1));
      if (part >= 1) this.done("held");
      else this.frame = requestAnimationFrame(step);
    };
    this.frame = requestAnimationFrame(step);
  }

  release() {
    cancelAnimationFrame(this.frame);
    this.held = 0;
    this.show(0);
  }
}
