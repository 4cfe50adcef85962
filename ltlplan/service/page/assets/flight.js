// A flight that is watched, trusted or judged: one scene, one clock, and beside them what is seen at that time.
import { RING_WORDS, Scene } from "ltlplan_scene";

const SPEEDS = [0.25, 0.5, 1, 2, 5, 10];

function at(rows, time) {
  let found = 0;
  for (let i = 0; i < rows.length; i++) if (rows[i][0] <= time + 1e-9) found = i;
  return found;
}

export default {
  template: `
<div class="flight" :data-view="view" :data-ready="data ? 'yes' : 'no'">
  <p v-if="trouble" class="warning" role="alert">{{ trouble }}</p>
  <p v-if="!data && !trouble && view === 'watch'" class="soft empty">No flight to watch here: choose a job under Plan that has one.
    <span class="row"><a class="button" href="/plan">Choose a job</a> <a class="button" href="/">Write a mission</a></span></p>
  <div class="theatre" :class="{ alone: !beside }" v-show="data">
    <div class="stage3d">
      <div class="holder" ref="holder" role="group" :aria-label="'Moving 3-D picture of ' + (data ? data.mission : 'the flight')"></div>
      <div class="player">
        <button type="button" class="play" @click="toggle" :aria-label="running ? 'Pause' : 'Play'">{{ running ? "Pause" : "Play" }}</button>
        <input class="clock" ref="clock" type="range" min="0" step="0.01" :max="end" value="0" aria-label="Mission time in seconds" @input="seek(Number($event.target.value))">
        <output class="time" ref="time">0.0 s</output>
        <label>speed <select class="speed" v-model.number="speed" aria-label="Speed"><option v-for="s in speeds" :value="s">{{ s }}x</option></select></label>
        <button type="button" class="quiet" @click="all" title="See the whole workspace (0)">whole</button>
      </div>
      <ul class="robots" v-if="data">
        <li v-for="(name, i) in data.player.robots">
          <button type="button" :aria-pressed="!hidden[name]" :class="{ off: hidden[name] }" @click="hide(name)" :title="'Show or hide ' + name">
            <i :style="{ background: data.colours[i] }"></i>{{ name }}</button>
          <span class="task">{{ data.tasks[name] }}</span>
        </li>
      </ul>
      <p class="keys">Space plays, arrows step, + and - change the speed. Drag turns the picture, scrolling zooms; with the focus on it (Tab) arrows, + and - do the same, 0 shows all.</p>
      <p class="ring-words">{{ ringWords }}</p>
    </div>
    <aside class="side" v-if="data" v-show="beside">
      <div v-show="view === 'watch'" class="now">
        <h2>Now</h2>
        <dl class="letters">
          <template v-for="(name, i) in data.player.robots">
            <dt><i :style="{ background: data.colours[i] }"></i>{{ name }}</dt><dd class="letter">{{ letter(i) }}</dd>
          </template>
        </dl>
        <h2>Still to do</h2>
        <ul class="todo">
          <li v-for="part in todo"><code v-if="part[0]">{{ part[0] }}</code> <b :class="part[1].split(' ')[0]">{{ part[1] }}</b></li>
        </ul>
        <h2 v-if="data.automata.length">Automaton</h2>
        <div class="automata" ref="automata">
          <figure v-for="part in data.automata">
            <figcaption><code>{{ part.part }}</code></figcaption>
            <div v-if="part.svg" class="drawing" :data-svg="part.svg"></div>
            <p v-else class="note">{{ part.note }}</p>
          </figure>
        </div>
      </div>
      <div v-show="view !== 'watch'" class="trust">
        <template v-if="shownClaims.length">
          <h2>{{ view === 'judge' ? 'What the recording shows' : 'Claims' }}</h2>
          <p v-if="view === 'judge' && verdict" class="file">Of <b>{{ verdict.file }}</b></p>
          <p class="verdict" :class="good ? 'holds' : 'fails'">{{ said }}</p>
          <div v-if="view === 'judge' && verdict" class="assumed">
            <h3>Said by you</h3>
            <ul><li v-for="each in verdict.said">{{ each }}</li><li v-if="!verdict.said.length">nothing</li></ul>
            <template v-if="verdict.assumptions.length"><h3>Assumed</h3><ul><li v-for="each in verdict.assumptions">{{ each }}</li></ul></template>
          </div>
          <ol class="claims" aria-label="Claims">
            <li v-for="claim in listed" :key="claim.key">
              <button type="button" class="claim" :class="[claim.outcome, { chosen: chosen === claim.key }]" :aria-expanded="chosen === claim.key" @click="choose(claim)">
                <span class="mark" :title="claim.outcome">{{ signs[claim.outcome] }}</span>
                <span class="what">{{ claim.name }} <small>{{ claim.who }}</small> <small v-if="claim.proof" class="proof" :class="{ checked: claim.proof === 'checked' }">{{ claim.proof }}</small></span>
                <span class="figures">{{ claim.row[3] }}<small v-if="claim.row[4]">limit {{ claim.row[4] }}</small></span>
                <span class="room" :title="claim.room === null ? '' : 'room to its limit: ' + Math.round(100 * claim.room) + ' %'"><i v-if="claim.room !== null" :style="{ width: share(claim.room) }" :class="{ little: claim.room < 0.15 }"></i></span>
              </button>
              <p class="sentence" v-if="chosen === claim.key">{{ claim.sentence }}
                <span v-if="claim.time !== null"> Tightest at {{ claim.time.toFixed(2) }} s.</span>
                <span v-if="claim.proof === 'checked'"> Checked by the kernel.</span>
                <span v-else-if="claim.missing"> Not checked by the kernel: {{ claim.missing }}.</span></p>
              <div class="counterexample" v-if="chosen === claim.key && word(claim).length">
                <p>A flight within the margin can be read so:</p>
                <ol><li v-for="letter in word(claim)" :class="{ now: letter.from <= now && now <= letter.until }">
                  <button type="button" class="quiet" @click="seek(letter.from)">{{ letter.from.toFixed(2) }} to {{ letter.until.toFixed(2) }} s</button>
                  {{ letter.robot }} <code>{{ letter.text }}</code></li></ol>
                <button type="button" class="play-word" @click="playWord(claim)">Play the counterexample</button>
              </div>
            </li>
          </ol>
          <button type="button" class="quiet" @click="every = !every" v-if="every || listed.length < shownClaims.length">
            {{ every ? "Only the tightest of each kind" : "All " + shownClaims.length + " claims" }}</button>
          <div class="kernel" v-if="view === 'trust' && data.proof">
            <h2>Proof</h2>
            <p v-for="sentence in data.proof">{{ sentence }}</p>
            <p v-if="good">Check it yourself, with nothing but Python: <code>python check.pyz FOLDER</code>
              (<a :href="ofJob('proof')" download>all of it</a>:
              <template v-for="(name, i) in ['statement.json', 'proof.json', 'check.pyz']"><template v-if="i">, </template><a :href="ofJob('files/' + name)" download>{{ name }}</a></template>
              and the trajectories).</p>
          </div>
        </template>
      </div>
    </aside>
  </div>
  <div class="below playing" ref="below" v-show="data && view === 'watch'">
    <h2>Labels over time</h2>
    <p class="note">Dark: the robot is in the region for sure, wherever it is within the margin. Light: it may be in it. Grey: what the robot's internal state shows, wherever it is.{{ data ? data.bounds : '' }} Click to go there.</p>
    <div ref="labels"></div>
    <template v-if="data && data.truth"><h2>Sub-formulas over time</h2><div ref="truth"></div></template>
  </div>
</div>`,
  props: { url: String, view: { type: String, default: "watch" }, verdict: Object },
  data: () => ({
    data: null, trouble: "", ringWords: RING_WORDS, running: false, speed: 1, speeds: SPEEDS, end: 1, letters: [], todoAt: 0, hidden: {}, chosen: "", every: false, now: 0,
    signs: { holds: "✓", fails: "✗", undecided: "?" },
  }),
  computed: {
    todo() { return this.data && this.data.player.todo.length ? this.data.player.todo[this.todoAt][1] : []; },
    shownClaims() {
      const claims = this.view === "judge" ? (this.verdict ? this.verdict.claims : []) : this.data ? this.data.claims : [];
      return claims.map((claim, i) => ({ ...claim, key: this.view + i, who: [claim.robot, claim.other].filter(Boolean).join(", ") || "team" }));
    },
    listed() {
      const order = { fails: 0, undecided: 1, holds: 2 };
      const room = (claim) => (claim.room === null ? Infinity : claim.room);
      const claims = [...this.shownClaims].sort((a, b) => order[a.outcome] - order[b.outcome]);
      if (this.every) return claims;
      const kinds = new Map();
      for (const claim of claims) {
        const best = kinds.get(claim.name);
        if (claim.outcome !== "holds" || !best || (best.outcome === "holds" && room(claim) < room(best))) {
          if (claim.outcome !== "holds") kinds.set(claim.key, claim);
          else kinds.set(claim.name, claim);
        }
      }
      return [...kinds.values()];
    },
    beside() { return this.view !== "judge" || Boolean(this.verdict); },
    good() { return this.shownClaims.every((claim) => claim.outcome === "holds"); },
    said() {
      if (this.view === "judge") return this.verdict ? this.verdict.sentence : "";
      const count = this.shownClaims.length, bad = this.shownClaims.filter((claim) => claim.outcome !== "holds").length;
      const margin = Number((1000 * this.data.margin).toPrecision(4));
      const most = this.data.largest_margin === null ? "" : " " + (1000 * this.data.largest_margin).toFixed(1) + " mm would hold too.";
      return bad ? bad + " of " + count + " claims are not proved at a margin of " + margin + " mm." :
        "All " + count + " claims hold at all times, for every flight within " + margin + " mm." + most;
    },
  },
  watch: {
    url() { this.load(); },
    verdict() { this.drawFlown(); },
    view() {
      this.stop();
      if (this.chosen && this.scene3d) this.all();
      this.unmark();
      this.$nextTick(() => this.scene3d && this.scene3d.resize());
    },
  },
  mounted() {
    this.scene3d = null;
    this.onKey = (event) => this.key(event);
    window.addEventListener("keydown", this.onKey);
    this.load();
  },
  beforeUnmount() {
    this.stop();
    window.removeEventListener("keydown", this.onKey);
    if (this.scene3d) this.scene3d.dispose();
  },
  methods: {
    ofJob(what) { return this.url.replace(/files\/watch\.json$/, what); },
    async load() {
      this.stop();
      const asked = this.url;
      if (!asked) { this.data = null; this.trouble = ""; return; }
      try {
        const answer = await fetch(asked, { credentials: "same-origin" });
        if (!answer.ok) throw new Error("the service answered " + answer.status);
        const found = await answer.json();
        if (asked !== this.url) return;
        this.trouble = "";
        this.put(found);
      } catch (error) {
        this.data = null;
        this.trouble = "The flight cannot be shown: " + error.message + ".";
      }
    },
    put(found) {
      this.data = Object.freeze(found);
      this.end = Math.ceil(100 * found.end - 1e-6) / 100;
      this.hidden = {};
      this.chosen = "";
      this.letters = found.player.robots.map(() => 0);
      this.todoAt = 0;
      this.$nextTick(() => {
        if (!this.scene3d) this.scene3d = new Scene(this.$refs.holder);
        this.scene3d.show(found, found.player.robots, found.player.paths, found.radii);
        this.$refs.labels.setHTML(found.labels);
        if (this.$refs.truth) this.$refs.truth.setHTML(found.truth);
        for (const place of this.$el.querySelectorAll(".drawing")) place.setHTML(place.dataset.svg);
        for (const track of this.$refs.below.querySelectorAll(".track")) {
          track.addEventListener("click", (event) => {
            const box = track.getBoundingClientRect();
            this.seek(((event.clientX - box.left) / box.width) * this.end);
          });
        }
        this.drawFlown();
        this.seek(0);
      });
    },
    letter(i) {
      const rows = this.data.player.letters[i];
      return rows.length ? rows[this.letters[i]][1] : "";
    },
    places(time) {
      const { paths, step } = this.data.player;
      return paths.map((path) => {
        const share = Math.min(time / step, path.length - 1), low = Math.floor(share), high = Math.min(low + 1, path.length - 1);
        return path[low].map((v, k) => v + (share - low) * (path[high][k] - v));
      });
    },
    seek(time) {
      if (!this.data) return;
      time = Math.min(Math.max(time, 0), this.end);
      this.now = time;
      this.$refs.clock.value = time;
      this.$refs.clock.setAttribute("aria-valuetext", time.toFixed(1) + " s");
      this.$refs.time.textContent = time.toFixed(1) + " s";
      this.$el.style.setProperty("--now", String(time / this.end));
      if (this.scene3d && this.scene3d.robots) this.scene3d.move(this.places(time), time / this.data.end);
      this.data.player.letters.forEach((rows, i) => {
        const found = at(rows, time);
        if (found !== this.letters[i]) this.letters[i] = found;
      });
      this.todoAt = at(this.data.player.todo, time);
      this.data.automata.forEach((part, i) => {
        if (!part.svg || !part.states.length) return;
        const states = part.states[at(part.states, time)][1].map(String);
        const figure = this.$refs.automata.children[i];
        figure.classList.toggle("lost", !states.length);
        for (const node of figure.querySelectorAll(".node")) node.classList.toggle("here", states.includes(node.dataset.state));
      });
    },
    toggle() {
      if (this.running) { this.stop(); return; }
      this.until = null;
      this.play();
    },
    play() {
      if (!this.data) return;
      if (this.now >= this.end - 0.01) this.seek(0);
      this.running = true;
      let last = performance.now();
      const turn = (this.turn = (now) => {
        if (!this.running || this.turn !== turn) return;
        const next = this.now + (Math.max(now - last, 0) / 1000) * this.speed, stop = this.until ?? this.end;
        last = now;
        this.seek(Math.min(next, stop));
        if (next >= stop) this.stop();
        else requestAnimationFrame(turn);
      });
      requestAnimationFrame(turn);
    },
    stop() { this.running = false; this.turn = null; },
    all() { if (this.scene3d) { this.scene3d.lookAtAll(); this.scene3d.draw(); } },
    hide(name) {
      this.hidden[name] = !this.hidden[name];
      this.scene3d.toggle(name, !this.hidden[name]);
    },
    faster(step) {
      const place = SPEEDS.indexOf(this.speed) + step;
      this.speed = SPEEDS[Math.min(Math.max(place, 0), SPEEDS.length - 1)];
    },
    key(event) {
      if (!this.data || !this.$el.offsetParent || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.target.closest("input:not([type=range]), textarea, select, .cm-editor, [contenteditable=true], [role=dialog]")) return;
      if (event.key === " " && event.target.closest("button, summary, a") && !event.target.closest(".play, [role=tab]")) return;
      const step = event.shiftKey ? 2 : 0.25;
      const does = {
        " ": () => this.toggle(), ArrowRight: () => this.seek(this.now + step), ArrowLeft: () => this.seek(this.now - step),
        Home: () => this.seek(0), End: () => this.seek(this.end), "+": () => this.faster(1), "=": () => this.faster(1), "-": () => this.faster(-1),
        0: () => this.all(),
      }[event.key];
      if (!does || (event.target.closest("[role=tab]") && event.key.startsWith("Arrow"))) return;
      event.preventDefault();
      does();
    },
    share(room) { return Math.min(Math.max(100 * room, 0), 100) + "%"; },
    unmark() { this.chosen = ""; if (this.scene3d && this.scene3d.marks) this.scene3d.mark([], ""); },
    choose(claim) {
      this.stop();
      if (this.chosen === claim.key) { this.unmark(); return; }
      this.chosen = claim.key;
      if (claim.time === null) { this.scene3d.mark([], ""); return; }
      this.seek(claim.time);
      const places = this.places(this.now), names = this.data.player.robots;
      const shown = (claim.robot ? [claim.robot, claim.other].filter(Boolean) : []).map((name) => places[names.indexOf(name)]).filter(Boolean);
      if (!shown.length || !this.scene3d.renderer) return;
      this.scene3d.mark(shown, claim.name + " " + claim.row[3] + (claim.row[4] ? ", limit " + claim.row[4] : ""));
      this.scene3d.glideTo(shown.reduce((a, b) => a.map((v, k) => v + b[k])).map((v) => v / shown.length));
    },
    word(claim) {
      if (!claim.witness || !claim.witness.word || !claim.witness.times) return [];
      return claim.witness.word.map(([robot, letter], i) => {
        const [from, until] = claim.witness.times[i] || [0, 0];
        return { robot, text: "{" + letter.join(", ") + "}", from: from ?? 0, until: until ?? this.end };
      });
    },
    playWord(claim) {
      const letters = this.word(claim);
      this.seek(Math.max(0, letters[0].from - 0.2));
      this.until = Math.min(this.end, letters[letters.length - 1].from + 0.5);
      this.play();
    },
    drawFlown() {
      if (!this.scene3d || !this.scene3d.added || !this.data) return;
      const flown = this.verdict ? this.verdict.flown : {};
      this.scene3d.addDots(this.data.player.robots.flatMap((name, i) => (flown[name] ? [{ colour: this.data.colours[i], path: flown[name] }] : [])));
    },
  },
};
