// A text that is written with help: faults underlined where they stand, names completed, in the reader's light or dark colours.
import * as CM from "nicegui-codemirror";

const setFaults = CM.StateEffect.define();
const faultsField = CM.StateField.define({
  create: () => CM.Decoration.none,
  update(marks, change) {
    marks = marks.map(change.changes);
    for (const effect of change.effects) if (effect.is(setFaults)) marks = effect.value;
    return marks;
  },
  provide: (field) => CM.EditorView.decorations.from(field),
});

const DRAFT = "ltlplan:draft:", OF_JOB = "job-", MOST = 40; // drafts, and as many texts that jobs were made of

const colours = CM.EditorView.theme({
  "&": { color: "var(--ink)", backgroundColor: "var(--paper)", height: "100%", fontSize: "13.5px" },
  ".cm-content": { fontFamily: "ui-monospace, SFMono-Regular, Menlo, Consolas, monospace", caretColor: "var(--ink)" },
  ".cm-gutters": { backgroundColor: "var(--panel)", color: "var(--soft)", borderRight: "1px solid var(--line)" },
  ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "color-mix(in srgb, var(--panel) 70%, transparent)" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  "&.cm-focused .cm-selectionBackground, .cm-selectionBackground, ::selection": { backgroundColor: "var(--selected) !important" },
  ".cm-tooltip": { backgroundColor: "var(--panel)", color: "var(--ink)", border: "1px solid var(--line)", borderRadius: "6px" },
  ".cm-tooltip-autocomplete ul li[aria-selected]": { backgroundColor: "var(--selected)", color: "var(--ink)" },
  ".cm-completionDetail": { color: "var(--soft)", fontStyle: "normal" },
  ".cm-scroller": { overflow: "auto" },
});

