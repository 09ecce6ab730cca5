// A text that can be changed and kept under a name; what is shipped can be looked at only.
import { h } from "vue";

export default {
  props: { text: String, name: String, own: Boolean, words: Object, label: String },
  emits: ["save", "draft"],
  data() {
    return { now: this.text, called: this.name };
  },
  methods: {
    save() {
      this.$emit("save", { name: this.called.trim(), text: this.now });
    },
  },
  render() {
    const lines = this.now.split("\n").length + 1;
    return h("form", { class: "editor", onSubmit: (e) => (e.preventDefault(), this.save()) }, [
      this.own
        ? h("div", { class: "editor-bar" }, [
            h("label", { for: "editor-name" }, this.words.name),
            h("span", { class: "box" }, [
              h("input", {
                id: "editor-name",
                type: "text",
                value: this.called,
                spellcheck: "false",
                autocomplete: "off",
                pattern: "[a-z0-9][a-z0-9_\\-]{0,60}",
                title: this.words.rule, // a browser tells it where the pattern does not fit
                required: true,
                onInput: (e) => (this.called = e.target.value),
              }),
            ]),
            h("button", { type: "submit", class: "button primary" }, this.words.save),
          ])
        : null,
      h("textarea", {
        value: this.now,
        readonly: !this.own,
        rows: Math.min(lines, 40),
        spellcheck: "false",
        "aria-label": this.label,
        onInput: (e) => (this.now = e.target.value),
        onChange: (e) => this.own && this.$emit("draft", { text: e.target.value }),
      }),
    ]);
  },
};
