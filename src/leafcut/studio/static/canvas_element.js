// Drawing as a NiceGUI element (studio/drawing/canvas.py).

import { Drawing } from "leafcut-canvas/canvas.js";
import { fetchScene, register } from "leafcut-canvas/registry.js";
import { defineComponent, h, onMounted, onUnmounted, ref, watch } from "vue";

/** @import { MachinePlace, Which } from "./canvas.js" */
/** @import { PlacementSettings } from "./placement.js" */

const LAYERS = ["whole", "part", "before", "after", "pheromone", "live", "differences"];
const SOLIDS = /** @type {[string, Which][]} */ ([["solid_before", "before"], ["solid_after", "after"]]);

/** Return the browser's storage for this origin; null if it is disabled. */
function storage() {
  try {
    return window.localStorage;
  } catch {
    return null;
  }
}

export default defineComponent({
  props: {
    scenes: { type: /** @type {Prop<Record<string, string>>} */ (Object), default: () => ({}) },
    words: { type: /** @type {Prop<Words>} */ (Object), required: true },
    layers: { type: /** @type {Prop<Record<string, boolean>>} */ (Object), default: () => ({}) },
    editable: Boolean,
    placement: { type: /** @type {Prop<PlacementSettings>} */ (Object), default: () => ({}) },
  },
  emits: ["select", "drag", "origin"],
  setup(props, { emit, expose }) {
    const host = /** @type {import("vue").Ref<HTMLElement>} */ (ref());
    /** @type {Drawing} */
    let drawing;
    let id = 0, quiet = false, gone = false, waiting = false;
    /** Addresses of the scenes shown by layer. @type {Record<string, string>} */
    const shown = {};
    let loading = Promise.resolve();

    /** Fetch scenes whose address has changed, and remove scenes without an address; one update at a time. */
    function load() {
      if (waiting) return; // the pending update fetches the latest addresses
      waiting = true;
      later(update);
    }

    async function update() {
      waiting = false;
      if (gone) return;
      const scenes = { ...props.scenes }, changed = (/** @type {string} */ layer) => scenes[layer] && scenes[layer] !== shown[layer];
      for (const layer of Object.keys(shown)) {
        if (layer in scenes) continue;
        delete shown[layer];
        drawing.clear(layer);
      }
      for (const [layer, which] of SOLIDS) {
        if (!changed(layer)) continue;
        shown[layer] = scenes[layer];
        drawing.offerSolid(which, () => fetchScene(scenes[layer])); // fetched only when it becomes visible
      }
      for (const layer of LAYERS) {
        if (!changed(layer)) continue;
        if (gone) return;
        const bytes = await fetchScene(scenes[layer]);
        if (!bytes) continue;
        drawing.show(bytes, layer);
        shown[layer] = scenes[layer];
      }
    }

    /** Act after the scenes that are being fetched. @param {() => void | Promise<void>} act */
    function later(act) { loading = loading.then(act).catch((error) => console.error(error)); }

    onMounted(() => {
      drawing = new Drawing(host.value, { words: props.words, layers: props.layers, storage: storage() });
      for (const name of /** @type {const} */ (["select", "drag", "origin"])) {
        drawing.on(name, (detail) => { if (!quiet) emit(name, detail); });
      }
      drawing.editable = props.editable;
      drawing.setPlacement(props.placement);
      id = Number(host.value.id.replace(/\D+/g, ""));
      register(id, drawing);
      load();
    });
    onUnmounted(() => {
      gone = true;
      register(id, null);
      drawing.destroy();
    });
    watch(() => props.scenes, load);
    watch(() => props.placement, (placement) => drawing.setPlacement(placement));
    watch(() => props.editable, (editable) => { drawing.editable = editable; });

    expose({
      /** Zoom to fit. */
      fit: () => later(() => drawing.fit()),
      /** Show the actual position of the machine; null hides it. @param {MachinePlace | null} place */
      setTool: (place) => drawing.setTool(place),
      /** Select the moves of a line. @param {number} line */
      showLine: (line) => later(() => drawing.selectLine(line)),
      clearSelection: () => {
        quiet = true;
        drawing.select(null);
        quiet = false;
      },
      /** @param {number} index */
      selectDifference: (index) => drawing.selectDifference(index),
      /** @param {string | null} layer */
      selectLayer: (layer) => drawing.selectLayer(layer),
      /** @param {number} stop */
      selectStop: (stop) => later(() => drawing.selectStop(stop)),
    });
    return () => h("div", { class: "lc-host", ref: host });
  },
});
