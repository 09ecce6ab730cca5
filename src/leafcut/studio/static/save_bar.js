// Name of a user's own file, the save button, and an error.
import { h } from "vue";

export default {
  props: { field: String, name: String, words: Object, problem: String, line: Number }, // words: {name, save, rule, to_line}
  emits: ["save", "go"],
  data() { return { called: this.name }; },
  render() {
    return h("form", { class: "editor-bar", onSubmit: (e) => (e.preventDefault(), this.$emit("save", this.called.trim())) }, [
      h("label", { for: this.field }, this.words.name),
      h("span", { class: "box" }, [
        h("input", {
          id: this.field,
          type: "text",
          value: this.called,
          spellcheck: "false",
          autocomplete: "off",
          pattern: "[a-z0-9][a-z0-9_\\-]{0,60}",
          title: this.words.rule, // shown by the browser if the name does not match the pattern
          required: true,
          onInput: (e) => (this.called = e.target.value),
        }),
      ]),
      h("button", { type: "submit", class: "button primary" }, this.words.save),
      h("p", { class: ["error", "problem"], role: "status" }, this.problem
        ? [
            this.problem,
            this.line
              ? h("button", { type: "button", class: "button plain small", onClick: () => this.$emit("go") },
                  this.words.to_line.replace("{line}", this.line))
              : null,
          ]
        : []),
    ]);
  },
};
