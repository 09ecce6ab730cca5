// The stock at any time of a program: cut move by move, with snapshots for going back, and its relief.
//
// Memory: SNAPSHOTS states of 8 bytes per cell; with fields, relief and input, a stock of 512 × 512 cells takes 47 MB
// at most, plus 44 bytes per move.

import { firstWhere } from "./search.js";
import { sweep } from "./sweep.js";

/** @import { Box } from "./boxes.js" */
/** @import { Shape, StockGrid } from "./sweep.js" */
/** @typedef {{ grid: StockGrid, top: number, floor: number, tools: Record<string, { shape: Shape }> }} StockHeader */
/** Changed cells: first column and row, end column and row, and their values.
 * @typedef {{ rect: Box, heights: Float32Array, by: Uint32Array, relief: Uint32Array }} Change */
/** Straight moves and the start of the stock (studio/drawing/solid.py).
 * @typedef {{
 *   move: Float32Array, since: Float64Array, until: Float64Array, row: Uint32Array, cutter: Uint32Array,
 *   rapid: Uint8Array, start?: Float32Array,
 * }} StockBlocks */

const SNAPSHOTS = 16;
/** Reduction of the tool radius for rapids, in cells (material/cutting.py). */
const RAPID_INSET = 1;
/** Radii for the relief of a cell, in cells: direction of a wall, rim, near shade and far shade. */
const FACING = 3, RIM = 1, NEAR = 5, FAR = 18;
/** Minimum gradient of a cliff, mm per mm, which is not part of a slope. */
const CLIFF = 2.5;

/** Stock of a scene of the kind "solid". */
export class SolidStock {
  /** @param {StockHeader} header @param {StockBlocks} blocks */
  constructor(header, blocks) {
    const { grid, grid: { rows, columns } } = header;
    this.grid = grid;
    this.rows = rows;
    this.columns = columns;
    this.floor = header.floor;
    this.blocks = blocks;
    this.moves = blocks.row.length;
    this.heights = startOf(header, blocks);
    this.first = this.heights.slice();
    this.by = new Uint32Array(rows * columns);
    /** @type {Record<string, Float64Array>} */
    this.shapes = Object.fromEntries(Object.entries(header.tools).map(([number, tool]) => [number, Float64Array.from(tool.shape)]));
    this.done = 0; // number of completed moves
    this.share = 0; // completed fraction of the next move
    /** @type {Box} */
    this.dirty = [0, 0, columns, rows];
    /** @type {Map<number, { heights: Float32Array, by: Uint32Array }>} */
    this.kept = new Map();
    this.keepAt = this._planSnapshots();
  }

  /** Return the moves before which snapshots are taken, with equal work between them. */
  _planSnapshots() {
    const { moves, grid, blocks: { move, cutter } } = this, work = new Float64Array(moves + 1);
    for (let k = 0; k < moves; k++) {
      const at = 6 * k, radius = this.shapes[cutter[k]][0], length = Math.hypot(move[at + 3] - move[at], move[at + 4] - move[at + 1]);
      work[k + 1] = work[k] + 50 + (2 * radius * (length + 1.6 * radius)) / grid.cell ** 2;
    }
    const keepAt = new Set();
    for (let k = 1, piece = work[moves] / (SNAPSHOTS + 1), next = piece; k <= moves && piece > 0; k++) {
      if (work[k] < next) continue;
      keepAt.add(k);
      while (next <= work[k]) next += piece;
    }
    return keepAt;
  }

  /** Return the number of moves completed at a time, and the completed fraction of the next move.
   * @param {number} time */
  at(time) {
    const { since, until } = this.blocks, move = firstWhere(this.moves, (k) => until[k] > time);
    if (move === this.moves) return [move, 0];
    const begins = since[move], takes = until[move] - begins;
    return [move, takes > 0 ? Math.min(Math.max((time - begins) / takes, 0), 1) : 0];
  }

