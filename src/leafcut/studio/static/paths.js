// Toolpaths and parts as cached Path2D, split into pieces with levels of detail.

import { Density } from "./density.js";
import { OutlinePaths } from "./outline_paths.js";
import { Pen } from "./pen.js";
import { DARK, RAPID, STAND } from "./scene.js";

const ROWS = 1024; // rows per piece
const FINEST = 1 / 60000; // tolerance of the first simplified level, as a fraction of the extents
const LEVEL_STEP = 3;
const MOST_LEVELS = 9;
const SEEN_FROM = 0.55; // smallest visible deviation, pixels

/** Pieces of a toolpath, each with its box, and a Path2D of rapids and of cuts for each level of detail. */
export class ToolpathPaths {
  constructor(scene) {
    this.scene = scene;
    this.pieces = [];
    const [x0, y0, x1, y1] = scene.extents ?? [0, 0, 1, 1];
    this.tolerance = Math.max(Math.hypot(x1 - x0, y1 - y0), 1e-3) * FINEST;
    for (let first = 0; first < scene.rows; first += ROWS) {
      this.pieces.push(pieceOf(scene, first, Math.min(first + ROWS, scene.rows)));
    }
  }

  /** Return the coarsest level whose tolerance is invisible at a scale; 0 is exact. */
  levelFor(scale) {
    const allowed = SEEN_FROM / scale / this.tolerance;
    if (allowed < 1) return 0;
    return Math.min(1 + Math.floor(Math.log(allowed) / Math.log(LEVEL_STEP)), MOST_LEVELS);
  }

  /** Yield the index of every visible piece; `seen` is in mm, including the origin. */
  *visible(seen) {
    const [ox, oy] = this.scene.origin;
    for (let k = 0; k < this.pieces.length; k++) {
      const [x0, y0, x1, y1] = this.pieces[k].box;
      if (x0 + ox <= seen[2] && x1 + ox >= seen[0] && y0 + oy <= seen[3] && y1 + oy >= seen[1]) yield k;
    }
  }

  /** Return { rapid, cut, costs } of a piece: two Path2D, and the drawing cost of each in thin segments. */
  paths(index, level) {
    const piece = this.pieces[index];
    piece.levels[level] ??= tracePiece(this.scene, piece, level ? this.tolerance * LEVEL_STEP ** (level - 1) : 0);
    return piece.levels[level];
  }
}

function pieceOf(scene, first, end) {
  let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
  const take = (x, y) => {
    if (x < x0) x0 = x;
    if (x > x1) x1 = x;
    if (y < y0) y0 = y;
    if (y > y1) y1 = y;
  };
  for (let row = first; row < end; row++) {
    if (!scene.moves(row)) continue;
    const arc = scene.arcAt(row);
    if (arc) { take(arc[0] - arc[2], arc[1] - arc[2]); take(arc[0] + arc[2], arc[1] + arc[2]); }
    take(scene.x0(row), scene.y0(row));
    take(scene.x1(row), scene.y1(row));
  }
  return { first, end, box: [x0, y0, x1, y1], levels: [] };
}

function tracePiece(scene, piece, tolerance) {
  const pens = { rapid: new Pen(tolerance), cut: new Pen(tolerance) };
  traceRows(scene, piece.first, piece.end, pens);
  pens.rapid.finish();
  pens.cut.finish();
  return { rapid: pens.rapid.path, cut: pens.cut.path, costs: { rapid: pens.rapid.count, cut: 2 * pens.cut.count } };
}

function traceRows(scene, first, end, pens) {
  const { doing, place } = scene;
  for (let row = Math.max(first, 1); row < end; row++) {
    const what = doing[row];
    if (what === STAND) continue;
    const pen = what === RAPID || what === DARK ? pens.rapid : pens.cut;
    const x0 = place[3 * row - 3], y0 = place[3 * row - 2], x1 = place[3 * row], y1 = place[3 * row + 1];
    const arc = scene.arcAt(row);
    if (arc) pen.arc(arc[0], arc[1], arc[2], arc[3], arc[4], x0, y0, x1, y1);
    else if ((x0 !== x1 || y0 !== y1) && x0 === x0 && x1 === x1 && y0 === y0 && y1 === y1) pen.to(x0, y0, x1, y1);
  }
}

/** Return exact Path2D of rapids and cuts of the rows from `first` to before `end`. */
export function pathsOfRows(scene, first, end) {
  const pens = { rapid: new Pen(0), cut: new Pen(0) };
  traceRows(scene, first, end, pens);
  pens.rapid.finish();
  pens.cut.finish();
  return { rapid: pens.rapid.path, cut: pens.cut.path };
}

