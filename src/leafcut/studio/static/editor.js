// A TOML file in CodeMirror, which marks a line with an error; shipped files are read-only.

import { watchTheme } from "leafcut-canvas/theme.js";
import * as CM from "nicegui-codemirror";

const { Decoration, EditorState, EditorView } = CM;
const PAUSE = 400; // ms without input before the text is checked

export default {
  template: `<div class="editor"><p class="unseen" :id="about">{{ problem }}</p></div>`,
  props: { text: String, own: Boolean, label: String, line: Number, problem: String },
  emits: ["draft"],
  computed: { about() { return `editor-${this.$.uid}`; } },
  watch: {
    /** Take over the text from the form, except while the user edits it. */
    text(made) {
      if (!this.view.hasFocus && made !== this.now()) this.view.dispatch({ changes: { from: 0, to: this.view.state.doc.length, insert: made } });
    },
    line() { this.view.dispatch({}); },
    problem() { this.view.dispatch({}); },
  },
  async mounted() {
    const language = new CM.Compartment(), colours = new CM.Compartment();
    const dark = () => (getComputedStyle(document.documentElement).colorScheme === "dark" ? CM.syntaxHighlighting(CM.oneDarkHighlightStyle) : []);
    this.endTheme = watchTheme(() => this.view?.dispatch({ effects: colours.reconfigure(dark()) }));
    this.told = this.text;
    this.view = new EditorView({
      parent: this.$el,
      doc: this.text,
      extensions: [
        CM.minimalSetup, CM.lineNumbers(), language.of([]), colours.of(dark()), EditorState.readOnly.of(!this.own),
        EditorView.cspNonce.of(document.querySelector("script[nonce]")?.nonce ?? ""),
        EditorView.contentAttributes.of(() => ({
          "aria-label": this.label, tabindex: "0", spellcheck: "false", "aria-invalid": String(Boolean(this.problem)), "aria-describedby": this.about,
        })),
        EditorView.decorations.of(({ state: { doc } }) =>
          this.line > 0 && this.line <= doc.lines ? Decoration.set(Decoration.line({ class: "wrong" }).range(doc.line(this.line).from)) : Decoration.none),
        EditorView.updateListener.of((change) => { if (change.docChanged) this.type(); }),
        EditorView.domEventHandlers({ blur: () => this.tell() }),
      ],
    });
    const toml = await CM.languages.find(({ name }) => name === "TOML").load();
    this.view.dispatch({ effects: language.reconfigure(toml) });
  },
  beforeUnmount() {
    this.tell();
    this.endTheme();
    this.view.destroy();
  },
  methods: {
    now() { return this.view.state.doc.toString(); },
    type() {
      clearTimeout(this.waits);
      this.waits = setTimeout(() => this.tell(), PAUSE);
    },
    tell() {
      clearTimeout(this.waits);
      const now = this.now();
      if (this.own && now !== this.told) this.$emit("draft", { text: (this.told = now) });
    },
    /** Select the marked line and scroll to it. */
    go() {
      const { from, to } = this.view.state.doc.line(this.line);
      this.view.dispatch({ selection: { anchor: from, head: to }, effects: EditorView.scrollIntoView(from, { y: "center" }) });
      this.view.focus();
    },
  },
};
