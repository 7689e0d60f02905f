// The socket to the console: merges what has changed, and connects again when it is lost.

const RETRY_MS = 1000;
const RETRY_MAX_MS = 5000;
const ALIVE_MS = 1000;

export class Link extends EventTarget {
  constructor(token) {
    super();
    this.token = token;
    this.address = `ws://${location.host}/socket?token=${encodeURIComponent(token)}`;
    this.vehicles = {};
    this.trails = {};
    this.control = {};
    this.rejected = {};
    this.page = 0;
    this.pages = 0;
    this.open = false;
    this.retry = RETRY_MS;
    setInterval(() => this.send({ type: "alive" }), ALIVE_MS);
    this.connect();
  }

  connect() {
    const socket = new WebSocket(this.address);
    this.socket = socket;
    socket.onopen = () => {
      this.open = true;
      this.retry = RETRY_MS;
    };
    socket.onmessage = (event) => this.take(JSON.parse(event.data));
    socket.onclose = () => {
      this.open = false;
      this.dispatchEvent(new Event("state"));
      setTimeout(() => this.connect(), this.retry);
      this.retry = Math.min(2 * this.retry, RETRY_MAX_MS);
    };
  }

  send(message) {
    if (!this.open) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  take(message) {
    if (message.type !== "state") {
      this.dispatchEvent(new CustomEvent(message.type, { detail: message }));
      return;
    }
    if (message.page !== undefined) {
      this.page = message.page;
      this.vehicles = {};
      this.trails = message.trails;
      this.tiles = message.tiles;
    }
    for (const name of ["control", "pages", "rejected"]) {
      if (message[name] !== undefined) this[name] = message[name];
    }
    for (const [name, values] of Object.entries(message.vehicles ?? {})) {
      // At another position of a recording the vehicle did not fly there from here.
      const [now, before] = [values.replay, this.vehicles[name]?.replay];
      const jumped = now && before && (now.jumps !== before.jumps || now.seeking !== before.seeking);
      if (jumped && message.page === undefined) this.trails[name] = [];
      Object.assign((this.vehicles[name] ??= {}), values);
      if (values.motion) this.trace(name, values.motion.at);
    }
    this.dispatchEvent(new Event("state"));
  }

  trace(name, at) {
    const trail = (this.trails[name] ??= []);
    const last = trail[trail.length - 1];
    if (last && Math.hypot(at[0] - last[0], at[1] - last[1], at[2] - last[2]) < 0.5) return;
    trail.push(at);
    if (trail.length > 1200) trail.splice(0, 200);
  }
}
