// A chart as a NiceGUI element (studio/drawing/canvas.py): a class of chart.js, learning.js or runs.js by name.

import * as charts from "leafcut-canvas/chart.js";
import * as learning from "leafcut-canvas/learning.js";
import { savePicture } from "leafcut-canvas/picture.js";
import { withStyle } from "leafcut-canvas/registry.js";
import * as runs from "leafcut-canvas/runs.js";

const KINDS = { ...charts, ...learning, ...runs };

export default {
  template: `<div class="lc-host"></div>`,
  props: { kind: String, data: [Object, Array], words: Object },
  mounted() {
    withStyle();
    this.chart = new KINDS[this.kind](this.$el, { words: this.words });
    this.draw();
  },
  unmounted() { this.chart.destroy(); },
  watch: { data() { this.draw(); } },
  methods: {
    draw() { if (this.data) this.chart.set(this.data); },
    /** Save the chart as a PNG file. */
    async save(name) { await savePicture(KINDS[this.kind], this.data, { words: this.words, by: this.chart.by }, name, document.querySelector(".studio") ?? document.body); },
  },
};
