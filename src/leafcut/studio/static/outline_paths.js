// Outlines as cached Path2D, split into pieces with levels of detail.

import { Pen } from "./pen.js";

const VERTICES = 1024; // vertices per piece
const FINEST = 1 / 60000; // tolerance of the first simplified level, as a fraction of the extents
const LEVEL_STEP = 3, MOST_LEVELS = 9;
const SEEN_FROM = 0.4; // smallest visible deviation, pixels
const STRAIGHT = 1e-9; // bulge of a straight line

/** Outlines of a part with the given indices. */
export class OutlinePaths {
  constructor(part, numbers) {
    this.part = part;
    this.pieces = [];
    const [x0, y0, x1, y1] = part.extents ?? [0, 0, 1, 1];
    this.tolerance = Math.max(Math.hypot(x1 - x0, y1 - y0), 1e-3) * FINEST;
    let piece = null;
    for (const number of numbers) {
      if (!piece || piece.vertices >= VERTICES) {
        piece = { numbers: [], vertices: 0, box: [Infinity, Infinity, -Infinity, -Infinity], levels: [] };
        this.pieces.push(piece);
      }
      piece.numbers.push(number);
      piece.vertices += part.outlineAt(number).count;
      widen(piece.box, boxOf(part, number));
    }
  }

  /** Return the coarsest level whose tolerance is invisible at a scale; 0 is exact. */
  levelFor(scale) {
    const allowed = SEEN_FROM / scale / this.tolerance;
    return allowed < 1 ? 0 : Math.min(1 + Math.floor(Math.log(allowed) / Math.log(LEVEL_STEP)), MOST_LEVELS);
  }

  /** Yield a Path2D with its drawing cost, in segments, for every visible piece; `seen` is in mm. */
  *visible(seen, scale) {
    const [ox, oy] = this.part.origin, level = this.levelFor(scale);
    for (const piece of this.pieces) {
      const [x0, y0, x1, y1] = piece.box;
      if (x0 + ox > seen[2] || x1 + ox < seen[0] || y0 + oy > seen[3] || y1 + oy < seen[1]) continue;
      yield (piece.levels[level] ??= this._traced(piece, level));
    }
  }

  _traced(piece, level) {
    const pen = new Pen(level ? this.tolerance * LEVEL_STEP ** (level - 1) : 0);
    for (const number of piece.numbers) {
      traceOutline(this.part, number, pen);
      pen.finish();
    }
    return [pen.path, pen.count + piece.numbers.length];
  }
}

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

/** Return a box around an outline, from its vertices and the largest possible excess of its arcs. */
function boxOf(part, number) {
  const { first, count } = part.outlineAt(number), v = part.vertex, box = [Infinity, Infinity, -Infinity, -Infinity];
  for (let k = first; k < first + count; k++) {
    const next = k + 1 < first + count ? k + 1 : first;
    const chord = v[3 * k + 2] ? Math.hypot(v[3 * next] - v[3 * k], v[3 * next + 1] - v[3 * k + 1]) : 0;
    const beyond = 0.5 * chord * Math.max(Math.abs(v[3 * k + 2]), 0);
    widen(box, [v[3 * k] - beyond, v[3 * k + 1] - beyond, v[3 * k] + beyond, v[3 * k + 1] + beyond]);
    if (beyond) widen(box, [v[3 * next] - beyond, v[3 * next + 1] - beyond, v[3 * next] + beyond, v[3 * next + 1] + beyond]);
  }
  return box;
}

function widen(box, by) {
  box[0] = Math.min(box[0], by[0]);
  box[1] = Math.min(box[1], by[1]);
  box[2] = Math.max(box[2], by[2]);
  box[3] = Math.max(box[3], by[3]);
}
