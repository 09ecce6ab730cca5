// Buttons above the drawing: modes, layers, zoom and fit.

import { Legend } from "./legend.js";
import { icon, iconButton, make } from "./icons.js";
import { SPACES } from "./solid_kept.js";

/** @import { Drawing } from "./canvas.js" */

export const MODES = ["before", "after", "side", "overlay"];
/** Layers, each with its letter, which is used with Shift. */
export const LAYERS = [
  ["rapids", "R"], ["cuts", "C"], ["holes", "H"], ["whole", "D"], ["numbers", "N"], ["arrows", "A"], ["extents", "E"],
  ["issues", "I"], ["pheromone", "P"], ["differences", "V"], ["kerf", "K"], ["cleared", "W"], ["travel", "T"],
  ["origin", "O"], ["grid", "G"],
];

export class Toolbar {
  /** @param {HTMLElement} host @param {Drawing} drawing */
  constructor(host, drawing) {
    this.drawing = drawing;
    const { words } = drawing;
    this.modes = new Choice("mode", words.compare, MODES.map((mode) => [mode, words[mode]]), (mode) => drawing.setMode(mode));
    this.spaces = new Choice("space", words.space, SPACES.map((space) => [space, words[`space_${space}`]]), (space) => drawing.setSpace(space));
    /** @type {Record<string, HTMLInputElement>} */
    this.boxes = {};
    this.legend = new Legend(drawing);
    this.menu = this._layers(drawing);
    const zoom = (/** @type {string} */ name, /** @type {number} */ factor) => iconButton(name, words[name], () => drawing.zoom(factor));
    const group = make(
      "div", "lc-group", {}, zoom("zoomOut", 1 / 1.4), zoom("zoomIn", 1.4), iconButton("fit", words.fit, () => drawing.fit()),
    );
    this.measure = iconButton("measure", words.measureTip, () => drawing.toggleMeasure());
    host.append(this.modes.group, this.spaces.group, make("span", "lc-room"), make("div", "lc-group", {}, this.measure), this.menu, group);
  }

  /** @param {Drawing} drawing */
  _layers({ words, stage }) {
    const box = make("div", "lc-layers", { role: "group", "aria-label": words.layers });
    for (const [layer, letter] of LAYERS) {
      const input = make("input", "", { type: "checkbox" });
      input.addEventListener("change", () => this.drawing.setLayers({ [layer]: input.checked }));
      this.boxes[layer] = input;
      const key = make("kbd", "", { "aria-hidden": "true" }, `⇧${letter}`);
      box.append(make("label", "", { "data-layer": layer }, input, make("i", `lc-swatch lc-${layer}`), words[layer], key));
    }
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
    menu.addEventListener("focusout", ({ relatedTarget: to }) => { if (to instanceof Node && !menu.contains(to)) menu.open = false; });
    return menu;
  }

  /** Update mode and layers; hide unavailable ones. */
  update() {
    const { drawing } = this, { scenes } = drawing;
    this.modes.group.hidden = drawing.modes.length < 2;
    this.modes.update(drawing.seenMode, (mode) => drawing.offers(mode));
    this.spaces.group.hidden = !drawing.solid.offered;
    this.spaces.update(drawing.space);
    this.menu.hidden = drawing.sees === "solid"; // layers apply to the plan only
    this.measure.setAttribute("aria-pressed", String(drawing.measure.on || drawing.solid.marks.on));
    this.legend.update();
    const { header } = (drawing.tracks.after ?? drawing.tracks.before)?.scene ?? {};
    /** @type {Record<string, unknown>} */
    const has = {
      whole: scenes.whole, travel: drawing.placement.travel, origin: !drawing.unitless,
      pheromone: scenes.pheromone, kerf: header?.kerf > 0, cleared: header?.cleared > 0,
      issues: scenes.part?.issue.length, differences: scenes.differences?.marks,
    };
    for (const [layer, input] of Object.entries(this.boxes)) {
      input.checked = drawing.layers[layer];
      const label = /** @type {HTMLElement} */ (input.parentElement);
      label.hidden = layer in has && !has[layer];
    }
  }
}

/** Radio buttons in a row; the page handles their arrow keys (focus.js). */
class Choice {
  /** @param {string} name @param {string} label @param {string[][]} choices @param {(value: string) => void} choose */
  constructor(name, label, choices, choose) {
    this.buttons = choices.map(([value, text]) => {
      const button = make("button", "lc-mode", { type: "button", role: "radio", [`data-${name}`]: value, value }, text);
      button.addEventListener("click", () => choose(value));
      return button;
    });
    this.group = make("div", "lc-modes", { role: "radiogroup", "aria-label": label }, ...this.buttons);
  }

  /** Check one of the buttons and hide those that are not offered.
   * @param {string} value @param {(value: string) => boolean} offers */
  update(value, offers = () => true) {
    for (const button of this.buttons) {
      const on = button.value === value;
      button.hidden = !offers(button.value);
      button.setAttribute("aria-checked", String(on));
      button.tabIndex = on ? 0 : -1;
    }
  }
}
