// What the browser stores of the page: its steps in the history, each with the choices.
// Also commits the text of a field when the user leaves the page.
import { defineComponent, h, onMounted, onUnmounted, watch } from "vue";

/** @typedef {[number, "pushState" | "replaceState", string, string]} Step */

const LAST = "leafcut-last"; // choices of the page that was closed last

export default defineComponent({
  // Steps that the browser has not taken yet, each [number, "pushState" or "replaceState", address, choices].
  props: { steps: { type: /** @type {Prop<Step[]>} */ (Array), default: () => [] } },
  emits: ["went", "took"],
  setup(props, { emit, expose }) {
    let done = 0; // number of the last step taken
    function take() {
      const before = done;
      for (const [number, step, address, choices] of props.steps) {
        if (number <= done) continue;
        done = number;
        history[step]({ choices }, "", address);
      }
      if (done > before) emit("took", done);
    }
    const choices = () => /** @type {string} */ (history.state?.choices ?? "");
    const back = () => emit("went", { address: Object.fromEntries(new URLSearchParams(location.search)), choices: choices(), done });
    // A field reports its text when it loses the focus.
    const leave = () => { if (document.activeElement instanceof HTMLElement) document.activeElement.blur(); };
    const close = () => { if (choices() && JSON.parse(choices()).source) localStorage.setItem(LAST, choices()); };
    onMounted(() => {
      window.addEventListener("popstate", back);
      window.addEventListener("beforeunload", leave);
      window.addEventListener("pagehide", close);
    });
    onUnmounted(() => {
      window.removeEventListener("popstate", back);
      window.removeEventListener("beforeunload", leave);
      window.removeEventListener("pagehide", close);
    });
    // Runs before the content of a step is drawn: Back works as soon as the user sees it.
    watch(() => props.steps, take, { flush: "sync" });

    expose({
      read: () => {
        if (choices() && localStorage.getItem(LAST) === choices()) localStorage.removeItem(LAST); // this page is open again
        return choices();
      },
      readLast: () => localStorage.getItem(LAST) ?? "",
    });
    return () => h("span", { hidden: true });
  },
});