  /** Cut, or go back, towards the state at a time, for at most `budget` ms; return whether it is reached.
   * @param {number} time */
  seek(time, budget = Infinity) {
    const [count, share] = this.at(time), ends = performance.now() + budget;
    if (count < this.done || (count === this.done && share < this.share)) this._back(count);
    while (this.done < count) {
      this._cut(this.done, 1);
      this.done++;
      this.share = 0;
      if (this.keepAt.has(this.done) && !this.kept.has(this.done)) {
        this.kept.set(this.done, { heights: this.heights.slice(), by: this.by.slice() });
      }
      if ((this.done & 31) === 0 && performance.now() > ends) return false;
    }
    if (share > this.share) {
      this._cut(this.done, share);
      this.share = share;
    }
    return true;
  }

  /** Go back to the last snapshot up to a number of moves.
   * @param {number} count */
  _back(count) {
    const from = Math.max(0, ...[...this.kept.keys()].filter((k) => k <= count)), state = this.kept.get(from);
    if (state) {
      this.heights.set(state.heights);
      this.by.set(state.by);
    } else {
      this.heights.set(this.first);
      this.by.fill(0);
    }
    this.done = from;
    this.share = 0;
    this.dirty = [0, 0, this.columns, this.rows];
  }

  /** @param {number} k @param {number} share */
  _cut(k, share) {
    const { grid, blocks: { move, cutter, rapid } } = this, [x, y, z, ...end] = move.subarray(6 * k, 6 * k + 6);
    const [x1, y1, z1] = share === 1 ? end : [x, y, z].map((from, axis) => from + share * (end[axis] - from));
    const inset = rapid[k] ? RAPID_INSET * grid.cell : 0;
    sweep(this.heights, this.by, grid, this.shapes[cutter[k]], x, y, z, x1, y1, z1, inset, k + 1, this.dirty);
  }

  /** Return the changes since the last call: `rect` (first column and row, end column and row) with `heights`, `by`
   * and `relief` of its cells; null for none.
   * @returns {Change | null} */
  changes() {
    const [c0, r0, c1, r1] = this.dirty;
    this.dirty = [this.columns, this.rows, 0, 0];
    if (c1 <= c0 || r1 <= r0) return null;
    const rect = /** @type {Box} */ ([Math.max(c0 - FAR, 0), Math.max(r0 - FAR, 0), Math.min(c1 + FAR, this.columns), Math.min(r1 + FAR, this.rows)]);
    return { rect, heights: this._part(this.heights, rect), by: this._part(this.by, rect), relief: this._relief(rect) };
  }

  /** Return the cells within a rectangle.
   * @template {Float32Array | Uint32Array} T @param {T} from @param {Box} rect @returns {T} */
  _part(from, [c0, r0, c1, r1]) {
    const width = c1 - c0, out = /** @type {T} */ (from.slice(0, width * (r1 - r0)));
    for (let row = r0; row < r1; row++) out.set(from.subarray(row * this.columns + c0, row * this.columns + c1), (row - r0) * width);
    return out;
  }

