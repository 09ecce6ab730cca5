// View of the stock: rotated about the vertical axis, from above, as a parallel projection.

/** @import { StockGrid } from "./sweep.js" */
/** Smallest x, y, z and largest x, y, z, mm.
 * @typedef {[number, number, number, number, number, number]} Block */
/** A section across "x" or "y" at a fraction of the length; "" for none.
 * @typedef {{ axis: string, share: number }} Section */
/** Box of the visible stock, and its side that a section cuts: "x0", "x1", "y0", "y1" or "".
 * @typedef {{ x0: number, y0: number, x1: number, y1: number, cut: string }} Cut */

const LOWEST = (8 * Math.PI) / 180, HIGHEST = Math.PI / 2;
const MARGIN = 0.08;

export class SolidCamera {
  constructor() {
    this.turn = 0; // rotation of the view to the left, rad
    this.height = 0.6; // elevation above the table, rad
    this.scale = 4; // pixels per mm
    this.x = this.y = this.z = 0; // centre of the view, mm
    this.width = this.height_px = 1;
    this.box = /** @type {Block} */ ([0, 0, 0, 1, 1, 1]);
    this.fitted = true;
    this.look("iso");
  }

  /** View everything from a side.
   * @param {"top" | "front" | "iso"} from */
  look(from) {
    [this.turn, this.height] = { top: [0, HIGHEST], front: [0, LOWEST], iso: [-0.62, 0.68] }[from];
    this.fit();
  }

  /** @param {number} width @param {number} height */
  resize(width, height) {
    this.width = Math.max(width, 1);
    this.height_px = Math.max(height, 1);
    if (this.fitted) this.fit();
  }

  /** Fit a box into the view. */
  fit(box = this.box) {
    this.box = box;
    [this.x, this.y, this.z] = [0, 1, 2].map((k) => (box[k] + box[k + 3]) / 2);
    this.scale = 1;
    let [left, low, right, high] = [Infinity, Infinity, -Infinity, -Infinity];
    for (let k = 0; k < 8; k++) {
      const [px, py] = this.project(box[k & 1 ? 3 : 0], box[k & 2 ? 4 : 1], box[k & 4 ? 5 : 2]);
      left = Math.min(left, px);
      right = Math.max(right, px);
      low = Math.min(low, py);
      high = Math.max(high, py);
    }
    this.scale = Math.min(this.width / (right - left), this.height_px / (high - low)) * (1 - 2 * MARGIN);
    this.fitted = true;
  }

  /** Rotate by pixels.
   * @param {number} dx @param {number} dy */
  orbit(dx, dy) {
    this.turn -= dx * 0.008;
    this.height = Math.min(Math.max(this.height + dy * 0.008, LOWEST), HIGHEST);
    if (this.fitted) this.fit();
  }

  /** Pan by pixels.
   * @param {number} dx @param {number} dy */
  pan(dx, dy) {
    const { axes, scale } = this, [rx, ry] = axes.right, [fx, fy] = axes.ahead, up = dy / scale;
    // Move across the table in a steep view, else up and down.
    const ahead = axes.sin > 0.25 ? up / axes.sin : 0, rise = axes.sin > 0.25 ? 0 : up / axes.cos;
    this.x += -(dx / scale) * rx + ahead * fx;
    this.y += -(dx / scale) * ry + ahead * fy;
    this.z += rise;
    this.fitted = false;
  }

  /** Zoom about (px, py).
   * @param {number} factor */
  zoom(factor, px = this.width / 2, py = this.height_px / 2) {
    const before = this.scale, largest = 1e4;
    this.scale = Math.min(Math.max(before * factor, 1e-3), largest);
    const by = this.scale / before;
    this.pan((px - this.width / 2) * (1 - by), (py - this.height_px / 2) * (1 - by));
  }

  /** Directions of the view: right and ahead on the table, and sine and cosine of the elevation. */
  get axes() {
    const c = Math.cos(this.turn), s = Math.sin(this.turn);
    return { right: [c, s], ahead: [-s, c], sin: Math.sin(this.height), cos: Math.cos(this.height) };
  }