/** Add an outline's lines and arcs to a path. */
export function addOutline(path, part, index) {
  const { first, count, closed } = part.outlineAt(index), v = part.vertex;
  path.moveTo(v[3 * first], v[3 * first + 1]);
  for (let k = 0; k < (closed ? count : count - 1); k++) {
    const a = 3 * (first + k), b = 3 * (first + ((k + 1) % count));
    const x0 = v[a], y0 = v[a + 1], bulge = v[a + 2], x1 = v[b], y1 = v[b + 1];
    if (Math.abs(bulge) < 1e-9) {
      path.lineTo(x1, y1);
      continue;
    }
    const off = (1 - bulge * bulge) / (4 * bulge);
    const cx = (x0 + x1) / 2 - off * (y1 - y0), cy = (y0 + y1) / 2 + off * (x1 - x0);
    const start = Math.atan2(y0 - cy, x0 - cx), sweep = 4 * Math.atan(bulge);
    path.arc(cx, cy, Math.hypot(x0 - cx, y0 - cy), start, start + sweep, sweep < 0);
  }
  if (closed) path.closePath();
}

const HOLES = 2048; // holes per piece

/** A part as Path2D: outlines by kind, and holes in pieces by tool; holes without diameter and tiny holes have a
 * fixed size. Without the objects of hidden layers. */
export class PartPaths {
  constructor(part, hidden = new Set()) {
    this.part = part;
    this.numbers = {}; // of outlines, by kind
    this._fills = {};
    this._strokes = {};
    for (let k = 0; k < part.outlines; k++) {
      const kind = part.outlineAt(k).kind;
      if (!hidden.has(part.layerName("outline", k))) (this.numbers[kind === "island" ? "pocket" : kind] ??= []).push(k);
    }
    this.slots = [...Array(part.slots).keys()].filter((k) => !hidden.has(part.layerName("slot", k)));
    this.pieces = [];
    const order = [...Array(part.holes).keys()].filter((k) => !hidden.has(part.layerName("hole", k)));
    this.density = new Density(part, order);
    if (part.tools.length > 1) order.sort((a, b) => part.holeTool[a] - part.holeTool[b] || a - b);
    let piece = null;
    for (const k of order) {
      if (!piece || piece.holes.length >= HOLES || piece.tool !== part.holeTool[k]) {
        piece = { tool: part.holeTool[k], holes: [], box: [Infinity, Infinity, -Infinity, -Infinity], paths: new Map() };
        this.pieces.push(piece);
      }
      piece.holes.push(k);
      const x = part.hole[3 * k], y = part.hole[3 * k + 1], r = part.hole[3 * k + 2] / 2, box = piece.box;
      piece.box = [Math.min(box[0], x - r), Math.min(box[1], y - r), Math.max(box[2], x + r), Math.max(box[3], y + r)];
    }
  }

  /** Return all outlines of a kind as one Path2D for filling; null if none. */
  fill(kind) {
    if (!this.numbers[kind]) return null;
    if (!this._fills[kind]) {
      this._fills[kind] = new Path2D();
      for (const k of this.numbers[kind]) addOutline(this._fills[kind], this.part, k);
    }
    return this._fills[kind];
  }

  /** Return the outlines of a kind in pieces for stroking; null if none. */
  strokes(kind) { return this.numbers[kind] ? (this._strokes[kind] ??= new OutlinePaths(this.part, this.numbers[kind])) : null; }

  /** Yield the visible pieces of holes, drawn with at least the radius `smallest`, mm. */
  *visibleHoles(seen, smallest = 0) {
    const [ox, oy] = this.part.origin;
    for (const piece of this.pieces) {
      const [x0, y0, x1, y1] = piece.box, m = smallest;
      if (x0 + ox - m <= seen[2] && x1 + ox + m >= seen[0] && y0 + oy - m <= seen[3] && y1 + oy + m >= seen[1]) yield piece;
    }
  }

  /** Return the holes of a piece as one Path2D, each with at least the radius `smallest`, mm. */
  holes(piece, smallest) {
    const key = Math.round(8 * Math.log2(Math.max(smallest, 1e-6)));
    let path = piece.paths.get(key);
    if (path) return path;
    if (piece.paths.size > 6) piece.paths.clear();
    path = new Path2D();
    const least = 2 ** (key / 8), { hole } = this.part, tiny = [];
    for (const k of piece.holes) {
      const x = hole[3 * k], y = hole[3 * k + 1], r = Math.max(hole[3 * k + 2] / 2, least);
      if (r > least || piece.holes.length < 400) {
        path.moveTo(x + r, y);
        path.arc(x, y, r, 0, 2 * Math.PI);
      } else tiny.push(x, y);
    }
    for (let k = 0; k < tiny.length; k += 2) path.rect(tiny[k] - least, tiny[k + 1] - least, 2 * least, 2 * least);
    piece.paths.set(key, path);
    return path;
  }
}
