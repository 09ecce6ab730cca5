// Table of a nest's parts: a row for each drawing with quantity and angles.
import { defineComponent, h } from "vue";

/** @typedef {{ id: string, name: string, quantity: string, rotations: string, shown: boolean }} Row */

export default defineComponent({
  props: {
    rows: { type: /** @type {Prop<Row[]>} */ (Array), default: () => [] },
    rotations: String, // default angles
    version: Number, // increased when input is refused, to force a redraw
    words: { type: /** @type {Prop<Words>} */ (Object), required: true }, // drawing, quantity, rotations, remove, show
  },
  emits: ["change", "remove", "look"],
  setup(props, { emit }) {
    /** Text being typed; not reactive: typing must not redraw. @type {{ id: string, text: string } | null} */
    let draft = null;

    /** @param {Row} row @param {"quantity" | "rotations"} key @param {"numeric" | undefined} mode @param {string} [placeholder] */
    function input(row, key, mode, placeholder) {
      const id = `${row.id}-${key}`;
      return h("input", {
        key: id,
        class: key,
        type: "text",
        inputmode: mode,
        autocomplete: "off",
        spellcheck: "false",
        "aria-label": `${props.words[key]}: ${row.name}`,
        // Keep the text being typed; refused input reverts at the next redraw.
        value: draft?.id === id ? draft.text : row[key],
        placeholder,
        onInput: (/** @type {FieldEvent} */ { target }) => { draft = { id, text: target.value }; },
        onBlur: () => { draft = null; },
        onChange: (/** @type {FieldEvent} */ { target }) => emit("change", { id: row.id, key, value: target.value }),
      });
    }

    return () => {
      const { rows, words, rotations } = props;
      if (!rows.length) return h("div", { class: "wanted" });
      const heads = ["drawing", "quantity", "rotations"].map((key) => h("span", { class: "head", "aria-hidden": "true" }, words[key]));
      return h("div", { class: "wanted", role: "group", "aria-label": words.drawing }, [
        ...heads,
        h("span"),
        ...rows.flatMap((row) => [
          h("button", {
            key: `${row.id}-name`, type: "button", class: "piece", "aria-pressed": row.shown ? "true" : "false", title: `${words.show}: ${row.name}`,
            onClick: () => emit("look", { id: row.id }),
          }, row.name),
          input(row, "quantity", "numeric", "1"),
          input(row, "rotations", undefined, rotations),
          h("button", {
            key: `${row.id}-remove`, type: "button", class: "less", "aria-label": `${words.remove}: ${row.name}`,
            onClick: () => emit("remove", { id: row.id }),
          }, "×"),
        ]),
      ]);
    };
  },
});
