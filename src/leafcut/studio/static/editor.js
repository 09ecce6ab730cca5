// A TOML file in CodeMirror, which marks a line with an error; shipped files are read-only.

import { styleNonce } from "leafcut-canvas/icons.js";
import { watchTheme } from "leafcut-canvas/theme.js";
import * as CM from "nicegui-codemirror";
import { defineComponent, getCurrentInstance, h, onBeforeUnmount, onMounted, ref, watch } from "vue";

const { Decoration, EditorState, EditorView } = CM;
const PAUSE = 400; // ms without input before the text is checked

export default defineComponent({
  props: {
    text: { type: String, default: "" },
    own: Boolean,
    label: { type: String, default: "" },
    line: { type: Number, default: 0 },
    problem: String,
  },
  emits: ["draft"],
  setup(props, { emit, expose }) {
    const host = /** @type {import("vue").Ref<HTMLElement>} */ (ref()), about = `editor-${getCurrentInstance()?.uid}`;
    const language = new CM.Compartment(), colours = new CM.Compartment();
    /** @type {CM.EditorView} */
    let view;
    /** @type {() => void} */
    let endTheme;
    let reported = props.text, pause = 0;

    const now = () => view.state.doc.toString();
    const dark = () => (getComputedStyle(document.documentElement).colorScheme === "dark" ? CM.syntaxHighlighting(CM.oneDarkHighlightStyle) : []);

    function report() {
      clearTimeout(pause);
      const text = now();
      if (props.own && text !== reported) emit("draft", { text: (reported = text) });
    }

    function typed() {
      clearTimeout(pause);
      pause = setTimeout(report, PAUSE);
    }

    onMounted(async () => {
      endTheme = watchTheme(() => view.dispatch({ effects: colours.reconfigure(dark()) }));
      view = new EditorView({
        parent: host.value,
        doc: props.text,
        extensions: [
          CM.minimalSetup, CM.lineNumbers(), language.of([]), colours.of(dark()), EditorState.readOnly.of(!props.own),
          EditorView.cspNonce.of(styleNonce()),
          EditorView.contentAttributes.of(() => ({
            "aria-label": props.label, tabindex: "0", spellcheck: "false", "aria-invalid": String(Boolean(props.problem)), "aria-describedby": about,
          })),
          EditorView.decorations.of(({ state: { doc } }) =>
            props.line > 0 && props.line <= doc.lines ? Decoration.set(Decoration.line({ class: "wrong" }).range(doc.line(props.line).from)) : Decoration.none),
          EditorView.updateListener.of((change) => { if (change.docChanged) typed(); }),
          EditorView.domEventHandlers({ blur: report }),
        ],
      });
      const toml = await CM.languages.find(({ name }) => name === "TOML")?.load();
      if (toml) view.dispatch({ effects: language.reconfigure(toml) });
    });
    onBeforeUnmount(() => {
      report();
      endTheme();
      view.destroy();
    });

    /** Take over the text from the form, except while the user edits it. */
    watch(() => props.text, (text) => {
      if (!view.hasFocus && text !== now()) view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: text } });
    });
    watch(() => [props.line, props.problem], () => view.dispatch({}));

    expose({
      /** Select the marked line and scroll to it. */
      go: () => {
        const { from, to } = view.state.doc.line(props.line);
        view.dispatch({ selection: { anchor: from, head: to }, effects: EditorView.scrollIntoView(from, { y: "center" }) });
        view.focus();
      },
    });
    return () => h("div", { class: "editor", ref: host }, [h("p", { class: "unseen", id: about }, props.problem)]);
  },
});
