// The drawing as an element of NiceGUI (studio/drawing/canvas.py).

import { Drawing } from "leafcut-canvas/canvas.js";
import { register, withStyle } from "leafcut-canvas/registry.js";

/** Return what the browser keeps for this address; null where it keeps nothing. */
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
      words: this.words, layers: this.layers, editable: this.editable, storage: storage(),
    });
    for (const name of ["hover", "select", "time", "drag", "origin"]) this.drawing.on(name, (detail) => this.$emit(name, detail));
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
    /** Fetch what has another address than before, and take off what has none any more; one after the other. */
    load() {
      if (this.waiting) return; // what is about to be fetched is what is wanted then
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
        // The stock is only fetched when somebody wants to see it.
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
        if (answer.status !== 200) continue; // taken off meanwhile
        this.drawing.show(await answer.arrayBuffer(), layer);
        this.shown[layer] = scenes[layer];
      }
    },
    /** Show all, also of what is being fetched just now. */
    fit() { this.loading = (this.loading ?? Promise.resolve()).then(() => this.drawing.fit()); },
    /** Show where the machine really is, mm; null for not at all. */
    setTool(place) { this.drawing.setTool(place); },
    /** Select what a line does, also of a program that is being fetched just now. */
    showLine(line) { this.loading = (this.loading ?? Promise.resolve()).then(() => this.drawing.selectLine(line)); },
    select(row) { this.drawing.select(row); },
    selectLine(line) { this.drawing.selectLine(line); },
    selectDifference(index) { this.drawing.selectDifference(index); },
    selectHole(hole) { this.drawing.selectHole(hole); },
    selectStop(stop) { this.loading = (this.loading ?? Promise.resolve()).then(() => this.drawing.selectStop(stop)); },
    play(rate) { this.drawing.play(rate); },
    pause() { this.drawing.pause(); },
    seek(seconds) { this.drawing.seek(seconds); },
    setMode(mode) { this.drawing.setMode(mode); },
    setLayers(layers) { this.drawing.setLayers(layers); },
  },
};
