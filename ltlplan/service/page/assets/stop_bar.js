// The stop button of each flight in the air, at the foot of every tab, for those who may press it.
import { CONFIRM, LEVELS, Line } from "ltlplan_feed";

const LOOK = 2500; // ms between two looks at which flights there are
const SURE = 4000; // ms for which motors off asks for the second press
const RANK = { hold: 1, land: 2, stop: 3 };

export default {
  template: `
<section v-if="flights.length" class="stops" aria-label="Stop a flight">
  <div v-for="flight in flights" class="stop-flight" :key="flight.run" :data-run="flight.run">
    <button type="button" class="stop" @click="stop(flight, level(flight))">{{ level(flight) === "hold" ? "Stop" : "Land" }} {{ flight.name }}</button>
    <button v-if="ordered(flight)" type="button" class="motors" :class="{ sure: sure === flight.run }" @click="motors(flight, $event)">
      {{ sure === flight.run ? "Robots fall. Press again" : "Motors off" }}</button>
    <p class="receipts" role="status"><template v-for="part in told(flight)"><span :class="part[1]">{{ part[0] }}</span> </template></p>
  </div>
  <p class="no-safety">No safety function: the terminal and the kill switch come first.</p>
</section>`,
  data: () => ({ flights: [], orders: {}, sure: null, tick: 0 }),
  mounted() {
    this.lines = {};
    this.find();
    this.finding = setInterval(() => this.find(), LOOK);
    this.ticking = setInterval(() => { this.tick++; }, 100);
  },
  beforeUnmount() {
    clearInterval(this.finding);
    clearInterval(this.ticking);
    for (const { line, looker } of Object.values(this.lines)) line.leave(looker);
  },
  methods: {
    async find() {
      let found;
      try {
        const answer = await fetch("/api/live", { credentials: "same-origin", headers: { accept: "application/json" } });
        if (!answer.ok) return;
        found = await answer.json();
      } catch { return; } // what is shown stays: the button is in reach while the service is not
      const shown = found.filter((flight) => flight.ended === null && (flight.connected || flight.silent < 60));
      const kept = this.flights.filter((old) => this.orders[old.run] && !shown.some((flight) => flight.run === old.run) && this.recent(old));
      this.flights = [...shown, ...kept];
      for (const flight of this.flights) {
        if (this.lines[flight.run]) continue;
        const looker = { frame: (frame) => this.heard(flight.run, frame) };
        const line = Line.of(flight.name);
        this.lines[flight.run] = { line, looker };
        line.look(looker);
      }
      for (const run of Object.keys(this.lines)) {
        if (this.flights.some((flight) => flight.run === Number(run))) continue;
        this.lines[run].line.leave(this.lines[run].looker);
        delete this.lines[run];
      }
    },
    recent(flight) { return performance.now() - this.orders[flight.run].at < 60000; },
    ordered(flight) { return Boolean(this.orders[flight.run]?.receipt) && !this.lines[flight.run]?.line.frame?.over; },
    motors(flight, event) {
      if (event.detail === 2) return; // a double click is no second thought
      if (this.sure === flight.run) { this.sure = null; this.stop(flight, "motors"); return; }
      this.sure = flight.run;
      clearTimeout(this.doubt);
      this.doubt = setTimeout(() => { this.sure = null; }, SURE);
    },
    // What the button orders next: a hold, and a landing once the team holds or lands, whoever ordered that.
    level(flight) {
      this.tick;
      const frame = this.lines[flight.run]?.line.frame;
      return frame && (frame.ordered || frame.ending) ? "land" : "hold";
    },
    async stop(flight, level) {
      const held = this.lines[flight.run].line.frame?.ordered === "hold";
      const order = { least: level === "motors" ? 3 : level === "land" && held ? 2 : 1, at: performance.now(), receipt: null, took: 0, trouble: "", outcome: null, vehicles: {} };
      this.orders[flight.run] = order;
      const mine = this.orders[flight.run];
      try {
        const { receipt, took } = await this.lines[flight.run].line.stop(flight.run, level);
        mine.receipt = receipt;
        mine.took = took;
      } catch (error) { mine.trouble = error.message; }
    },
    heard(run, frame) {
      const order = this.orders[run];
      if (!order || !order.receipt) return;
      order.outcome = frame.orders.find((each) => each.order === order.receipt.order) || order.outcome;
      for (const [name, robot] of Object.entries(frame.robots)) {
        const known = (order.vehicles[name] ??= { level: null, took: null });
        if (!order.outcome || order.outcome.outcome !== "taken") continue;
        if (RANK[robot.acknowledged] >= order.least && known.took === null) known.took = performance.now() - order.at;
        known.level = robot.acknowledged;
      }
    },
    // What is known of the last order, as words and their classes.
    told(flight) {
      this.tick; // again and again, as what does not come counts too
      const order = this.orders[flight.run];
      if (!order) return [];
      const late = performance.now() - order.at > CONFIRM;
      if (order.trouble) return [["Not confirmed: " + order.trouble, "bad"]];
      if (!order.receipt) return [[late ? "Not confirmed: the service did not answer." : "Sent.", late ? "bad" : "soft"]];
      const words = [["Service: on the line, " + Math.round(order.took) + " ms.", "soft"]];
      if (!order.outcome) return [...words, late ? ["Flight: not confirmed. Use the terminal.", "bad"] : ["Flight: waits.", "soft"]];
      if (order.outcome.outcome !== "taken") return [...words, ["Flight: " + order.outcome.outcome + ", " + order.outcome.sentence + ".", "bad"]];
      for (const [name, { level, took }] of Object.entries(order.vehicles)) {
        if (took !== null) words.push([name + ": " + LEVELS[level] + ", " + Math.round(took) + " ms.", "good"]);
        else words.push(late ? [name + ": not confirmed.", "bad"] : [name + ": waits.", "soft"]);
      }
      return words;
    },
  },
};
