// Layers of the open drawing, each with its colour and a checkbox.

import { make } from "./icons.js";

/** List of the drawing's own layers, for the layers menu. */
export class Legend {
  /** @param {import("./canvas.js").Drawing} drawing */
  constructor(drawing) {
    this.drawing = drawing;
    this.element = make("div", "lc-drawn", { role: "group", "aria-label": drawing.words.drawnLayers });
    /** @type {string[]} */
    this._names = [];
    /** @type {HTMLInputElement[]} */
    this.boxes = [];
  }

  /** Update the list; hidden if there are fewer than two layers. */
  update() {
    const { drawing } = this, names = drawing.drawnLayers;
    this.element.hidden = names.length < 2;
    if (names.join("\n") !== this._names.join("\n")) {
      const rows = names.map((name, k) => this._row(name, k));
      this._names = names;
      this.boxes = rows.map(([box]) => box);
      const heading = make("div", "lc-heading", { "aria-hidden": "true" }, drawing.words.drawnLayers);
      this.element.replaceChildren(heading, ...rows.map(([, label]) => label));
    }
    this.boxes.forEach((box, k) => { box.checked = !drawing.hidden.has(names[k]); });
  }

  /** @param {string} name @param {number} k @returns {[HTMLInputElement, HTMLElement]} */
  _row(name, k) {
    const box = make("input", "", { type: "checkbox" }), swatch = make("i", "lc-swatch");
    swatch.style.background = `var(--t${k % 8})`;
    box.addEventListener("change", () => this.drawing.showDrawnLayer(name, box.checked));
    return [box, make("label", "", { "data-drawn": name }, box, swatch, make("span", "lc-cut-off", { title: name }, name))];
  }
}
