// A text field that keeps its content when the page is redrawn; a new `version` replaces the content.
import { defineComponent, h, ref, watch } from "vue";

export default defineComponent({
  props: { field: String, value: String, version: Number, unit: String, numbers: Boolean, offered: String, placeholder: String },
  emits: ["typed"],
  setup(props, { emit }) {
    const draft = ref(props.value);
    watch(() => props.version, () => { draft.value = props.value; });
    return () => h("span", { class: "box" }, [
      h("input", {
        id: props.field, type: "text", autocomplete: "off", spellcheck: "false", inputmode: props.numbers ? "decimal" : "text",
        list: props.offered || null, placeholder: props.placeholder || null, value: draft.value,
        onInput: (/** @type {FieldEvent} */ { target: { value } }) => {
          draft.value = value;
          emit("typed", { value });
        },
      }),
      props.unit ? h("span", { class: "unit", "aria-hidden": "true" }, props.unit) : null,
    ]);
  },
});
