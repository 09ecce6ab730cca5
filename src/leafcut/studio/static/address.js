// Follows the browser's history: puts the page's steps into it, tells where Back and Forward lead, and lets what is
// being typed count when the page is left.
import { h } from "vue";

export default {
  // The newest steps of the page, each [number, "pushState" or "replaceState", address].
  props: { steps: { type: Array, default: () => [] } },
  emits: ["went"],
  created() {
    this.done = 0;
  },
  mounted() {
    this.take();
    this.back = () => this.$emit("went", { said: Object.fromEntries(new URLSearchParams(location.search)), done: this.done });
    this.leave = () => document.activeElement?.blur?.(); // a field says what was typed in it when it is left
    window.addEventListener("popstate", this.back);
    window.addEventListener("beforeunload", this.leave);
  },
  unmounted() {
    window.removeEventListener("popstate", this.back);
    window.removeEventListener("beforeunload", this.leave);
  },
  // Before what came with a step is drawn: whoever sees that can go back from it.
  watch: { steps: { handler: "take", flush: "sync" } },
  methods: {
    take() {
      for (const [number, step, address] of this.steps) {
        if (number <= this.done) continue;
        this.done = number;
        history[step]({}, "", address);
      }
    },
  },
  render: () => h("span", { hidden: true }),
};
