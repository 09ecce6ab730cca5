// Name of a user's own file, the save button, and an error.
import { defineComponent, h, ref } from "vue";

export default defineComponent({
  props: {
    field: { type: String, required: true },
    name: { type: String, default: "" },
    words: { type: /** @type {Prop<Words>} */ (Object), required: true }, // name, save, rule, to_line
    problem: String,
    line: Number,
  },
  emits: ["save", "go"],
  setup(props, { emit }) {
    const called = ref(props.name);
    const save = (/** @type {Event} */ event) => {
      event.preventDefault();
      emit("save", called.value.trim());
    };
    return () => {
      const { words, problem, line } = props;
      const go = line
        ? h("button", { type: "button", class: "button plain small", onClick: () => emit("go") }, words.to_line.replace("{line}", String(line)))
        : null;
      return h("form", { class: "editor-bar", onSubmit: save }, [
        h("label", { for: props.field }, words.name),
        h("span", { class: "box" }, [
          h("input", {
            id: props.field,
            type: "text",
            value: called.value,
            spellcheck: "false",
            autocomplete: "off",
            pattern: "[a-z0-9][a-z0-9_\\-]{0,60}",
            title: words.rule, // shown by the browser if the name does not match the pattern
            required: true,
            onInput: (/** @type {FieldEvent} */ { target }) => { called.value = target.value; },
          }),
        ]),
        h("button", { type: "submit", class: "button primary" }, words.save),
        h("p", { class: ["error", "problem"], role: "status" }, problem ? [problem, go] : []),
      ]);
    };
  },
});
