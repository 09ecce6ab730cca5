// Browser history of the page: adds its steps and reports Back and Forward. Also commits the text of a field when the
// user leaves the page.
import { defineComponent, h, onMounted, onUnmounted, watch } from "vue";

/** @typedef {[number, "pushState" | "replaceState", string]} Step */

export default defineComponent({
  // Latest steps of the page, each [number, "pushState" or "replaceState", address].
  props: { steps: { type: /** @type {Prop<Step[]>} */ (Array), default: () => [] } },
  emits: ["went"],
  setup(props, { emit }) {
    let done = 0; // number of the last step taken
    function take() {
      for (const [number, step, address] of props.steps) {
        if (number <= done) continue;
        done = number;
        history[step]({}, "", address);
      }
    }
    const back = () => emit("went", { said: Object.fromEntries(new URLSearchParams(location.search)), done });
    // A field reports its text when it loses the focus.
    const leave = () => { if (document.activeElement instanceof HTMLElement) document.activeElement.blur(); };
    onMounted(() => {
      take();
      window.addEventListener("popstate", back);
      window.addEventListener("beforeunload", leave);
    });
    onUnmounted(() => {
      window.removeEventListener("popstate", back);
      window.removeEventListener("beforeunload", leave);
    });
    // Runs before the content of a step is drawn: Back works as soon as the user sees it.
    watch(() => props.steps, take, { flush: "sync" });
    return () => h("span", { hidden: true });
  },
});
