// Input of a pane of the plan.

import { listen } from "./gestures.js";
import { LAYERS } from "./toolbar.js";

/** @import { Drawing } from "./canvas.js" */
/** @import { Pane } from "./pane.js" */

const PAN_STEP = 0.12; // fraction of the pane per key press

/** Handle the input of a pane: hover, selection and dragging.
 * @param {Pane} pane @param {Drawing} drawing */
export function listenToPane(pane, drawing) {
  const { view } = pane, fit = () => drawing.fit();
  listen(pane.canvas, drawing, view, {
    hover: (px, py) => drawing.point(pane, px, py),
    leave: () => drawing.hover(pane, null),
    press: (event, [px, py], first) => {
      if (first && event.button === 0) drawing.grab(pane, px, py);
      return event.button <= 1;
    },
    drag: (dx, dy, [px, py], moved) => {
      if (pane.drag) drawing.dragTo(pane, px, py);
      else if (moved) view.pan(dx, dy);
    },
    release: (cancelled) => { if (pane.drag) drawing.drop(pane, cancelled); },
    click: (px, py) => drawing.choose(pane, px, py),
    keys: () => {
      const dx = PAN_STEP * view.width, dy = PAN_STEP * view.height, { measure } = drawing;
      return {
        ArrowLeft: () => view.pan(dx, 0), ArrowRight: () => view.pan(-dx, 0), ArrowUp: () => view.pan(0, dy), ArrowDown: () => view.pan(0, -dy),
        0: fit, f: fit, Home: fit, d: () => measure.toggle(undefined, true), ...(measure.on && { Enter: () => measure.take() }),
      };
    },
    layer: (letter) => {
      const [layer] = LAYERS.find(([, key]) => key.toLowerCase() === letter) ?? [];
      return layer ? () => drawing.setLayers({ [layer]: !drawing.layers[layer] }) : null;
    },
    escape: () => drawing.escape(),
  });
}
