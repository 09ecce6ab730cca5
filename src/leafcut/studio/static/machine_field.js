// A text field that keeps its content when the page is redrawn; a new `version` replaces the content.
import { h } from "vue";

export default {
  props: { field: String, value: String, version: Number, unit: String, numbers: Boolean, offered: String, placeholder: String },
  emits: ["typed"],
  data() { return { draft: this.value }; },
  watch: { version() { this.draft = this.value; } },
  render() {
    return h("span", { class: "box" }, [
      h("input", {
        id: this.field, type: "text", autocomplete: "off", spellcheck: "false", inputmode: this.numbers ? "decimal" : "text",
        list: this.offered || null, placeholder: this.placeholder || null, value: this.draft,
        onInput: (e) => { this.draft = e.target.value; this.$emit("typed", { value: this.draft }); },
      }),
      this.unit ? h("span", { class: "unit", "aria-hidden": "true" }, this.unit) : null,
    ]);
  },
};
