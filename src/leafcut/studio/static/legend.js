// Layers of the open drawing, each with its colour and a checkbox.

import { make } from "./icons.js";

/** List of the drawing's own layers, for the layers menu. */
export class Legend {
  constructor(drawing) {
    this.drawing = drawing;
    this.element = make("div", "lc-drawn", { role: "group", "aria-label": drawing.words.drawnLayers });
    this._shown = "";
    this.boxes = [];
  }

  /** Update the list; hidden if there are fewer than two layers. */
  update() {
    const { drawing } = this, names = drawing.drawnLayers, key = JSON.stringify([names, [...drawing.hidden]]);
    if (key === this._shown) return;
    const before = JSON.parse(this._shown || "[[]]")[0];
    this._shown = key;
    this.element.hidden = names.length < 2;
    if (JSON.stringify(before) !== JSON.stringify(names)) {
      this.boxes = names.map((name, k) => this._box(name, k));
      this.element.replaceChildren(make("div", "lc-heading", { "aria-hidden": "true" }, drawing.words.drawnLayers), ...this.boxes.map((box) => box.parentElement));
    }
    this.boxes.forEach((box, k) => { box.checked = !drawing.hidden.has(names[k]); });
  }

  _box(name, k) {
    const box = make("input", "", { type: "checkbox" }), swatch = make("i", "lc-swatch");
    swatch.style.background = `var(--t${k % 8})`;
    box.addEventListener("change", () => this.drawing.showDrawnLayer(name, box.checked));
    make("label", "", { "data-drawn": name }, box, swatch, make("span", "lc-cut-off", { title: name }, name));
    return box;
  }
}
