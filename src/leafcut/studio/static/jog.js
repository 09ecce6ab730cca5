// Jog pad: a press moves one step; holding it repeats until release.
//
// Keys move the machine only while the pad has the focus, so that scrolling never moves it.
import { h } from "vue";

const HELD = 350, AGAIN = 90; // ms until a press counts as held, and interval of its steps
const KEYS = {
  ArrowLeft: ["X", -1], ArrowRight: ["X", 1], ArrowUp: ["Y", 1], ArrowDown: ["Y", -1], PageUp: ["Z", 1], PageDown: ["Z", -1],
};
const PLACES = [["Y", 1, "y-up", "↑"], ["Z", 1, "z-up", "↑"], ["X", -1, "x-down", "←"], ["X", 1, "x-up", "→"], ["Y", -1, "y-down", "↓"], ["Z", -1, "z-down", "↓"]];

export default {
  props: { label: String, hint: String, off: Boolean },
  emits: ["jog", "release"],
  created() {
    this.pressed = null;
    this.let_go = () => this.release();
    for (const name of ["pointerup", "pointercancel", "blur"]) window.addEventListener(name, this.let_go);
  },
  unmounted() {
    this.release();
    for (const name of ["pointerup", "pointercancel", "blur"]) window.removeEventListener(name, this.let_go);
  },
  watch: { off() { if (this.off) this.release(); } },
  methods: {
    press(axis, sign, by) {
      if (this.off || this.pressed) return;
      this.pressed = { by, held: false };
      this.$emit("jog", { axis, sign, held: false });
      this.pressed.timer = setTimeout(() => {
        this.pressed.held = true;
        this.pressed.timer = setInterval(() => this.$emit("jog", { axis, sign, held: true }), AGAIN);
      }, HELD);
    },
    release() {
      if (!this.pressed) return;
      const { held, timer } = this.pressed;
      if (held) clearInterval(timer); else clearTimeout(timer);
      this.pressed = null;
      if (held) this.$emit("release", {});
    },
    down(event) {
      const meant = KEYS[event.key];
      if (!meant || event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) this.press(...meant, event.key);
    },
  },
  render() {
    return h("div", {
      class: ["jog-pad", { off: this.off }], role: "group", tabindex: "0", "aria-label": this.label, title: this.hint,
      onKeydown: this.down,
      onKeyup: (e) => { if (this.pressed?.by === e.key) this.release(); },
      onFocusout: (e) => { if (!e.currentTarget.contains(e.relatedTarget)) this.release(); },
    }, [
      ...PLACES.map(([axis, sign, place, arrow]) => h("button", {
        type: "button", class: ["button", place], tabindex: "-1", disabled: this.off, "aria-label": `${axis}${sign > 0 ? "+" : "−"}`,
        onPointerdown: (e) => { if (e.button === 0) this.press(axis, sign, "pointer"); },
        onClick: (e) => { if (e.detail === 0) { this.press(axis, sign, "click"); this.release(); } }, // keyboard activation, without a pointer
      }, [h("b", axis), h("span", { "aria-hidden": "true" }, arrow)])),
      h("span", { class: "at-xy", "aria-hidden": "true" }, "XY"),
      h("span", { class: "at-z", "aria-hidden": "true" }, "Z"),
    ]);
  },
};
