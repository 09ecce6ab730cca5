// Boxes: smallest x and y, largest x and y, mm.

/** @typedef {[number, number]} Point */
/** @typedef {[number, number, number, number]} Box */

/** Return a box without points.
 * @returns {Box} */
export function emptyBox() { return [Infinity, Infinity, -Infinity, -Infinity]; }

/** Extend a box by a point, or by a second box.
 * @param {Box} box @param {number} x0 @param {number} y0 */
export function widen(box, x0, y0, x1 = x0, y1 = y0) {
  if (x0 < box[0]) box[0] = x0;
  if (y0 < box[1]) box[1] = y0;
  if (x1 > box[2]) box[2] = x1;
  if (y1 > box[3]) box[3] = y1;
}

/** Return the box around all boxes that are known, or null.
 * @param {Iterable<Box | null | undefined>} boxes @returns {Box | null} */
export function boxAround(boxes) {
  const all = emptyBox();
  for (const box of boxes) if (box) widen(all, ...box);
  return all[0] <= all[2] ? all : null;
}

/** Return the length of the diagonal, at least 0.001 mm.
 * @param {Box | null} box */
export function diagonal(box) { return box ? Math.max(Math.hypot(box[2] - box[0], box[3] - box[1]), 1e-3) : Math.SQRT2; }

/** Return whether a box, relative to an origin, is partly within a visible range that is `margin` mm larger.
 * @param {Box} box @param {Point} origin @param {Box} seen */
export function isVisible([x0, y0, x1, y1], [ox, oy], seen, margin = 0) {
  return x0 + ox - margin <= seen[2] && x1 + ox + margin >= seen[0] && y0 + oy - margin <= seen[3] && y1 + oy + margin >= seen[1];
}
