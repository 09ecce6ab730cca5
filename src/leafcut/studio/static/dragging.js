// Dragging of objects in the drawing, and their drop targets.

/** Start dragging program zero if it is movable, or a pierce or a stop if the order can be edited. */
export function grab(drawing, pane, px, py) {
  const { view, placement } = drawing, reach = 9 / view.scale, x = view.mmX(px), y = view.mmY(py);
  if (drawing.measure.on) return;
  if (placement.grab(px, py)) {
    pane.drag = { what: "origin", from: [0, 0], to: [0, 0] };
    return;
  }
  if (!drawing.editable || !pane.main) return;
  const { scene } = pane.main;
  if (pane.edited) {
    const found = pane.edited.near(x, y, reach), what = scene.pierce.length ? "pierce" : "order";
    if (found) pane.drag = { what, ...found, to: found.from };
    return;
  }
  const pierced = scene.pierceNear(x, y, reach);
  if (pierced) {
    pane.drag = { what: "pierce", ...pierced, to: pierced.from };
    return;
  }
  const stop = pane.stopNear(x, y, reach);
  if (stop < 0) return;
  const from = [scene.stopPlace(stop)[0] + scene.origin[0], scene.stopPlace(stop)[1] + scene.origin[1]];
  pane.drag = { what: "order", number: stop + 1, row: scene.stop[stop], from, to: from };
}

/** Return the number of the stop or pierce on which an object was dropped, or null. */
export function droppedOn({ view }, pane, drag) {
  const reach = 12 / view.scale, [x, y] = drag.to;
  if (pane.edited) return pane.edited.near(x, y, reach)?.number || null;
  return (drag.what === "pierce" ? pane.main.scene.pierceNear(x, y, reach)?.number : pane.stopNear(x, y, reach) + 1) || null;
}
