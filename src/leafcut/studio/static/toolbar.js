// Buttons above the drawing: modes, layers, zoom and fit.

import { Legend } from "./legend.js";
import { icon, iconButton, make } from "./icons.js";

export const LAYERS = ["rapids", "cuts", "holes", "whole", "numbers", "arrows", "extents", "issues", "pheromone", "differences", "kerf", "cleared", "travel", "origin", "grid"];
/** Letter of each layer, with Shift; plain letters belong to the page. */
export const KEYS = { rapids: "R", cuts: "C", holes: "H", whole: "D", numbers: "N", arrows: "A", extents: "E", issues: "I", pheromone: "P", kerf: "K", cleared: "W", travel: "T", origin: "O", grid: "G", differences: "V" };

export class Toolbar {
  constructor(host, drawing) {
    this.drawing = drawing;
    const { words } = drawing;
    this.modes = make("div", "lc-modes", { role: "radiogroup", "aria-label": words.compare });
    for (const mode of ["before", "after", "side", "overlay"]) {
      const button = make("button", "lc-mode", { type: "button", role: "radio", "data-mode": mode }, words[mode]);
      button.addEventListener("click", () => drawing.setMode(mode));
      this.modes.append(button);
    }
    this.spaces = make("div", "lc-modes", { role: "radiogroup", "aria-label": words.space, hidden: "" });
    for (const space of ["plan", "solid", "both"]) {
      const button = make("button", "lc-mode", { type: "button", role: "radio", "data-space": space }, words[`space_${space}`]);
      button.addEventListener("click", () => drawing.setSpace(space));
      this.spaces.append(button);
    }
    for (const group of [this.modes, this.spaces]) group.addEventListener("keydown", (event) => this._arrow(event, group));
    this.menu = this._layers(drawing);
    const zoom = (name, factor) => iconButton(name, words[name], () => drawing.zoom(factor));
    const group = make(
      "div", "lc-group", {}, zoom("zoomOut", 1 / 1.4), zoom("zoomIn", 1.4), iconButton("fit", words.fit, () => drawing.fit()),
    );
    this.measure = iconButton("measure", words.measureTip, () => drawing.toggleMeasure());
    host.append(this.modes, this.spaces, make("span", "lc-room"), make("div", "lc-group", {}, this.measure), this.menu, group);
    this.update();
  }

  _layers({ words, stage }) {
    const box = make("div", "lc-layers", { role: "group", "aria-label": words.layers });
    this.boxes = {};
    for (const layer of LAYERS) {
      const input = make("input", "", { type: "checkbox" });
      input.addEventListener("change", () => this.drawing.setLayers({ [layer]: input.checked }));
      this.boxes[layer] = input;
      const key = make("kbd", "", { "aria-hidden": "true" }, `⇧${KEYS[layer]}`);
      box.append(make("label", "", { "data-layer": layer }, input, make("i", `lc-swatch lc-${layer}`), words[layer], key));
    }
    this.legend = new Legend(this.drawing);
    box.append(this.legend.element);
    const button = make("summary", "lc-button", { "aria-label": words.layers, title: words.layers }, icon("layers"));
    const menu = make("details", "lc-menu", {}, button, box);
    menu.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || !menu.open) return;
      menu.open = false;
      button.focus();
      event.stopPropagation();
    });
    stage.addEventListener("pointerdown", () => { menu.open = false; }, true);
    // A press on a label would take the focus from the menu and close it.
    box.addEventListener("mousedown", (event) => event.preventDefault());
    menu.addEventListener("focusout", (event) => { if (event.relatedTarget && !menu.contains(event.relatedTarget)) menu.open = false; });
    return menu;
  }

  _arrow(event, group) {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const buttons = [...group.children].filter((b) => !b.hidden), at = buttons.findIndex((b) => b.getAttribute("aria-checked") === "true");
    const next = buttons[(at + step + buttons.length) % buttons.length];
    next.click();
    next.focus();
  }

  /** Update mode and layers; hide unavailable ones. */
  update() {
    const { drawing } = this, { scenes, tracks } = drawing;
    this.modes.hidden = drawing.modes.length < 2;
    for (const button of this.modes.children) {
      const on = button.dataset.mode === drawing.seenMode;
      button.hidden = !drawing.offers(button.dataset.mode);
      button.setAttribute("aria-checked", on);
      button.tabIndex = on ? 0 : -1;
    }
    this.spaces.hidden = !drawing.solid?.offered;
    for (const button of this.spaces.children) {
      const on = button.dataset.space === drawing.space;
      button.setAttribute("aria-checked", on);
      button.tabIndex = on ? 0 : -1;
    }
    this.menu.hidden = drawing.sees === "solid"; // layers apply to the plan only
    this.measure.setAttribute("aria-pressed", drawing.measure.on || Boolean(drawing.solid?.marks.on));
    this.legend.update();
    const has = {
      whole: scenes.whole, travel: drawing.placement.travel, origin: !drawing.unitless,
      pheromone: scenes.pheromone, kerf: (scenes.after ?? scenes.before)?.header.kerf > 0,
      cleared: (scenes.after ?? scenes.before)?.header.cleared > 0, issues: scenes.part?.issue.length, differences: scenes.differences?.marks,
    };
    for (const [layer, input] of Object.entries(this.boxes)) {
      input.checked = drawing.layers[layer];
      input.parentElement.hidden = layer in has && !has[layer];
    }
  }
}
