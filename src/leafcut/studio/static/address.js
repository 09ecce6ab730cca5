// Browser history of the page: adds its steps and reports Back and Forward. Also commits the text of a field when the
// user leaves the page.
import { h } from "vue";

export default {
  // Latest steps of the page, each [number, "pushState" or "replaceState", address].
  props: { steps: { type: Array, default: () => [] } },
  emits: ["went"],
  created() {
    this.done = 0;
  },
  mounted() {
    this.take();
    this.back = () => this.$emit("went", { said: Object.fromEntries(new URLSearchParams(location.search)), done: this.done });
    this.leave = () => document.activeElement?.blur?.(); // a field reports its text when it loses the focus
    window.addEventListener("popstate", this.back);
    window.addEventListener("beforeunload", this.leave);
  },
  unmounted() {
    window.removeEventListener("popstate", this.back);
    window.removeEventListener("beforeunload", this.leave);
  },
  // Runs before the content of a step is drawn: Back works as soon as the user sees it.
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
