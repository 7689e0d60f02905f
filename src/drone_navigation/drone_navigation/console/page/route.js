// The route that is being drawn: waypoints {x, y, z, hold, acts}, a selection, the corners {x, y} of the
// area whose survey it is, if it is one, its holes, and a way back.

const UNDO_MAX = 100;

export class Route extends EventTarget {
  constructor() {
    super();
    this.points = [];
    this.selected = -1;
    this.area = [];
    this.holes = [];
    this.past = [];
  }

  keep() {
    this.past.push({ points: this.points.map((point) => ({ ...point })), selected: this.selected, area: this.area, holes: this.holes });
    if (this.past.length > UNDO_MAX) this.past.shift();
  }

  changed() {
    this.selected = Math.min(this.selected, this.points.length - 1);
    this.dispatchEvent(new Event("change"));
  }

  undo() {
    const before = this.past.pop();
    if (!before) return;
    Object.assign(this, before);
    this.changed();
  }

  insert(at, point) {
    this.keep();
    this.points.splice(at, 0, point);
    this.selected = at;
    this.changed();
  }

  add(point) {
    this.insert(this.points.length, point);
  }

  insertAfter(index) {
    const here = this.points[index];
    const next = this.points[index + 1] ?? { ...here, x: here.x + 10 };
    const middle = { x: (here.x + next.x) / 2, y: (here.y + next.y) / 2, z: (here.z + next.z) / 2 };
    this.insert(index + 1, { ...middle, hold: 0 });
  }

  // A drag is one step: the first call of it keeps what was before.
  move(index, change, first = true) {
    if (!this.points[index]) return;
    if (first) this.keep();
    Object.assign(this.points[index], change);
    this.selected = index;
    this.changed();
  }

  remove(index) {
    if (!this.points[index]) return;
    this.keep();
    this.points.splice(index, 1);
    this.changed();
  }

  // The points are the corners of a hole of the area that is drawn next.
  makeHole() {
    this.replace([], [], [...this.holes, this.points.map(({ x, y }) => ({ x, y }))]);
  }

  replace(points, area = [], holes = []) {
    this.keep();
    this.area = area;
    this.holes = holes;
    this.points = points.map((point) => ({ ...point }));
    this.selected = -1;
    this.changed();
  }

  select(index) {
    this.selected = index;
    this.dispatchEvent(new Event("change"));
  }
}
