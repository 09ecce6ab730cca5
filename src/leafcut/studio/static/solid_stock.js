// The stock at any time of a program: cut move by move, with snapshots for going back.
//
// Memory: SNAPSHOTS states of 8 bytes per cell; a stock of 512 × 512 cells takes 45 MB at most, plus 44 bytes per move.

import { firstWhere } from "./search.js";
import { sweep } from "./sweep.js";

/** @import { Box } from "./boxes.js" */
/** @import { Shape, StockGrid } from "./sweep.js" */
/** @typedef {{ grid: StockGrid, top: number, floor: number, tools: Record<string, { shape: Shape }> }} StockHeader */
/** Changed cells: first column and row, end column and row, and their values.
 * @typedef {{ rect: Box, heights: Float32Array, by: Uint32Array }} Change */
/** Straight moves and the start of the stock (studio/drawing/solid.py).
 * @typedef {{
 *   move: Float32Array, since: Float64Array, until: Float64Array, row: Uint32Array, cutter: Uint32Array,
 *   rapid: Uint8Array, start?: Float32Array,
 * }} StockBlocks */

const SNAPSHOTS = 16;
/** Reduction of the tool radius for rapids, in cells (material/cutting.py). */
const RAPID_INSET = 1;

/** Stock of a scene of the kind "solid". */
export class SolidStock {
  /** @param {StockHeader} header @param {StockBlocks} blocks */
  constructor(header, blocks) {
    const { grid, grid: { rows, columns } } = header;
    this.grid = grid;
    this.rows = rows;
    this.columns = columns;
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

  /** Return the changes since the last call: `rect` (first column and row, end column and row) with `heights` and
   * `by` of its cells; null for none.
   * @returns {Change | null} */
  changes() {
    const [c0, r0, c1, r1] = this.dirty;
    this.dirty = [this.columns, this.rows, 0, 0];
    if (c1 <= c0 || r1 <= r0) return null;
    const rect = /** @type {Box} */ ([c0, r0, c1, r1]);
    return { rect, heights: this._part(this.heights, rect), by: this._part(this.by, rect) };
  }

  /** Return the cells within a rectangle.
   * @template {Float32Array | Uint32Array} T @param {T} from @param {Box} rect @returns {T} */
  _part(from, [c0, r0, c1, r1]) {
    const width = c1 - c0, out = /** @type {T} */ (from.slice(0, width * (r1 - r0)));
    for (let row = r0; row < r1; row++) out.set(from.subarray(row * this.columns + c0, row * this.columns + c1), (row - r0) * width);
    return out;
  }
}

/** Return the heights of the cells before the first move.
 * @param {StockHeader} header @param {StockBlocks} blocks */
export function startOf({ top, grid }, { start }) {
  return start?.length ? Float32Array.from(start) : new Float32Array(grid.rows * grid.columns).fill(top);
}
