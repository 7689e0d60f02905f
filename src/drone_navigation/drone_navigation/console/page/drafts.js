// The routes that are drawn, one for each vehicle; the one that is edited is in `route`.

const $ = (id) => document.getElementById(id);
// A waypoint as it is sent.
export const ofPage = ({ x, y, z, hold, acts }) => ({ x, y, z, hold, ...(acts?.length ? { acts } : {}) });
const EMPTY = { points: [], selected: -1, area: [], holes: [], past: [], speed: "0", laps: "1", radius: "0", turn: "0" };

export class Drafts {
  constructor(route) {
    this.route = route;
    this.kept = {};
    this.edited = "";
  }

  current() {
    const { points, selected, area, holes, past } = this.route;
    return { points, selected, area, holes, past, speed: $("speed").value, laps: $("laps").value, radius: $("radius").value, turn: $("turn").value };
  }

  of(name) {
    return name === this.edited ? this.current() : this.kept[name] ?? EMPTY;
  }

  // Puts away the route of one vehicle, and takes out that of another.
  edit(name) {
    if (name === this.edited) return;
    if (this.edited) this.kept[this.edited] = this.current();
    this.edited = name;
    const { points, selected, area, holes, past, speed, laps, radius, turn } = this.kept[name] ?? EMPTY;
    Object.assign(this.route, { points: [...points], selected, area, holes, past: [...past] });
    $("speed").value = speed;
    $("laps").value = laps;
    $("radius").value = radius;
    $("turn").value = turn;
    this.route.changed();
  }

  clear(name) {
    if (name === this.edited) {
      $("radius").value = EMPTY.radius;
      $("turn").value = EMPTY.turn;
      this.route.replace([]);
    }
    else delete this.kept[name];
  }

  // With how many degrees in a second, to the right, the vehicle turns on a route.
  turn(name) {
    const { points, radius, turn } = this.of(name);
    const circles = points.length === 1 && Number.parseFloat(radius);
    return circles ? 0 : Math.min(Math.max(Number.parseFloat(turn) || 0, -180), 180);
  }

  // What would be flown, without whether obstacles are avoided; null without a route.
  order(name) {
    const { points, speed, laps, radius } = this.of(name);
    if (!points.length) return null;
    const least = (text, low) => Math.max(Number.parseFloat(text) || 0, low);
    const waypoints = points.map(ofPage);
    return { vehicle: name, waypoints, speed: least(speed, 0), laps: Math.round(least(laps, 1)), radius: points.length === 1 ? Number.parseFloat(radius) || 0 : 0 };
  }
}
