// A question to the console that moves nothing, asked again when what it is about has changed.

const SETTLED_MS = 400;
const AGAIN_MS = 5000;
// So long an answer about one flight is waited for before it is asked for again.
const LATE_MS = 20000;

export class Question extends EventTarget {
  // `type` is that of the message; `order` returns what is asked about, null for nothing; `from`
  // what else the answer depends on.
  constructor(link, type, order, from) {
    super();
    Object.assign(this, { link, type, order, from, number: 0, sent: 0, timer: 0, result: null });
    this.asked = this.begun = "";
    this.late = 0;
  }

  // What it is about has changed, or may have. It never keeps anything waiting.
  look() {
    const order = this.order();
    const key = order ? JSON.stringify(order) : "";
    if (key === this.asked) return;
    this.asked = key;
    this.result = null;
    this.number += 1;
    clearTimeout(this.timer);
    this.late = 0;
    if (order) this.timer = setTimeout(() => this.ask(), SETTLED_MS);
    this.dispatchEvent(new Event("change"));
  }

  // Again while it is there, if the vehicle has moved on.
  ask() {
    const order = this.order();
    clearTimeout(this.timer);
    if (!order) return;
    this.timer = setTimeout(() => this.ask(), AGAIN_MS);
    const from = JSON.stringify(this.from());
    if (Date.now() < this.late || from === this.begun && this.isAnswered) return;
    this.late = Date.now() + LATE_MS * (order.routes?.length ?? 1);
    this.begun = from;
    this.number += 1;
    this.sent = this.number;
    this.link.send({ type: this.type, number: this.number, ...order });
  }

  // Whether an answer is about what was asked last, which has not changed since.
  isNewest(number) {
    return number === this.sent && number === this.number;
  }

  // The result; `last` if nothing more comes.
  take(result, last) {
    this.result = result;
    if (last) this.late = 0;
    this.dispatchEvent(new Event("change"));
  }

  get isAnswered() {
    return Boolean(this.result);
  }

  // Whether nothing is known yet of what is drawn now.
  get pending() {
    return Boolean(this.asked) && !this.result;
  }
}
