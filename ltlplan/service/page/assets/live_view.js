// A flight in the air, or one that is replayed: the scene, the same from above, and beside them how near each robot is to its margin.
import { LEVELS, Line } from "ltlplan_feed";
import { RING_WORDS, Scene } from "ltlplan_scene";

const STATES = { "to do": "to do", kept: "holds so far", done: "done", broken: "broken" };
const SAID = 12;

function minutes(seconds) {
  return Math.floor(seconds / 60) + ":" + String(Math.floor(seconds % 60)).padStart(2, "0");
}

export default {
  template: `
<div class="live" :data-ready="picture ? 'yes' : 'no'" :class="{ quiet: quiet && !replayed && !(frame && frame.over) }">
  <p class="line-state" role="status" :class="{ bad: quiet && frame && !frame.over && !replayed }">{{ lineState }}</p>
  <div class="theatre" v-show="picture || flight">
    <div class="stage3d">
      <div class="live-scenes">
        <figure><div class="holder" ref="holder" role="group" :aria-label="'Scene of ' + name"></div><figcaption>Scene</figcaption></figure>
        <figure><div class="holder" ref="above" role="group" :aria-label="name + ' from above'"></div>
          <figcaption>From above{{ drags ? "; drag a region or an obstacle to move it" : "" }}</figcaption></figure>
      </div>
      <div class="player" v-if="replayed">
        <button type="button" class="play" @click="toggle">{{ running ? "Pause" : "Play" }}</button>
        <input class="clock" type="range" min="0" :max="replayed.frames.length - 1" step="1" :value="at" aria-label="Time of the replay" :aria-valuetext="clock" @input="seek(Number($event.target.value))">
        <output class="time">{{ clock }}</output>
        <label>speed <select v-model.number="speed" aria-label="Speed"><option v-for="s in [0.5, 1, 2, 5]" :value="s">{{ s }}x</option></select></label>
      </div>
      <p class="ring-words">{{ ringWords }}</p>
      <div class="row"><label>camera follows <select v-model="followed" class="follow"><option value="">nobody</option><option v-for="robot in robots" :value="robot.name">{{ robot.name }}</option></select></label>
        <button type="button" class="quiet" @click="all">whole</button></div>
      <div class="scroll" tabindex="0" role="group" aria-label="Robots"><table class="live-robots"><thead><tr><th>robot</th><th>from its plan</th><th>margin left</th><th>battery</th><th>pose</th><th>state</th></tr></thead>
        <tbody><tr v-for="robot in robots" :key="robot.name">
          <th scope="row"><i :style="{ background: robot.colour }"></i>{{ robot.name }}</th>
          <td><span v-if="robot.off !== null" class="bar" role="meter" :aria-label="robot.name + ' from its plan'" aria-valuemin="0" :aria-valuemax="mm(frame.margin)" :aria-valuenow="mm(robot.off)"><i :style="{ width: share(robot.off) }" :class="{ little: robot.off > 0.7 * frame.margin }"></i></span>
            {{ robot.off === null ? "" : mm(robot.off) + " mm" }}</td>
          <td><span v-if="robot.left !== null" class="bar" role="meter" :aria-label="'margin left of ' + robot.name" aria-valuemin="0" :aria-valuemax="mm(frame.margin)" :aria-valuenow="mm(robot.left)"><i :style="{ width: share(robot.left) }" :class="{ little: robot.left < 0.3 * frame.margin }"></i></span>
            {{ robot.left === null ? "" : mm(robot.left) + " mm" }}</td>
          <td>{{ robot.battery === null ? "not told" : minutes(robot.battery) }}</td>
          <td :class="{ bad: robot.old > 0.15 }">{{ robot.old === null ? "not seen" : robot.old.toFixed(2) + " s old" }}</td>
          <td>{{ robot.fault || levels[robot.acknowledged] || (frame.ending || robot.age === null ? "" : "flies") }}</td>
        </tr></tbody></table></div>
    </div>
    <aside class="side">
      <h2>{{ frame && frame.stage ? frame.stage : "Before take-off" }}</h2>
      <p v-if="frame && frame.stage">{{ frame.ending ? "ended: all hold or land" : frame.into.toFixed(1) + " s of " + frame.lasts.toFixed(1) + " s" }}</p>
      <progress v-if="frame && frame.stage && !frame.ending" :value="frame.into" :max="frame.lasts || 1" aria-label="Share of this stage"></progress>
      <h2>Formula</h2>
      <ul class="todo"><li v-for="part in frame ? frame.parts : []"><code>{{ part[0] }}</code> <b :class="part[1].replace(' ', '-')">{{ states[part[1]] || part[1] }}</b></li></ul>
      <p v-if="!frame || !frame.parts.length" class="soft">Nothing is asked of what is flown now.</p>
      <h2>Next</h2>
      <ul class="next"><li v-for="entry in next">in {{ entry[0].toFixed(1) }} s: {{ entry[1] }} in {{ entry[2] }}</li></ul>
      <p v-if="!next.length" class="soft">No entry into a region is planned.</p>
      <h2 v-if="said.length">Said</h2>
      <ol class="said"><li v-for="each in said">{{ each.sentence }}</li></ol>
    </aside>
  </div>
</div>`,
  props: { flight: String, run: Number, replay: String, drags: Boolean },
  data: () => ({
    picture: null, frame: null, quiet: true, silent: 0, said: [], followed: "", robots: [], next: [], state: null,
    replayed: null, at: 0, running: false, speed: 1, levels: LEVELS, states: STATES, ringWords: RING_WORDS, trouble: "",
  }),
  computed: {
    name() { return this.flight || "the flight"; },
    clock() { return this.replayed ? (this.replayed.frames[this.at].sent - this.replayed.frames[0].sent).toFixed(1) + " s" : ""; },
    lineState() {
      if (this.trouble) return this.trouble;
      if (this.replay) return this.replayed ? "Replay" : "The recording is read.";
      if (!this.frame) return this.flight ? "No frame yet: its program sends them, run with --follow." : "";
      if (this.frame.over) return this.flight + " is over.";
      if (this.quiet) return "No frame for " + this.silent.toFixed(0) + " s: the flight, its line or the service is down. What is shown is old.";
      return this.frame.stage ? "Seen live." : "Connected; the flight has not begun.";
    },
  },
  watch: {
    flight() { this.begin(); },
    replay() { this.begin(); },
    followed() { this.pictures.forEach((scene) => scene.follow(this.followed)); },
    drags() { this.put(); },
  },
  mounted() {
    this.pictures = [];
    this.looker = { state: (state) => { this.state = state; }, picture: (picture) => this.put(picture), frame: (frame) => this.show(frame) };
    this.ticking = setInterval(() => { if (this.line) { this.quiet = this.line.quiet; this.silent = this.line.silent; } }, 250);
    this.begin();
  },
  beforeUnmount() {
    clearInterval(this.ticking);
    this.running = false;
    this.line?.leave(this.looker);
    this.pictures.forEach((scene) => scene.dispose());
  },
  methods: {
    minutes,
    mm(metres) { return Math.round(1000 * metres); },
    share(metres) { return Math.min(Math.max((100 * metres) / (this.frame.margin || 1), 0), 100) + "%"; },
    begin() {
      this.line?.leave(this.looker);
      this.line = this.replayed = null;
      if (!this.replay) this.clear(); // else it stays until the recording has come
      this.running = false;
      this.trouble = "";
      this.said = [];
      if (this.replay) this.load();
      else if (this.flight) { this.line = Line.of(this.flight); this.line.look(this.looker); }
    },
    clear() { Object.assign(this, { picture: null, frame: null, robots: [], next: [] }); },
    async load() {
      const asked = this.replay;
      try {
        const answer = await fetch(asked, { credentials: "same-origin", headers: { accept: "application/json" } });
        const found = await answer.json();
        if (asked !== this.replay) return;
        if (!answer.ok) throw new Error(found.detail);
        this.replayed = Object.freeze(found);
        this.seek(0);
      } catch (error) { this.clear(); this.trouble = "It cannot be replayed: " + error.message; }
    },
    put(picture) {
      this.picture = Object.freeze(picture || this.picture);
      if (!this.picture) return;
      this.$nextTick(() => {
        if (!this.$refs.holder) return;
        if (!this.pictures.length) {
          this.pictures = [new Scene(this.$refs.holder), new Scene(this.$refs.above)];
          this.pictures[1].lookFromAbove();
        }
        const { robots, tracks, radii, margin } = this.picture;
        const paths = robots.map((name) => tracks[name]?.points);
        for (const scene of this.pictures) {
          scene.show(this.picture, robots, paths, radii);
          scene.addTubes(robots, paths, margin);
          scene.follow(this.followed);
        }
        if (this.drags) this.pictures[1].dragBodies(this.picture.bodies, (name, place) => this.$emit("moved", { name, place }));
        if (this.frame) this.move(this.frame);
      });
    },
    show(frame) {
      this.frame = Object.freeze(frame);
      this.quiet = false;
      const said = this.line ? this.line.said : this.saidUntil(this.at);
      this.said = said.filter((each) => each.kind !== "check").slice(-SAID).reverse();
      const known = this.picture ? this.picture.robots : [], colours = this.picture ? this.picture.colours : [];
      const unseen = { at: null, off: null, left: null, battery: null, age: null, fault: "", acknowledged: null };
      const robots = { ...Object.fromEntries(known.map((name) => [name, unseen])), ...frame.robots };
      this.robots = Object.entries(robots).map(([name, robot]) => ({
        ...robot, name, colour: colours[known.indexOf(name)] || "gray", old: robot.age === null ? null : robot.age + frame.stale,
      }));
      const planned = this.picture && this.picture.number === frame.picture && !frame.ending ? this.picture.planned : [];
      this.next = planned.filter((entry) => entry[0] > frame.begun).slice(0, 3).map(([time, ...rest]) => [time - frame.begun, ...rest]);
      if (this.picture) this.move(frame);
    },
    move(frame) {
      const { robots, tracks, number } = this.picture;
      const places = robots.map((name) => frame.robots[name]?.at || null);
      const samples = robots.map((name) => (tracks[name] && number === frame.picture ? frame.begun / tracks[name].step : 0));
      this.pictures.forEach((scene) => scene.move(places, samples, true));
    },
    all() { this.followed = ""; this.pictures.forEach((scene) => { scene.lookAtAll(); scene.draw(); }); },
    saidUntil(at) { return this.replayed.frames.slice(Math.max(0, at - 600), at + 1).flatMap((frame) => frame.said); },
    seek(at) {
      this.at = at;
      const frame = this.replayed.frames[at];
      const picture = this.replayed.pictures.find((each) => each.number === frame.picture) || this.replayed.pictures[0];
      if (picture && picture !== this.shownPicture) { this.shownPicture = picture; this.put(picture); }
      this.show(frame);
    },
    toggle() {
      this.running = !this.running;
      if (!this.running) return;
      const { frames } = this.replayed;
      if (this.at >= frames.length - 1) this.seek(0);
      let last = performance.now(), time = frames[this.at].sent;
      const turn = (now) => {
        if (!this.running || !this.replayed) return;
        time += (Math.max(now - last, 0) / 1000) * this.speed;
        last = now;
        let at = this.at;
        while (at + 1 < frames.length && frames[at + 1].sent <= time) at++;
        if (at !== this.at) this.seek(at);
        if (at >= frames.length - 1) this.running = false;
        else requestAnimationFrame(turn);
      };
      requestAnimationFrame(turn);
    },
  },
};
