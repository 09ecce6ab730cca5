// Program of a drawing as a NiceGUI element (studio/drawing/program_text.py).

import { ProgramView } from "leafcut-canvas/program_view.js";
import { whenThere, withStyle } from "leafcut-canvas/registry.js";
import { readScene } from "leafcut-canvas/scene.js";

export default {
  template: `<div class="lc-host"></div>`,
  props: { drawing: Number, words: Object, source: String },
  async mounted() {
    withStyle();
    withStyle("program.css");
    this.view = new ProgramView(this.$el, { words: this.words });
    if (this.source) {
      const answer = await fetch((window.path_prefix ?? "") + this.source, { cache: "no-store" }).catch(() => null);
      const bytes = answer?.status === 200 ? await answer.arrayBuffer() : null;
      if (this.gone) return;
      if (!bytes) return this.view.refuse();
      this.view.show(readScene(bytes));
    }
    whenThere(this.drawing, (drawing) => { if (!this.gone) this.view.link(drawing); });
  },
  unmounted() {
    this.gone = true;
    this.view.destroy();
  },
};