  /** Return the screen position of a point, pixels, and its depth, mm.
   * @param {number} x @param {number} y @param {number} z @returns {[number, number, number]} */
  project(x, y, z) {
    const { right, ahead, sin, cos } = this.axes, dx = x - this.x, dy = y - this.y, dz = z - this.z;
    const across = dx * right[0] + dy * right[1], far = dx * ahead[0] + dy * ahead[1];
    return [this.width / 2 + across * this.scale, this.height_px / 2 - (far * sin + dz * cos) * this.scale, far * cos - dz * sin];
  }

  /** Return the point of the ray through a pixel in the view plane of the centre, and the direction of the ray.
   * @param {number} px @param {number} py */
  ray(px, py) {
    const { right, ahead, sin, cos } = this.axes;
    const u = (px - this.width / 2) / this.scale, v = (this.height_px / 2 - py) / this.scale;
    const from = [this.x + right[0] * u + ahead[0] * v * sin, this.y + right[1] * u + ahead[1] * v * sin, this.z + v * cos];
    return { from, way: [ahead[0] * cos, ahead[1] * cos, -sin] };
  }
}

/** Return the box of a stock without the part that a section removes in front.
 * @param {StockGrid} grid @param {Section} section @param {SolidCamera} camera @returns {Cut} */
export function sectioned(grid, { axis, share }, camera) {
  const half = grid.cell / 2, x0 = grid.x - half, y0 = grid.y - half;
  const x1 = x0 + grid.columns * grid.cell, y1 = y0 + grid.rows * grid.cell, box = { x0, y0, x1, y1, cut: "" };
  if (!axis) return box;
  const [ahead, at] = axis === "x" ? [camera.axes.ahead[0], x0 + share * (x1 - x0)] : [camera.axes.ahead[1], y0 + share * (y1 - y0)];
  const cut = ahead >= 0 ? `${axis}0` : `${axis}1`;
  return { ...box, cut, [cut]: at };
}

/** Return the intersection of a ray with the stock: x, y, z and the `column` and `row` of the cell, or null.
 * @param {SolidCamera} camera @param {{ grid: StockGrid, heights: Float32Array, floor: number, top: number }} stock
 * @param {Cut} box @param {number} px @param {number} py */
export function meet(camera, stock, box, px, py) {
  const { grid, heights, floor, top } = stock, { from, way } = camera.ray(px, py);
  let enters = -Infinity, leaves = Infinity;
  for (const [k, low, high] of [[0, box.x0, box.x1], [1, box.y0, box.y1], [2, floor, top + 1e-4]]) {
    if (Math.abs(way[k]) < 1e-9) {
      if (from[k] < low || from[k] > high) return null;
      continue;
    }
    const a = (low - from[k]) / way[k], b = (high - from[k]) / way[k];
    enters = Math.max(enters, Math.min(a, b));
    leaves = Math.min(leaves, Math.max(a, b));
  }
  if (enters >= leaves) return null;
  const { cell } = grid, x0 = grid.x - cell / 2, y0 = grid.y - cell / 2;
  for (let at = enters; at < leaves;) {
    const x = from[0] + way[0] * (at + 1e-7), y = from[1] + way[1] * (at + 1e-7);
    const column = Math.floor((x - x0) / cell), row = Math.floor((y - y0) / cell);
    if (column < 0 || row < 0 || column >= grid.columns || row >= grid.rows) return null;
    const outX = way[0] > 1e-9 ? (x0 + (column + 1) * cell - from[0]) / way[0] : way[0] < -1e-9 ? (x0 + column * cell - from[0]) / way[0] : Infinity;
    const outY = way[1] > 1e-9 ? (y0 + (row + 1) * cell - from[1]) / way[1] : way[1] < -1e-9 ? (y0 + row * cell - from[1]) / way[1] : Infinity;
    const next = Math.min(Math.max(Math.min(outX, outY), at + 1e-6), leaves), h = heights[row * grid.columns + column];
    const zIn = from[2] + way[2] * at, zOut = from[2] + way[2] * next;
    if (h > floor + 1e-6 && (zIn <= h || zOut <= h)) {
      const stop = zIn <= h ? at : (h - from[2]) / way[2];
      return { x: from[0] + way[0] * stop, y: from[1] + way[1] * stop, z: from[2] + way[2] * stop, column, row };
    }
    at = next;
  }
  return null;
}
