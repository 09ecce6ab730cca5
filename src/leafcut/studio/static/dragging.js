// Dragging of objects in the drawing, and their drop targets.

/** @import { Point } from "./boxes.js" */
/** @import { Drawing } from "./canvas.js" */
/** @import { Pane } from "./pane.js" */
/** A dragged object with its number, and its positions, mm.
 * @typedef {{ what: "origin" | "pierce" | "order", number?: number, row?: number, from: Point, to: Point }} Drag */

/** Return program zero if it is movable, or a pierce or a stop if the order can be edited, for dragging; null for none.
 * @param {Drawing} drawing @param {Pane} pane @param {number} px @param {number} py @returns {Drag | null} */
export function grab({ view, placement, measure, editable }, pane, px, py) {
  const reach = 9 / view.scale, x = view.mmX(px), y = view.mmY(py), { main, edited } = pane;
  if (measure.on) return null;
  if (placement.over(px, py)) return { what: "origin", from: [0, 0], to: [0, 0] };
  if (!editable || !main) return null;
  const { scene } = main, found = edited ? edited.near(x, y, reach) : scene.pierceNear(x, y, reach);
  if (found) return { what: scene.pierce.length ? "pierce" : "order", ...found, to: found.from };
  const stop = edited ? -1 : main.stopNear(x, y, reach);
  if (stop < 0) return null;
  const place = scene.stopPlace(stop), from = /** @type {Point} */ ([place[0] + scene.origin[0], place[1] + scene.origin[1]]);
  return { what: "order", number: stop + 1, row: scene.stop[stop], from, to: from };
}

/** Return the number of the stop or pierce on which an object was dropped, or null.
 * @param {Drawing} drawing @param {Pane} pane @param {Drag} drag */
export function droppedOn({ view }, { main, edited }, { what, to: [x, y] }) {
  const reach = 12 / view.scale;
  if (edited) return edited.near(x, y, reach)?.number || null;
  return (what === "pierce" ? main?.scene.pierceNear(x, y, reach)?.number : main && main.stopNear(x, y, reach) + 1) || null;
}
