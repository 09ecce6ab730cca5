// Toolpaths and parts as cached Path2D, split into pieces with levels of detail.

import { emptyBox, isVisible, widen } from "./boxes.js";
import { Density } from "./density.js";
import { OutlinePaths } from "./outline_paths.js";
import { Levels, Pen } from "./pen.js";
import { STAND, isTravel } from "./scene.js";

/** @import { Box } from "./boxes.js" */
/** @import { PartScene, ToolpathScene } from "./scene.js" */
/** @typedef {{ rapid: Path2D, cut: Path2D, costs: { rapid: number, cut: number } }} Traced */
/** @typedef {{ first: number, end: number, box: Box, levels: Traced[] }} Piece */
/** @typedef {{ tool: number, holes: number[], box: Box, paths: Map<number, Path2D> }} HolePiece */

const ROWS = 1024; // rows per piece
const VISIBLE = 0.55; // smallest visible deviation, pixels

/** Pieces of a toolpath, each with its box, and a Path2D of rapids and of cuts for each level of detail. */
export class ToolpathPaths {
  /** @param {ToolpathScene} scene */
  constructor(scene) {
    this.scene = scene;
    /** @type {Piece[]} */
    this.pieces = [];
    this.levels = new Levels(scene.extents, VISIBLE);
    for (let first = 0; first < scene.rows; first += ROWS) {
      const end = Math.min(first + ROWS, scene.rows);
      this.pieces.push({ first, end, box: boxOfRows(scene, first, end), levels: [] });
    }
  }

  /** Yield every visible piece with its paths for a scale.
   * @param {Box} seen @param {number} scale @returns {Generator<[Traced, Piece]>} */
  *visible(seen, scale) {
    const level = this.levels.at(scale);
    for (const piece of this.pieces) {
      if (!isVisible(piece.box, this.scene.origin, seen)) continue;
      yield [(piece.levels[level] ??= pathsOfRows(this.scene, piece.first, piece.end, this.levels.tolerance(level))), piece];
    }
  }
}

/** @param {ToolpathScene} scene @param {number} first @param {number} end */
function boxOfRows(scene, first, end) {
  const box = emptyBox();
  for (let row = first; row < end; row++) {
    if (!scene.moves(row)) continue;
    const arc = scene.arcAt(row);
    if (arc) widen(box, arc[0] - arc[2], arc[1] - arc[2], arc[0] + arc[2], arc[1] + arc[2]);
    widen(box, scene.x0(row), scene.y0(row));
    widen(box, scene.x1(row), scene.y1(row));
  }
  return box;
}

/** Return Path2D of rapids and cuts of the rows from `first` to before `end`, and the drawing cost of each in thin
 * segments.
 * @param {ToolpathScene} scene @param {number} first @param {number} end @returns {Traced} */
export function pathsOfRows(scene, first, end, tolerance = 0) {
  const { doing, place } = scene, rapid = new Pen(tolerance), cut = new Pen(tolerance);
  for (let row = Math.max(first, 1); row < end; row++) {
    if (doing[row] === STAND) continue;
    const pen = isTravel(doing[row]) ? rapid : cut;
    const x0 = place[3 * row - 3], y0 = place[3 * row - 2], x1 = place[3 * row], y1 = place[3 * row + 1];
    const arc = scene.arcAt(row);
    if (arc) pen.arc(arc[0], arc[1], arc[2], arc[3], arc[4], x0, y0, x1, y1);
    else if ((x0 !== x1 || y0 !== y1) && x0 === x0 && x1 === x1 && y0 === y0 && y1 === y1) pen.to(x0, y0, x1, y1);
  }
  rapid.finish();
  cut.finish();
  return { rapid: rapid.path, cut: cut.path, costs: { rapid: rapid.count, cut: 2 * cut.count } };
}

const HOLES = 2048; // holes per piece

/** A part as Path2D: outlines by kind, and holes in pieces by tool; holes without diameter and tiny holes have a
 * fixed size. Without the objects of hidden layers. */
export class PartPaths {
  /** @param {PartScene} part @param {Set<string>} hidden */
  constructor(part, hidden = new Set()) {
    this.part = part;
    /** @type {Record<string, number[]>} */
    const numbers = {};
    for (let k = 0; k < part.outlines; k++) {
      const kind = part.outlineAt(k).kind;
      if (!hidden.has(part.layerName("outline", k))) (numbers[kind === "island" ? "pocket" : kind] ??= []).push(k);
    }
    /** Outlines by kind; none for a kind without outlines. */
    this.outlines = Object.fromEntries(Object.entries(numbers).map(([kind, of]) => [kind, new OutlinePaths(part, of)]));
    this.slots = [...Array(part.slots).keys()].filter((k) => !hidden.has(part.layerName("slot", k)));
    const order = [...Array(part.holes).keys()].filter((k) => !hidden.has(part.layerName("hole", k)));
    this.density = new Density(part, order);
    if (part.tools.length > 1) order.sort((a, b) => part.holeTool[a] - part.holeTool[b] || a - b);
    /** @type {HolePiece[]} */
    this.pieces = [];
    for (const k of order) {
      let piece = this.pieces.at(-1);
      if (!piece || piece.holes.length >= HOLES || piece.tool !== part.holeTool[k]) {
        piece = { tool: part.holeTool[k], holes: [], box: emptyBox(), paths: new Map() };
        this.pieces.push(piece);
      }
      piece.holes.push(k);
      const x = part.hole[3 * k], y = part.hole[3 * k + 1], r = part.holeRadius(k);
      widen(piece.box, x - r, y - r, x + r, y + r);
    }
  }

  /** Yield the visible pieces of holes, drawn with at least the radius `smallest`, mm.
   * @param {Box} seen */
  *visibleHoles(seen, smallest = 0) {
    for (const piece of this.pieces) if (isVisible(piece.box, this.part.origin, seen, smallest)) yield piece;
  }

  /** Return the holes of a piece as one Path2D, each with at least the radius `smallest`, mm.
   * @param {HolePiece} piece @param {number} smallest */
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
