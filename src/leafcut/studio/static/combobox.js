// A text field with a menu of suggestions (combobox of the ARIA practices).
import { matchingOffers } from "leafcut-canvas/option_filter.js";
import { computed, defineComponent, h, nextTick, ref } from "vue";

/** @import { Offer } from "./option_filter.js" */

let count = 0;

export const Combobox = defineComponent({
  props: {
    about: Object, // attributes of the input: id, aria-describedby, …
    value: { type: String, default: "" }, // shown text; a text being typed takes precedence
    offers: { type: /** @type {Prop<Offer[]>} */ (Array), default: () => [] },
    open: String, // label of the button
  },
  emits: ["typed", "change", "left"],
  setup(props, { emit }) {
    const list = `menu-${++count}`;
    const shown = ref(false), at = ref(-1), filter = ref(""), typing = ref(/** @type {string | null} */ (null));
    const field = ref(/** @type {HTMLInputElement | null} */ (null)), menu = ref(/** @type {HTMLElement | null} */ (null));
    const found = computed(() => matchingOffers(props.offers, filter.value));

    function show(text = "") {
      filter.value = text;
      shown.value = found.value.length > 0;
      at.value = text ? -1 : found.value.findIndex(([value]) => value === props.value);
      reveal();
    }

    function reveal() {
      nextTick(() => {
        menu.value?.scrollIntoView({ block: "nearest" });
        menu.value?.children[at.value]?.scrollIntoView({ block: "nearest" });
      });
    }

    function hide() {
      shown.value = false;
      at.value = -1;
    }

    /** @param {Offer} offer */
    function take([value]) {
      hide();
      typing.value = value;
      emit("typed", value);
      emit("change", value);
    }

    /** @param {KeyboardEvent} event */
    function key(event) {
      const { length } = found.value, step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      if (step) {
        event.preventDefault();
        if (!shown.value) {
          show();
          return;
        }
        at.value = at.value < 0 ? (step > 0 ? 0 : length - 1) : (at.value + step + length) % length;
        reveal();
      } else if (event.key === "Enter" && shown.value && at.value >= 0) {
        event.preventDefault();
        take(found.value[at.value]);
      } else if (event.key === "Escape" && shown.value) {
        event.preventDefault();
        event.stopPropagation();
        hide();
      }
    }

    return () => h("span", { class: "combobox" }, [
      h("input", {
        ...props.about,
        ref: field,
        role: "combobox",
        type: "text",
        value: typing.value ?? props.value, // redrawing the menu keeps the text being typed
        "aria-expanded": shown.value ? "true" : "false",
        "aria-autocomplete": "list",
        "aria-controls": list,
        "aria-activedescendant": shown.value && at.value >= 0 ? `${list}-${at.value}` : undefined,
        onInput: (/** @type {FieldEvent} */ { target }) => {
          typing.value = target.value;
          emit("typed", target.value);
          show(target.value);
        },
        onKeydown: key,
        onBlur: () => {
          hide();
          typing.value = null;
          emit("left");
        },
        onChange: (/** @type {FieldEvent} */ { target }) => emit("change", target.value.trim()),
      }),
      h("button", {
        type: "button",
        class: "opens",
        tabindex: "-1", // opened with the arrow keys in the field
        "aria-label": props.open,
        // Not on click, as the field would lose the focus and regain it in between.
        onPointerdown: (/** @type {PointerEvent} */ event) => {
          event.preventDefault();
          field.value?.focus();
          if (shown.value) hide(); else show();
        },
      }, [h("span", { "aria-hidden": "true" }, "▾")]),
      h("ul", { ref: menu, id: list, role: "listbox", class: ["menu", shown.value || "hidden"], "aria-label": props.open },
        shown.value ? found.value.map(([value, text], k) => h("li", {
          key: value,
          id: `${list}-${k}`,
          role: "option",
          "aria-selected": k === at.value ? "true" : "false",
          onPointerdown: (/** @type {PointerEvent} */ event) => {
            event.preventDefault();
            take([value, text]);
          },
        }, text)) : []),
    ]);
  },
});
