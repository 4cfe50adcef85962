// Lines to flights in the air: one socket each, shared by all that look at it, begun anew when it breaks; and orders to stop, which need no socket.
const AGAIN = 1000; // ms before a line that broke is begun anew
const QUIET = 1000; // ms without a frame after which a flight is not seen
export const CONFIRM = 2000; // ms within which a vehicle is to acknowledge an order

const lines = new Map();

export class Line {
  static of(name) {
    if (!lines.has(name)) lines.set(name, new Line(name));
    return lines.get(name);
  }

  constructor(name) {
    this.name = name;
    this.lookers = new Set();
    this.state = this.picture = this.frame = null;
    this.seen = -Infinity;
    this.said = [];
  }

  // Looks at the flight: `looker` has `state`, `picture` and `frame`, each called with what is new.
  look(looker) {
    this.lookers.add(looker);
    if (this.state) looker.state?.(this.state);
    if (this.picture) looker.picture?.(this.picture);
    if (this.frame) looker.frame?.(this.frame);
    if (!this.socket) this.begin();
  }

  leave(looker) {
    this.lookers.delete(looker);
    if (!this.lookers.size) this.close();
  }

  close() {
    clearTimeout(this.waiting);
    const socket = this.socket;
    this.socket = null;
    if (socket) socket.close();
    lines.delete(this.name);
  }

  get quiet() { return performance.now() - this.seen > QUIET; }
  get silent() { return (performance.now() - this.seen) / 1000; }

  begin() {
    const address = new URL(`/api/live/${encodeURIComponent(this.name)}/watch`, location.href);
    address.protocol = address.protocol.replace("http", "ws");
    const socket = (this.socket = new WebSocket(address));
    socket.onmessage = (message) => this.take(JSON.parse(message.data));
    socket.onclose = () => {
      if (this.socket !== socket) return;
      this.waiting = setTimeout(() => this.begin(), AGAIN);
    };
  }

  take(message) {
    const value = message[message.kind === "state" ? "flight" : message.kind];
    if (message.kind === "state" && this.state && value && value.run !== this.state.run) { this.said = []; this.picture = this.frame = null; }
    if (message.kind === "frame") {
      this.seen = performance.now();
      this.said = [...this.said, ...value.said].slice(-200);
    }
    this[message.kind] = value;
    for (const looker of [...this.lookers]) looker[message.kind]?.(value);
  }

  // Orders a stop, and returns the service's receipt and how long it took, ms; throws what went wrong, in words.
  async stop(run, level) {
    const began = performance.now();
    const limit = AbortSignal.timeout(CONFIRM);
    const answer = await fetch(`/api/live/${encodeURIComponent(this.name)}/stop?run=${run}&level=${level}`, {
      method: "POST", credentials: "same-origin", signal: limit, headers: { accept: "application/json" },
    }).catch(() => { throw new Error("The service did not answer."); });
    const told = await answer.json().catch(() => ({}));
    if (!answer.ok) throw new Error(told.detail || "The service answered " + answer.status + ".");
    return { receipt: told, took: performance.now() - began };
  }
}

export const LEVELS = { hold: "holds", land: "lands", stop: "motors off" };
