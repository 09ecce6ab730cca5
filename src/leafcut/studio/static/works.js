// Kinds of work as thumbnails: a group of radio buttons.
import { defineComponent, getCurrentInstance, h, onUpdated, ref, watch } from "vue";

const SIZE = "0 0 96 56";

/** Strong and faint lines in a box of 96 × 56. @typedef {{ style: string, strong: string, faint: string }} Picture */
/** @typedef {{ name: string, title: string, picture?: Picture | null }} Work */

/** Icons for kinds of work without a drawing.
 * @type {Record<string, Picture>} */
const ICONS = {
  drill: { style: "holes", faint: "M14 8H82V48H14Z", strong: "M28 18a4 4 0 1 0 .1 0ZM48 18a4 4 0 1 0 .1 0ZM68 18a4 4 0 1 0 .1 0ZM28 32a4 4 0 1 0 .1 0ZM48 32a4 4 0 1 0 .1 0ZM68 32a4 4 0 1 0 .1 0Z" },
  cut: { style: "lines", faint: "M8 4H88V52H8Z", strong: "M18 44V26a14 14 0 0 1 28 0v18ZM32 22a4 4 0 1 0 .1 0ZM56 12H80V44H56ZM68 22a6 6 0 1 0 .1 0Z" },
  nest: { style: "lines", faint: "M8 4H88V52H8Z", strong: "M13 9H40V24H26V47H13ZM44 47V32H30V47ZM48 9H83V22H48ZM48 27H62V47H48ZM67 27H83V47H67Z" },
  pocket: { style: "areas", faint: "M8 4H88V52H8Z", strong: "M24 10H72a8 8 0 0 1 8 8V38a8 8 0 0 1-8 8H24a8 8 0 0 1-8-8V18a8 8 0 0 1 8-8ZM48 20a8 8 0 1 0 .1 0Z" },
  part: { style: "lines", faint: "M8 4H88V52H8Z", strong: "M20 46V20a10 10 0 0 1 10-10H66a10 10 0 0 1 10 10V46ZM34 20a4 4 0 1 0 .1 0ZM62 20a4 4 0 1 0 .1 0ZM36 34H60V40H36Z" },
  program: { style: "lines", faint: "M16 12H34M16 22H34M16 32H34M16 42H34", strong: "M46 12H80M46 22H68M46 32H80M46 42H62" },
  solve: { style: "lines", faint: "", strong: "M18 40 26 14 48 22 72 10 80 34 58 32 50 46Z" },
  simulate: { style: "lines", faint: "", strong: "M48 8a20 20 0 1 0 .1 0ZM48 16V28L57 34" },
  verify: { style: "lines", faint: "M18 8H46V48H18ZM50 8H78V48H50Z", strong: "M34 30 44 40 64 18" },
};
const PLAIN = { style: "lines", faint: "M14 8H82V48H14Z", strong: "M28 28H68" };

/** Return an image as SVG. @param {Picture} picture */
function drawn({ style, strong, faint }) {
  return h("svg", { class: ["picture", style], viewBox: SIZE, "aria-hidden": "true" }, [
    h("path", { class: "faint", d: faint }),
    h("path", { class: "strong", d: strong, "fill-rule": "evenodd" }),
  ]);
}

export default defineComponent({
  props: {
    label: String,
    works: { type: /** @type {Prop<Work[]>} */ (Array), default: () => [] },
    chosen: String,
    why: String,
    turn: Number,
  },
  emits: ["choose"],
  setup(props, { emit }) {
    const pressed = ref(/** @type {string | null} */ (null)); // the user's choice until the page confirms it
    const group = ref(/** @type {HTMLElement | null} */ (null)), name = `work-${getCurrentInstance()?.uid}`;
    const now = () => pressed.value ?? props.chosen;
    watch(() => props.turn, () => { pressed.value = null; });
    // The browser checks a pressed button at once; undo that if the page does not select it.
    onUpdated(() => { for (const input of group.value?.querySelectorAll("input") ?? []) input.checked = input.value === now(); });
    /** @param {string} work */
    function take(work) {
      pressed.value = work;
      emit("choose", work);
    }
    const card = (/** @type {Work} */ { name: value, title, picture }) =>
      h("label", { class: ["work-card", value === now() && "chosen"], key: value }, [
        h("input", { type: "radio", name, value, checked: value === now(), onChange: () => take(value) }),
        drawn(picture ?? ICONS[value] ?? PLAIN),
        h("span", title),
      ]);
    return () => h("div", { class: "works", "data-turn": props.turn, ref: group }, [
      h("div", { class: "work-cards", role: "radiogroup", "aria-label": props.label }, props.works.map(card)),
      props.why ? h("p", { class: "why quiet" }, props.why) : null,
    ]);
  },
});
