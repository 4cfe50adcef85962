// Two flights side by side on one clock.
import { RING_WORDS, Scene } from "ltlplan_scene";

export default {
  template: `
<div class="pair" :data-ready="ready">
  <p v-if="trouble" class="warning" role="alert">{{ trouble }}</p>
  <div class="pair-scenes">
    <figure v-for="(side, i) in sides" v-show="[first, second][i]">
      <figcaption>{{ side }}{{ flights[i] ? ":" : "" }} {{ flights[i] ? flights[i].mission + ", " + flights[i].end.toFixed(1) + " s" : "" }}</figcaption>
      <div class="holder small" ref="holders" role="group" :aria-label="'Moving 3-D picture of the ' + side + ' flight'"></div>
    </figure>
  </div>
  <p class="ring-words" v-show="first || second">{{ ringWords }}</p>
  <div class="player" v-show="first || second">
    <button type="button" class="play" @click="toggle" :aria-label="running ? 'Pause both' : 'Play both'">{{ running ? "Pause" : "Play both" }}</button>
    <input class="clock" ref="clock" type="range" min="0" step="0.01" :max="end" value="0" aria-label="Time of both flights in seconds" @input="seek(Number($event.target.value))">
    <output class="time" ref="time">0.0 s</output>
  </div>
</div>`,
  props: { first: String, second: String },
  data: () => ({ sides: ["first", "second"], flights: [null, null], running: false, end: 1, now: 0, trouble: "", ringWords: RING_WORDS }),
  computed: {
    ready() { return this.flights.every(Boolean) ? "both" : this.flights.some(Boolean) ? "one" : "none"; },
  },
  watch: { first() { this.load(0); }, second() { this.load(1); } },
  mounted() { this.scenes = [null, null]; this.load(0); this.load(1); },
  beforeUnmount() { this.running = false; for (const scene of this.scenes) if (scene) scene.dispose(); },
  methods: {
    async load(i) {
      this.running = false;
      const asked = [this.first, this.second][i];
      let found = null;
      if (asked) {
        try {
          const answer = await fetch(asked, { credentials: "same-origin" });
          if (!answer.ok) throw new Error("the service answered " + answer.status);
          found = Object.freeze(await answer.json());
          this.trouble = "";
        } catch (error) {
          this.trouble = "The " + this.sides[i] + " flight cannot be shown: " + error.message + ".";
        }
      }
      if (asked !== [this.first, this.second][i]) return;
      this.flights[i] = found;
      this.end = Math.max(1, ...this.flights.filter(Boolean).map((flight) => flight.end));
      this.$nextTick(() => {
        if (found) {
          if (!this.scenes[i]) this.scenes[i] = new Scene(this.$refs.holders[i]);
          this.scenes[i].resize();
          this.scenes[i].show(found, found.player.robots, found.player.paths, found.radii);
        }
        this.seek(0);
      });
    },
    places({ paths, step }, time) {
      return paths.map((path) => {
        const share = Math.min(time / step, path.length - 1), low = Math.floor(share), high = Math.min(low + 1, path.length - 1);
        return path[low].map((v, k) => v + (share - low) * (path[high][k] - v));
      });
    },
    seek(time) {
      this.now = Math.min(Math.max(time, 0), this.end);
      this.$refs.clock.value = this.now;
      this.$refs.clock.setAttribute("aria-valuetext", this.now.toFixed(1) + " s");
      this.$refs.time.textContent = this.now.toFixed(1) + " s";
      this.flights.forEach((flight, i) => {
        if (flight && this.scenes[i]) this.scenes[i].move(this.places(flight.player, Math.min(this.now, flight.end)), Math.min(1, this.now / flight.end));
      });
    },
    toggle() {
      this.running = !this.running;
      if (!this.running) return;
      if (this.now >= this.end - 0.01) this.seek(0);
      let last = performance.now();
      const turn = (now) => {
        if (!this.running) return;
        this.seek(this.now + Math.max(now - last, 0) / 1000);
        last = now;
        if (this.now >= this.end) this.running = false;
        else requestAnimationFrame(turn);
      };
      requestAnimationFrame(turn);
    },
  },
};
