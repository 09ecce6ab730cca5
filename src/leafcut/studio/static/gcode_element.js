// The program of a drawing as an element of NiceGUI (studio/canvas.py).

import { GcodeList, link } from "leafcut-canvas/gcode.js";
import { whenThere, withStyle } from "leafcut-canvas/registry.js";

export default {
  template: `<div class="lc-host"></div>`,
  props: { drawing: Number, words: Object },
  mounted() {
    withStyle();
    this.list = new GcodeList(this.$el, { words: this.words });
    whenThere(this.drawing, (drawing) => { if (!this.gone) this.unlink = link(drawing, this.list); });
  },
  unmounted() {
    this.gone = true;
    this.unlink?.();
    this.list.destroy();
  },
};
