// Table of a nest's parts: a row for each drawing with quantity and angles.
import { FieldTexts } from "leafcut-canvas/field_texts.js";
import { defineComponent, h } from "vue";

/** @typedef {{ id: string, name: string, quantity: string, rotations: string, shown: boolean }} Row */

export default defineComponent({
  props: {
    rows: { type: /** @type {Prop<Row[]>} */ (Array), default: () => [] },
    rotations: String, // default angles
    answered: { type: Number, default: 0 }, // number of the last change that the server has answered
    words: { type: /** @type {Prop<Words>} */ (Object), required: true }, // drawing, quantity, rotations, remove, show
  },
  emits: ["change", "remove", "look"],
  setup(props, { emit }) {
    const texts = new FieldTexts(props.answered); // not reactive: typing must not redraw

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
        value: texts.content(id, row[key], props.answered), // refused input reverts when the server answers
        placeholder,
        onInput: (/** @type {FieldEvent} */ { target }) => texts.type(id, target.value),
        onBlur: () => texts.leave(),
        onChange: (/** @type {FieldEvent} */ { target: { value } }) => emit("change", { id: row.id, key, value, number: texts.send(id, value) }),
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