  /** Return four bytes per cell: x and y of its normal, direction of a wall, and its lightness from the surroundings.
   * @param {Box} rect */
  _relief([c0, r0, c1, r1]) {
    const { columns, rows, floor, grid: { cell } } = this, width = c1 - c0, height = r1 - r0;
    const wide = /** @type {Box} */ ([Math.max(c0 - FAR - 1, 0), Math.max(r0 - FAR - 1, 0), Math.min(c1 + FAR + 1, columns), Math.min(r1 + FAR + 1, rows)]);
    const part = this._part(this.heights, wide), w = wide[2] - wide[0], h = wide[3] - wide[1];
    for (let k = 0; k < part.length; k++) if (part[k] < floor) part[k] = floor;
    const sums = summed(part, w, h), [facing, rim, near, far] = [FACING, RIM, NEAR, FAR].map((reach) => blurred(sums, w, h, reach));
    const out = new Uint32Array(width * height), edge = (/** @type {number} */ v, /** @type {number} */ most) => (v < 0 ? 0 : v > most ? most : v);
    for (let row = 0; row < height; row++) {
      const y = row + r0 - wide[1], up = edge(y + 1, h - 1) * w, down = edge(y - 1, h - 1) * w, mid = y * w;
      for (let column = 0; column < width; column++) {
        const x = column + c0 - wide[0], right = edge(x + 1, w - 1), left = edge(x - 1, w - 1), here = part[mid + x];
        const sx = slope((here - part[mid + left]) / cell, (part[mid + right] - here) / cell, (facing[mid + right] - facing[mid + left]) / (2 * cell));
        const sy = slope((here - part[down + x]) / cell, (part[up + x] - here) / cell, (facing[up + x] - facing[down + x]) / (2 * cell));
        const long = 1 / Math.sqrt(1 + sx * sx + sy * sy);
        const further = edge(x + 2, w - 1), before = edge(x - 2, w - 1), above = edge(y + 2, h - 1) * w, below = edge(y - 2, h - 1) * w;
        const gx = facing[mid + further] - facing[mid + before], gy = facing[above + x] - facing[below + x];
        const turn = Math.atan2(-gy, -gx) / (2 * Math.PI);
        const light = lightness(here - rim[mid + x], here - near[mid + x], here - far[mid + x], cell);
        out[row * width + column] = (Math.round(-sx * long * 127) & 255) | ((Math.round(-sy * long * 127) & 255) << 8)
          | ((Math.round(turn * 256) & 255) << 16) | (Math.round(light * 200) << 24);
      }
    }
    return out;
  }
}

/** Return the heights of the cells before the first move.
 * @param {StockHeader} header @param {StockBlocks} blocks */
export function startOf({ top, grid }, { start }) {
  return start?.length ? Float32Array.from(start) : new Float32Array(grid.rows * grid.columns).fill(top);
}

/** Return the gradient at a cell from the gradients on both sides: at a cliff the smaller of both, elsewhere `smooth`
 * if it is close to their mean, else the mean. `smooth` hides ridges finer than the cells.
 * @param {number} before @param {number} after @param {number} smooth */
function slope(before, after, smooth) {
  const one = Math.abs(before), other = Math.abs(after), mean = 0.5 * (before + after);
  if (one >= CLIFF || other >= CLIFF) return one < other ? before : after;
  return Math.abs(smooth - mean) < 0.25 + Math.abs(mean) ? smooth : mean;
}

/** Return the lightness of a cell, 0 to 1.2: dark at the foot of a wall, slightly lighter at an upper edge.
 * @param {number} over @param {number} overNear @param {number} overFar @param {number} cell */
function lightness(over, overNear, overFar, cell) {
  const under = (/** @type {number} */ v, /** @type {number} */ reach) => (v < 0 ? -v / (-v + 1.3 * reach * cell) : 0);
  const rim = over > 0 ? over / (over + 3 * cell) : 0;
  return Math.max(1 - 0.34 * under(overNear, NEAR) - 0.3 * under(overFar, FAR) - 0.1 * under(over, RIM) + 0.09 * rim, 0.12);
}

/** Return the summed-area table of the cells.
 * @param {Float32Array} values @param {number} width @param {number} height */
function summed(values, width, height) {
  const sums = new Float64Array((width + 1) * (height + 1));
  for (let y = 0; y < height; y++) {
    let row = 0;
    for (let x = 0, at = (y + 1) * (width + 1) + 1; x < width; x++, at++) {
      row += values[y * width + x];
      sums[at] = sums[at - width - 1] + row;
    }
  }
  return sums;
}

/** Return the mean of a square around each cell.
 * @param {Float64Array} sums @param {number} width @param {number} height @param {number} reach */
function blurred(sums, width, height, reach) {
  const out = new Float32Array(width * height), long = width + 1;
  for (let y = 0; y < height; y++) {
    const y0 = Math.max(y - reach, 0) * long, y1 = Math.min(y + reach + 1, height) * long;
    for (let x = 0; x < width; x++) {
      const x0 = Math.max(x - reach, 0), x1 = Math.min(x + reach + 1, width);
      out[y * width + x] = (sums[y1 + x1] - sums[y1 + x0] - sums[y0 + x1] + sums[y0 + x0]) / (((y1 - y0) / long) * (x1 - x0));
    }
  }
  return out;
}