export default {
  template: `<div class="editor" :class="{ line: single }"></div>`,
  props: { value: String, faults: Array, names: Object, operators: Object, language: String, single: Boolean, label: String, hint: String, owner: String, draft: String, own: Boolean },
  watch: {
    value(text) { this.setText(text); },
    faults() { this.mark(); },
    draft() { this.hold(); },
  },
  mounted() {
    const complete = (context) => this.complete(context);
    const waiting = CM.EditorView.updateListener.of((update) => {
      if (update.docChanged && !this.quiet) { this.remember(); this.changed(); }
    });
    const hover = CM.hoverTooltip((view, at) => {
      const fault = (this.placed || []).find((f) => f.from <= at && at <= f.to);
      if (!fault) return null;
      return { pos: fault.from, end: fault.to, create: () => {
        const dom = document.createElement("div");
        dom.className = "fault-words";
        dom.textContent = fault.message;
        return { dom };
      } };
    });
    const language = new CM.Compartment(), paint = new CM.Compartment();
    this.dark = window.matchMedia("(prefers-color-scheme: dark)");
    const painted = () => (this.dark.matches ? CM.syntaxHighlighting(CM.oneDarkHighlightStyle) : []);
    this.repaint = () => this.view.dispatch({ effects: paint.reconfigure(painted()) });
    this.dark.addEventListener("change", this.repaint);
    const keys = this.single ? [{ key: "Enter", run: () => { this.send(); return true; } }] : [];
    keys.push({ key: "Mod-Enter", run: () => { this.send(); this.$emit("submit"); return true; } });
    const extensions = [
      CM.Prec.high(CM.keymap.of(keys)),
      CM.basicSetup,
      CM.EditorState.languageData.of(() => [{ autocomplete: complete }]),
      CM.EditorView.contentAttributes.of({ "aria-label": this.label, spellcheck: "false", autocapitalize: "off", tabindex: "0" }),
      CM.EditorView.domEventHandlers({ blur: () => { this.send(); } }), // a button is told of what was written before it was pressed
      faultsField, hover, waiting, colours, language.of([]), paint.of(painted()),
      CM.placeholder(this.hint || ""),
    ];
    if (this.single) {
      extensions.push(CM.EditorState.transactionFilter.of((change) => (change.newDoc.lines > 1 ? [] : change)), CM.EditorView.lineWrapping);
    }
    this.view = new CM.EditorView({ doc: this.value || "", extensions, parent: this.$el });
    this.$el.editorView = this.view;
    if (this.language) {
      const found = CM.languages.find((each) => each.name === this.language);
      if (found) found.load().then((extension) => this.view.dispatch({ effects: language.reconfigure(extension) }));
    }
    this.mark();
    this.hold();
  },
  beforeUnmount() {
    clearTimeout(this.timer);
    if (this.release) this.release();
    this.dark.removeEventListener("change", this.repaint);
    this.view.destroy();
  },
  methods: {
    changed() {
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.send(), 250);
    },
    send() {
      clearTimeout(this.timer);
      this.timer = null;
      const text = this.view.state.doc.toString();
      if (text === this.sent) return;
      this.sent = text;
      this.$emit("text", text);
      this.tell();
    },
    setText(text) {
      const old = this.view.state.doc.toString();
      if (text === undefined || text === null || old === text || this.timer) return; // what is being written is newer, and told soon
      let start = 0, end = 0;
      while (start < old.length && start < text.length && old[start] === text[start]) start++;
      while (end < old.length - start && end < text.length - start && old[old.length - 1 - end] === text[text.length - 1 - end]) end++;
      this.quiet = true;
      this.view.dispatch({ changes: { from: start, to: old.length - end, insert: text.slice(start, text.length - end) } });
      this.quiet = false;
      this.sent = text;
      if (this.own) { this.remember(); this.tell(); } else this.look(text);
    },
    // Drafts: what is written here stays in this browser from key to key, under the draft's id, whatever becomes of the page.
    key(draft) { return DRAFT + (this.owner || "") + ":" + draft; },
    ids() {
      return Object.keys(localStorage).filter((key) => key.startsWith(this.key(""))).map((key) => key.slice(this.key("").length));
    },
    keep(draft, text) {
      if (!this.stored()) return;
      const entry = JSON.stringify({ text, changed: Date.now() });
      const others = this.ids().filter((id) => id !== draft).sort((a, b) => this.kept(a).changed - this.kept(b).changed);
      const alike = (id) => id.startsWith(OF_JOB) === draft.startsWith(OF_JOB);
      const spare = [...others.filter((id) => id.startsWith(OF_JOB)), ...others.filter((id) => !id.startsWith(OF_JOB))]; // what goes first, where there is no room
      const drop = (id) => localStorage.removeItem(this.key(id));
      others.filter(alike).slice(0, -(MOST - 1)).forEach(drop);
      for (;;) {
        try { localStorage.setItem(this.key(draft), entry); return; } catch { if (!spare.length) return; }
        drop(spare.shift());
      }
    },
    stored() { try { return Boolean(window.localStorage); } catch { return false; } },
    kept(draft) {
      try { return { text: "", changed: 0, ...JSON.parse(localStorage.getItem(this.key(draft))) }; } catch { return { text: "", changed: 0 }; }
    },
    remember() {
      if (!this.draft || !this.view || !this.stored()) return;
      this.keep(this.draft, this.view.state.doc.toString());
      sessionStorage.setItem(this.key(""), this.draft);
    },
    // What is shown and nobody has changed yet is no draft; only this window shows it again.
    look(text) {
      try { if (this.draft) sessionStorage.setItem(this.key("shown"), text); } catch { /* there is no room */ }
    },
    tell() {
      if (!this.draft) return;
      const { text, changed } = this.kept(this.draft);
      if (changed) this.$emit("written", { draft: this.draft, text, changed });
    },
    async drafts() {
      if (!this.stored()) return { here: null, busy: [], drafts: {} };
      const here = sessionStorage.getItem(this.key("")), mine = this.key(this.draft);
      let busy = [];
      for (let tries = 0; tries < 10; tries++) { // a window that is loaded again lets go of its draft a moment after
        busy = navigator.locks ? (await navigator.locks.query()).held.map((lock) => lock.name) : [];
        if (!here || !busy.includes(this.key(here))) break;
        await new Promise((done) => setTimeout(done, 100));
      }
      const title = (text) => (/^name:[ \t]*(.{1,60})/m.exec(text) || [0, text.trim().slice(0, 40)])[1].trim() || "without a name";
      return {
        here,
        shown: sessionStorage.getItem(this.key("shown")),
        busy: this.ids().filter((id) => busy.includes(this.key(id)) && this.key(id) !== mine),
        drafts: Object.fromEntries(this.ids().map((id) => [id, [this.kept(id).changed, title(this.kept(id).text)]])),
      };
    },
    draftText(draft) {
      const found = this.stored() ? this.kept(draft) : { changed: 0 };
      return found.changed ? found.text : null;
    },
    // A window says which draft is open in it: to itself for when it is loaded again, and to others, which open another one.
    hold() {
      if (this.release) this.release();
      if (!this.draft) return;
      const hold = { over: false, done: () => {} };
      const held = () => new Promise((done) => { if (hold.over) done(); else hold.done = done; });
      if (navigator.locks) navigator.locks.request(this.key(this.draft), { ifAvailable: true }, held);
      this.release = () => { hold.over = true; hold.done(); };
      if (!this.stored()) return;
      if (this.restored) sessionStorage.setItem(this.key(""), this.draft);
      this.restored = true;
    },
    // Offsets count characters as Python does; here they count halves of those beyond the first plane.
    unit(text, offset) {
      return Array.from(text).slice(0, offset).join("").length;
    },
    mark() {
      const text = this.view.state.doc.toString();
      const wide = /[\uD800-\uDBFF]/.test(text);
      const place = (offset) => Math.min(wide ? this.unit(text, offset) : offset, text.length);
      this.placed = (this.faults || []).map((f) => {
        const from = place(f.from), to = Math.max(place(f.to), Math.min(from + 1, text.length));
        return { ...f, from, to };
      });
      const marks = this.placed.filter((f) => f.to > f.from).map((f) =>
        CM.Decoration.mark({ class: "fault", attributes: { title: f.message } }).range(f.from, f.to));
      this.view.dispatch({ effects: setFaults.of(CM.Decoration.set(marks, true)) });
    },
    inFormula(context) {
      if (this.single) return true;
      const line = context.state.doc.lineAt(context.pos).text;
      return /^\s*(spec:\s*\{)?\s*formula:/.test(line);
    },
    complete(context) {
      if (!this.inFormula(context)) return null;
      const word = context.matchBefore(/[A-Za-z_][A-Za-z0-9_]*/);
      if (!word && !context.explicit) return null;
      const names = Object.entries(this.names || {}).map(([label, detail]) => ({ label, detail, type: "variable", boost: 1 }));
      const operators = Object.entries(this.operators || {}).map(([label, detail]) => ({ label, detail, type: "keyword" }));
      return { from: word ? word.from : context.pos, options: [...names, ...operators], validFor: /^[A-Za-z0-9_]*$/ };
    },
    reveal(from) {
      const at = Math.min(from, this.view.state.doc.length);
      this.view.dispatch({ selection: { anchor: at }, effects: CM.EditorView.scrollIntoView(at, { y: "center" }) });
      this.view.focus();
    },
  },
};
