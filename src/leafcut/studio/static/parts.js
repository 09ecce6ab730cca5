// Table of a nest's parts: a row for each drawing with quantity and angles.
import { h } from "vue";

export default {
  props: {
    rows: Array, // [{id, name, quantity, rotations, shown}]
    rotations: String, // default angles
    version: Number, // increased when input is refused, to force a redraw
    words: Object, // {drawing, quantity, rotations, remove, show}
  },
  emits: ["change", "remove", "look"],
  created() { this.draft = null; }, // not reactive: typing must not redraw
  methods: {
    input(row, key, mode, placeholder) {
      const id = `${row.id}-${key}`;
      return h("input", {
        key: id,
        class: key,
        type: "text",
        inputmode: mode,
        autocomplete: "off",
        spellcheck: "false",
        "aria-label": `${this.words[key]}: ${row.name}`,
        // Keep the text being typed; refused input reverts at the next redraw.
        value: this.draft?.id === id ? this.draft.text : row[key],
        placeholder,
        onInput: (e) => { this.draft = { id, text: e.target.value }; },
        onBlur: () => { this.draft = null; },
        onChange: (e) => this.$emit("change", { id: row.id, key, value: e.target.value }),
      });
    },
  },
  render() {
    if (!this.rows.length) return h("div", { class: "wanted" });
    const heads = ["drawing", "quantity", "rotations"].map((key) => h("span", { class: "head", "aria-hidden": "true" }, this.words[key]));
    return h("div", { class: "wanted", role: "group", "aria-label": this.words.drawing }, [
      ...heads,
      h("span"),
      ...this.rows.flatMap((row) => [
        h(
          "button",
          { key: `${row.id}-name`, type: "button", class: "piece", "aria-pressed": row.shown ? "true" : "false", title: `${this.words.show}: ${row.name}`, onClick: () => this.$emit("look", { id: row.id }) },
          row.name,
        ),
        this.input(row, "quantity", "numeric", "1"),
        this.input(row, "rotations", undefined, this.rotations),
        h("button", { key: `${row.id}-remove`, type: "button", class: "less", "aria-label": `${this.words.remove}: ${row.name}`, onClick: () => this.$emit("remove", { id: row.id }) }, "×"),
      ]),
    ]);
  },
};
