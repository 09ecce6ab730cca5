// Program of a drawing as a NiceGUI element (studio/drawing/program_text.py).

import { ProgramView } from "leafcut-canvas/program_view.js";
import { fetchScene, whenThere } from "leafcut-canvas/registry.js";
import { readScene } from "leafcut-canvas/scene.js";
import { defineComponent, h, onMounted, onUnmounted, ref } from "vue";

export default defineComponent({
  props: {
    drawing: { type: Number, required: true },
    words: { type: /** @type {Prop<Words>} */ (Object), required: true },
    source: String,
  },
  setup(props) {
    const host = /** @type {import("vue").Ref<HTMLElement>} */ (ref());
    /** @type {ProgramView} */
    let view;
    let gone = false;
    onMounted(async () => {
      view = new ProgramView(host.value, { words: props.words });
      if (props.source) {
        const bytes = await fetchScene(props.source).catch(() => null);
        if (gone) return;
        if (!bytes) {
          view.refuse();
          return;
        }
        view.show(readScene(bytes));
      }
      whenThere(props.drawing, (drawing) => { if (!gone) view.link(drawing); });
    });
    onUnmounted(() => {
      gone = true;
      view.destroy();
    });
    return () => h("div", { class: "lc-host", ref: host });
  },
});
