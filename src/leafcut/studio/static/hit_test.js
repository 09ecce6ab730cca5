// Search for objects near the pointer: a grid of cells with the objects that pass through.

/** @import { Box, Point } from "./boxes.js" */
/** @import { ToolpathScene } from "./scene.js" */

const MOST_CELLS = 1 << 18;

/** A grid over the straight segments of items. */
export class Grid {
  /** `trace(k, put)` calls put for every straight segment of item k; a point is a segment, too.
   * @param {Box} extents @param {number} items
   * @param {(item: number, put: (x0: number, y0: number, x1: number, y1: number) => void) => void} trace */
  constructor(extents, items, trace) {
    const [x0, y0, x1, y1] = extents;
    const width = Math.max(x1 - x0, 1e-6), height = Math.max(y1 - y0, 1e-6);
    const cells = Math.min(Math.max(items, 16), MOST_CELLS);
    this.size = Math.max(Math.sqrt((width * height) / cells), Math.max(width, height) / 2048);
    this.x0 = x0;
    this.y0 = y0;
    this.columns = Math.max(Math.ceil(width / this.size), 1);
    this.rows = Math.max(Math.ceil(height / this.size), 1);
    const counts = new Uint32Array(this.columns * this.rows + 1);
    this._fill(items, trace, (cell) => { counts[cell + 1]++; });
    for (let k = 1; k < counts.length; k++) counts[k] += counts[k - 1];
    this.first = counts;
    this.items = new Uint32Array(counts[counts.length - 1]);
    const next = counts.slice();
    this._fill(items, trace, (cell, item) => { this.items[next[cell]++] = item; });
  }

  /** @param {number} x */
  _column(x) { return Math.min(Math.max(Math.floor((x - this.x0) / this.size), 0), this.columns - 1); }
  /** @param {number} y */
  _row(y) { return Math.min(Math.max(Math.floor((y - this.y0) / this.size), 0), this.rows - 1); }

  /** Call put(cell, item) for every cell that a straight segment passes.
   * @param {number} items @param {ConstructorParameters<typeof Grid>[2]} trace
   * @param {(cell: number, item: number) => void} put */
  _fill(items, trace, put) {
    for (let item = 0; item < items; item++) {
      trace(item, (x0, y0, x1, y1) => {
        if (!(x0 === x0 && x1 === x1 && y0 === y0 && y1 === y1)) return;
        if (x1 < x0) [x0, y0, x1, y1] = [x1, y1, x0, y0];
        const last = this._column(x1);
        for (let column = this._column(x0); column <= last; column++) {
          // The section of the segment within this column determines the rows.
          const left = this.x0 + column * this.size, right = left + this.size;
          const from = x1 > x0 ? y0 + ((y1 - y0) * (Math.max(left, x0) - x0)) / (x1 - x0) : y0;
          const to = x1 > x0 ? y0 + ((y1 - y0) * (Math.min(right, x1) - x0)) / (x1 - x0) : y1;
          const low = this._row(Math.min(from, to)), high = this._row(Math.max(from, to));
          for (let row = low; row <= high; row++) put(row * this.columns + column, item);
        }
      });
    }
  }

  /** Yield every item that may be within `reach` of (x, y); items may repeat.
   * @param {number} x @param {number} y @param {number} reach */
  *around(x, y, reach) {
    const left = this._column(x - reach), right = this._column(x + reach);
    const low = this._row(y - reach), high = this._row(y + reach);
    for (let row = low; row <= high; row++) {
      for (let column = left; column <= right; column++) {
        const cell = row * this.columns + column;
        for (let k = this.first[cell]; k < this.first[cell + 1]; k++) yield this.items[k];
      }
    }
  }
}

/** Return a grid of points; `place(k)` is a point relative to the origin.
 * @param {{ origin: Point, extents: Box | null }} scene @param {number} count @param {(k: number) => Point} place */
export function gridOfPoints(scene, count, place) {
  return new Grid(relative(scene), count, (k, put) => {
    const [x, y] = place(k);
    put(x, y, x, y);
  });
}

/** Return the grid of a toolpath's moves, with arcs as short chords.
 * @param {ToolpathScene} scene */
export function gridOfMoves(scene) {
  return new Grid(relative(scene), scene.rows, (row, put) => {
    if (!scene.moves(row)) return;
    const arc = scene.arcAt(row);
    if (!arc) {
      put(scene.x0(row), scene.y0(row), scene.x1(row), scene.y1(row));
      return;
    }
    let [x, y] = [scene.x0(row), scene.y0(row)];
    const pieces = Math.min(Math.max(Math.ceil(Math.abs(arc[4]) * 4), 1), 64);
    for (let k = 1; k <= pieces; k++) {
      const [nx, ny] = scene.along(row, k / pieces);
      put(x, y, nx, ny);
      [x, y] = [nx, ny];
    }
  });
}

/** @param {{ origin: Point, extents: Box | null }} scene @returns {Box} */
function relative({ origin: [ox, oy], extents }) {
  const e = extents ?? [0, 0, 1, 1];
  return [e[0] - ox, e[1] - oy, e[2] - ox, e[3] - oy];
}

/** Return the distance of (x, y) from a move.
 * @param {ToolpathScene} scene @param {number} row @param {number} x @param {number} y */
export function distanceToMove(scene, row, x, y) {
  const arc = scene.arcAt(row), x0 = scene.x0(row), y0 = scene.y0(row), x1 = scene.x1(row), y1 = scene.y1(row);
  if (!arc) return distanceToLine(x, y, x0, y0, x1, y1);
  const angle = Math.atan2(y - arc[1], x - arc[0]), full = 2 * Math.PI;
  const ahead = ((((angle - arc[3]) * Math.sign(arc[4])) % full) + full) % full;
  if (ahead <= Math.abs(arc[4])) return Math.abs(Math.hypot(x - arc[0], y - arc[1]) - arc[2]);
  return Math.min(Math.hypot(x - x0, y - y0), Math.hypot(x - x1, y - y1));
}

/** Return the distance of (x, y) from a straight segment.
 * @param {number} x @param {number} y @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
function distanceToLine(x, y, x0, y0, x1, y1) {
  const dx = x1 - x0, dy = y1 - y0, square = dx * dx + dy * dy;
  const share = square > 0 ? Math.min(Math.max(((x - x0) * dx + (y - y0) * dy) / square, 0), 1) : 0;
  return Math.hypot(x - x0 - share * dx, y - y0 - share * dy);
}
