// Heights of waypoints, dragged in the side view.

const NEAR_PX = { mouse: 14, pen: 14, touch: 24 };
const CLICK_PX = 3;

export class Heights {
  // adopt(index) makes the waypoints in flight the route that is drawn; -1 if it cannot.
  constructor(canvas, route, layout, adopt) {
    this.canvas = canvas;
    this.route = route;
    this.layout = layout;
    this.adopt = adopt;
    this.drag = null;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    canvas.addEventListener("pointerup", () => this.up());
    canvas.addEventListener("pointercancel", () => this.up());
  }

  up() {
    if (!this.drag) return;
    this.drag = null;
    this.route.changed();
  }

  // What of the drawing must not change under a drag, and which waypoint is chosen.
  get state() {
    return { top: this.drag?.top, selected: this.route.selected };
  }

  hit(event) {
    const box = this.canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const near = NEAR_PX[event.pointerType] ?? NEAR_PX.mouse;
    // The last one is drawn on top.
    const mark = [...this.layout().marks].reverse().find((each) => Math.hypot(each.x - x, each.y - y) <= near);
    return { y, mark };
  }

  down(event) {
    const { y, mark } = this.hit(event);
    if (!mark) return;
    this.canvas.setPointerCapture(event.pointerId);
    const { top, heightAt, perMetre } = this.layout();
    this.drag = { index: mark.index, from: y, off: y - mark.y, top, heightAt, step: perMetre > 12 ? 0.1 : 0.5, moved: false };
    if (this.route.points.length) this.route.select(mark.index);
  }

  moved(event) {
    const drag = this.drag;
    const { y, mark } = this.hit(event);
    this.canvas.style.cursor = drag || mark ? "ns-resize" : "";
    if (!drag || (!drag.moved && Math.abs(y - drag.from) < CLICK_PX)) return;
    const first = !drag.moved;
    drag.moved = true;
    if (first) {
      drag.index = this.adopt(drag.index);
      if (drag.index < 0) { this.drag = null; return; }
    }
    const height = Math.round(drag.heightAt(y - drag.off) / drag.step) * drag.step;
    this.route.move(drag.index, { z: Math.round(height * 10) / 10 }, first);
  }
}
