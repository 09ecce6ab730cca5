// Jog pad: a press moves one step; holding it repeats until release.
//
// Keys move the machine only while the pad has the focus, so that scrolling never moves it.
import { defineComponent, h, onUnmounted, watch } from "vue";

/** @typedef {[string, number]} Direction Axis and sign. */
/** Key or pointer that is pressed, and its timer. @typedef {{ by: string, held: boolean, timer: number }} Press */

const HELD = 350, AGAIN = 90; // ms until a press counts as held, and interval of its steps
/** @type {Record<string, Direction>} */
const KEYS = {
  ArrowLeft: ["X", -1], ArrowRight: ["X", 1], ArrowUp: ["Y", 1], ArrowDown: ["Y", -1], PageUp: ["Z", 1], PageDown: ["Z", -1],
};
const PLACES = /** @type {[...Direction, string, string][]} */ ([
  ["Y", 1, "y-up", "↑"], ["Z", 1, "z-up", "↑"], ["X", -1, "x-down", "←"], ["X", 1, "x-up", "→"], ["Y", -1, "y-down", "↓"], ["Z", -1, "z-down", "↓"],
]);
const ENDS = ["pointerup", "pointercancel", "blur"]; // events that end a press

export default defineComponent({
  props: { label: String, hint: String, off: Boolean },
  emits: ["jog", "release"],
  setup(props, { emit }) {
    /** @type {Press | null} */
    let pressed = null;

    /** @param {Direction} direction @param {string} by */
    function press([axis, sign], by) {
      if (props.off || pressed) return;
      /** @type {Press} */
      const now = { by, held: false, timer: 0 };
      pressed = now;
      emit("jog", { axis, sign, held: false });
      now.timer = setTimeout(() => {
        now.held = true;
        now.timer = setInterval(() => emit("jog", { axis, sign, held: true }), AGAIN);
      }, HELD);
    }

    function release() {
      if (!pressed) return;
      const { held, timer } = pressed;
      if (held) clearInterval(timer); else clearTimeout(timer);
      pressed = null;
      if (held) emit("release", {});
    }

    /** @param {KeyboardEvent} event */
    function down(event) {
      const direction = KEYS[event.key];
      if (!direction || event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) press(direction, event.key);
    }

    for (const name of ENDS) window.addEventListener(name, release);
    onUnmounted(() => {
      release();
      for (const name of ENDS) window.removeEventListener(name, release);
    });
    watch(() => props.off, (off) => { if (off) release(); });

    return () => h("div", {
      class: ["jog-pad", { off: props.off }], role: "group", tabindex: "0", "aria-label": props.label, title: props.hint,
      onKeydown: down,
      onKeyup: (/** @type {KeyboardEvent} */ { key }) => { if (pressed?.by === key) release(); },
      onFocusout: (/** @type {FocusEvent & { currentTarget: Element }} */ { currentTarget, relatedTarget }) => {
        if (!(relatedTarget instanceof Node && currentTarget.contains(relatedTarget))) release();
      },
    }, [
      ...PLACES.map(([axis, sign, place, arrow]) => h("button", {
        type: "button", class: ["button", place], tabindex: "-1", disabled: props.off, "aria-label": `${axis}${sign > 0 ? "+" : "−"}`,
        onPointerdown: (/** @type {PointerEvent} */ { button }) => { if (button === 0) press([axis, sign], "pointer"); },
        onClick: (/** @type {MouseEvent} */ { detail }) => {
          if (detail !== 0) return;
          press([axis, sign], "click"); // keyboard activation, without a pointer
          release();
        },
      }, [h("b", axis), h("span", { "aria-hidden": "true" }, arrow)])),
      h("span", { class: "at-xy", "aria-hidden": "true" }, "XY"),
      h("span", { class: "at-z", "aria-hidden": "true" }, "Z"),
    ]);
  },
});
