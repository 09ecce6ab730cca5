// Drawing as a NiceGUI element (studio/drawing/canvas.py).

import { Drawing } from "leafcut-canvas/canvas.js";
import { register, withStyle } from "leafcut-canvas/registry.js";

/** Return the browser's storage for this origin; null if it is disabled. */
function storage() {
  try {
    return window.localStorage;
  } catch {
    return null;
  }
}

export default {
  template: `<div class="lc-host"></div>`,
  props: { scenes: Object, words: Object, layers: Object, editable: Boolean, placement: Object },
  mounted() {
    withStyle();
    this.shown = {};
    this.drawing = new Drawing(this.$el, {
      words: this.words, layers: this.layers, storage: storage(),
    });
    for (const name of ["select", "drag", "origin"]) {
      this.drawing.on(name, (detail) => { if (!this.quiet) this.$emit(name, detail); });
    }
    register(Number(this.$el.id.replace(/\D+/g, "")), this.drawing);
    this.drawing.setPlacement(this.placement ?? {});
    this.load();
  },
  unmounted() {
    this.gone = true;
    register(Number(this.$el.id.replace(/\D+/g, "")), null);
    this.drawing.destroy();
  },
  watch: {
    scenes() { this.load(); },
    placement() { this.drawing.setPlacement(this.placement ?? {}); },
    editable() { this.drawing.editable = this.editable; },
  },
  methods: {
    /** Fetch scenes whose address has changed, and remove scenes without an address; one update at a time. */
    load() {
      if (this.waiting) return; // the pending update fetches the latest addresses
      this.waiting = true;
      this.loading = (this.loading ?? Promise.resolve()).then(() => this.update()).catch((error) => console.error(error.message));
    },
    async update() {
      this.waiting = false;
      if (this.gone) return;
      const scenes = { ...this.scenes };
      for (const layer of Object.keys(this.shown)) {
        if (layer in scenes) continue;
        delete this.shown[layer];
        this.drawing.clear(layer);
      }
      for (const layer of ["solid_before", "solid_after"].filter((name) => scenes[name] && scenes[name] !== this.shown[name])) {
        // Fetch the stock only when it becomes visible.
        const address = (window.path_prefix ?? "") + scenes[layer];
        this.shown[layer] = scenes[layer];
        this.drawing.offerSolid(layer.slice("solid_".length), async () => {
          const answer = await fetch(address, { cache: "no-store" });
          return answer.status === 200 ? answer.arrayBuffer() : null;
        });
      }
      const order = ["whole", "part", "before", "after", "pheromone", "live", "differences"];
      for (const layer of order.filter((name) => scenes[name] && scenes[name] !== this.shown[name])) {
        if (this.gone) return;
        const answer = await fetch((window.path_prefix ?? "") + scenes[layer], { cache: "no-store" });
        if (answer.status !== 200) continue; // the server has removed the scene meanwhile
        this.drawing.show(await answer.arrayBuffer(), layer);
        this.shown[layer] = scenes[layer];
      }
    },
    /** Zoom to fit, including scenes being fetched. */
    fit() { this.loading = (this.loading ?? Promise.resolve()).then(() => this.drawing.fit()); },
    /** Show the actual position of the machine, mm; null hides it. */
    setTool(place) { this.drawing.setTool(place); },
    /** Select the moves of a line, even of a program being fetched. */
    showLine(line) { this.loading = (this.loading ?? Promise.resolve()).then(() => this.drawing.selectLine(line)); },
    clearSelection() {
      this.quiet = true;
      this.drawing.select(null);
      this.quiet = false;
    },
    selectDifference(index) { this.drawing.selectDifference(index); },
    selectStop(stop) { this.loading = (this.loading ?? Promise.resolve()).then(() => this.drawing.selectStop(stop)); },
  },
};
