// A chart as an element of NiceGUI (studio/canvas.py): Convergence, Bars or Brightness.

import * as charts from "leafcut-canvas/chart.js";
import { withStyle } from "leafcut-canvas/registry.js";

export default {
  template: `<div class="lc-host"></div>`,
  props: { kind: String, data: [Object, Array], words: Object },
  mounted() {
    withStyle();
    this.chart = new charts[this.kind](this.$el, { words: this.words });
    this.draw();
  },
  unmounted() { this.chart.destroy(); },
  watch: { data() { this.draw(); } },
  methods: { draw() { if (this.data) this.chart.set(this.data); } },
};
