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
  props: { value: String, faults: Array, names: Object, operators: Object, language: String, single: Boolean, label: String, hint: String },
  watch: {
    value(text) { this.setText(text); },
    faults() { this.mark(); },
  },
  mounted() {
    const complete = (context) => this.complete(context);
    const waiting = CM.EditorView.updateListener.of((update) => {
      if (update.docChanged && !this.quiet) this.changed();
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
      CM.EditorView.contentAttributes.of({ "aria-label": this.label, spellcheck: "false", autocapitalize: "off" }),
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
  },
  beforeUnmount() {
    clearTimeout(this.timer);
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
      const text = this.view.state.doc.toString();
      if (text === this.sent) return;
      this.sent = text;
      this.$emit("text", text);
    },
    setText(text) {
      const old = this.view.state.doc.toString();
      if (text === undefined || text === null || old === text) return;
      let start = 0, end = 0;
      while (start < old.length && start < text.length && old[start] === text[start]) start++;
      while (end < old.length - start && end < text.length - start && old[old.length - 1 - end] === text[text.length - 1 - end]) end++;
      this.quiet = true;
      this.view.dispatch({ changes: { from: start, to: old.length - end, insert: text.slice(start, text.length - end) } });
      this.quiet = false;
      this.sent = text;
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
