// Outlines as cached Path2D, split into pieces with levels of detail.

import { emptyBox, isVisible, widen } from "./boxes.js";
import { Levels, Pen } from "./pen.js";

/** @import { Box } from "./boxes.js" */
/** @import { PartScene } from "./scene.js" */
/** @typedef {{ numbers: number[], vertices: number, box: Box, levels: [Path2D, number][] }} Piece */

const VERTICES = 1024; // vertices per piece
const VISIBLE = 0.4; // smallest visible deviation, pixels
const STRAIGHT = 1e-9; // bulge of a straight line

/** Outlines of a part with the given indices. */
export class OutlinePaths {
  /** @param {PartScene} part @param {number[]} numbers */
  constructor(part, numbers) {
    this.part = part;
    this.numbers = numbers;
    this.levels = new Levels(part.extents, VISIBLE);
    /** @type {Piece[]} */
    this.pieces = [];
    /** @type {Path2D | null} */
    this._whole = null;
    for (const number of numbers) {
      let piece = this.pieces.at(-1);
      if (!piece || piece.vertices >= VERTICES) {
        piece = { numbers: [], vertices: 0, box: emptyBox(), levels: [] };
        this.pieces.push(piece);
      }
      piece.numbers.push(number);
      piece.vertices += part.outlineAt(number).count;
      widen(piece.box, ...boxOf(part, number));
    }
  }

  /** All outlines as one exact path, for filling. */
  get whole() { return (this._whole ??= traced(this.part, this.numbers, 0)[0]); }

  /** Yield a Path2D with its drawing cost, in segments, for every visible piece.
   * @param {Box} seen @param {number} scale */
  *visible(seen, scale) {
    const level = this.levels.at(scale);
    for (const piece of this.pieces) {
      if (isVisible(piece.box, this.part.origin, seen)) {
        yield (piece.levels[level] ??= traced(this.part, piece.numbers, this.levels.tolerance(level)));
      }
    }
  }
}

/** @param {PartScene} part @param {number[]} numbers @param {number} tolerance @returns {[Path2D, number]} */
function traced(part, numbers, tolerance) {
  const pen = new Pen(tolerance);
  for (const number of numbers) {
    traceOutline(part, number, pen);
    pen.finish();
  }
  return [pen.path, pen.count + numbers.length];
}

/** @param {PartScene} part @param {number} number @param {Pen} pen */
function traceOutline(part, number, pen) {
  const { first, count, closed } = part.outlineAt(number), v = part.vertex;
  for (let k = 0; k < (closed ? count : count - 1); k++) {
    const a = 3 * (first + k), b = 3 * (first + ((k + 1) % count)), bulge = v[a + 2];
    if (Math.abs(bulge) < STRAIGHT) {
      pen.to(v[a], v[a + 1], v[b], v[b + 1]);
      continue;
    }
    const off = (1 - bulge * bulge) / (4 * bulge), dx = v[b] - v[a], dy = v[b + 1] - v[a + 1];
    const cx = (v[a] + v[b]) / 2 - off * dy, cy = (v[a + 1] + v[b + 1]) / 2 + off * dx;
    const start = Math.atan2(v[a + 1] - cy, v[a] - cx);
    pen.arc(cx, cy, Math.hypot(v[a] - cx, v[a + 1] - cy), start, 4 * Math.atan(bulge), v[a], v[a + 1], v[b], v[b + 1]);
  }
}

/** Return a box around an outline, from its vertices and the largest possible excess of its arcs.
 * @param {PartScene} part @param {number} number */
export function boxOf(part, number) {
  const { first, count } = part.outlineAt(number), v = part.vertex, box = emptyBox();
  for (let k = 0; k < count; k++) {
    const a = 3 * (first + k), b = 3 * (first + ((k + 1) % count));
    const beyond = 0.5 * Math.abs(v[a + 2]) * Math.hypot(v[b] - v[a], v[b + 1] - v[a + 1]);
    for (const at of [a, b]) widen(box, v[at] - beyond, v[at + 1] - beyond, v[at] + beyond, v[at + 1] + beyond);
  }
  return box;
}
