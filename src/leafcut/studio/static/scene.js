// Scenes from the server (format: studio/drawing/scene.py), and queries on them.

import { firstWhere, nearest } from "./search.js";

/** @import { Box, Point } from "./boxes.js" */
/** @typedef {{ kind: string, origin: Point, extents: Box | null, [key: string]: any }} Header */
/** @typedef {Record<string, any>} Blocks */

const MAGIC = "LCSCENE1";
/** @type {Record<string, new (bytes: ArrayBuffer, offset: number, count: number) => ArrayLike<number>>} */
const TYPES = { f8: Float64Array, f4: Float32Array, i4: Int32Array, u4: Uint32Array, u1: Uint8Array };

export const RAPID = 0, CUT = 1, ARC_CW = 2, ARC_CCW = 3, STAND = 4, DARK = 5;
export const OUTLINES = ["cut", "mark", "sheet", "pocket", "island"];
const CLOSED = 16;

/** @param {number} doing */
export function isTravel(doing) { return doing === RAPID || doing === DARK; }

/** Return a scene from its bytes; throws an Error with a one-line message if they are invalid.
 * @param {ArrayBuffer} bytes @returns {any} */
export function readScene(bytes) {
  const magic = new TextDecoder().decode(new Uint8Array(bytes, 0, Math.min(8, bytes.byteLength)));
  if (magic !== MAGIC) throw new Error("this is no scene of leafcut's");
  const size = new DataView(bytes).getUint32(8, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 16, size)));
  /** @type {Blocks} */
  const blocks = {};
  for (const [name, [type, offset, count]] of Object.entries(header.blocks)) {
    blocks[name] = new TYPES[type](bytes, 16 + size + offset, count);
  }
  const kind = KINDS[header.kind];
  return kind ? new kind(header, blocks) : { header, kind: header.kind, ...blocks };
}

class Scene {
  /** @param {Header} header @param {Blocks} blocks */
  constructor(header, blocks) {
    this.header = header;
    this.kind = header.kind;
    this.origin = header.origin;
    this.extents = header.extents;
    this.blocks = blocks;
  }
}

/** Holes, slots and outlines; positions are relative to `origin`. */
export class PartScene extends Scene {
  /** @param {Header} header @param {Blocks} blocks */
  constructor(header, blocks) {
    super(header, blocks);
    this.hole = /** @type {Float32Array} */ (blocks.hole);
    this.holeTool = /** @type {Int32Array} */ (blocks.hole_tool);
    this.slot = /** @type {Float32Array} */ (blocks.slot);
    this.vertex = /** @type {Float32Array} */ (blocks.vertex);
    this.outline = /** @type {Uint32Array} */ (blocks.outline);
    this.issue = /** @type {Float32Array} */ (blocks.issue);
    this.holes = this.hole.length / 3;
    this.slots = this.slot.length / 5;
    this.outlines = this.outline.length / 4;
    this.tools = [...new Set(this.holeTool)].filter((tool) => tool > 0);
  }

  /** Return the centre of a hole, mm.
   * @param {number} k @returns {Point} */
  holePlace(k) { return [this.hole[3 * k] + this.origin[0], this.hole[3 * k + 1] + this.origin[1]]; }

  /** Return the radius of a hole, mm.
   * @param {number} k */
  holeRadius(k) { return this.hole[3 * k + 2] / 2; }

  /** Return the name of the layer of an object; "" for none.
   * @param {"hole" | "slot" | "outline"} noun @param {number} k @returns {string} */
  layerName(noun, k) { return this.header.layers[(this.blocks[`${noun}_layer`]?.[k] ?? 0) - 1] ?? ""; }

  /** Return first vertex, number of vertices, kind and closed flag of an outline.
   * @param {number} index */
  outlineAt(index) {
    const [first, count, flags] = this.outline.subarray(4 * index, 4 * index + 3);
    return { first, count, kind: OUTLINES[flags % CLOSED], closed: flags >= CLOSED };
  }
}

/** Rows of a toolpath with their times; positions are relative to `origin`. */
export class ToolpathScene extends Scene {
  /** @param {Header} header @param {Blocks} blocks */
  constructor(header, blocks) {
    super(header, blocks);
    this.doing = /** @type {Uint8Array} */ (blocks.doing);
    this.place = /** @type {Float32Array} */ (blocks.place);
    this.seconds = /** @type {Float32Array} */ (blocks.seconds);
    this.line = /** @type {Uint32Array} */ (blocks.line);
    this.source = /** @type {Uint32Array} */ (blocks.source);
    this.feed = /** @type {Float32Array} */ (blocks.feed);
    this.tool = /** @type {Uint32Array} */ (blocks.tool);
    this.arc = /** @type {Float32Array} */ (blocks.arc);
    this.stop = /** @type {Uint32Array} */ (blocks.stop);
    this.pierce = /** @type {Float32Array} */ (blocks.pierce);
    this.lead = /** @type {Float32Array} */ (blocks.lead);
    this.text = /** @type {Uint8Array} */ (blocks.text);
    this.rows = this.doing.length;
    this.arcOf = new Int32Array(this.rows).fill(-1);
    for (const [k, row] of blocks.arc_row.entries()) this.arcOf[row] = k;
    this.ends = new Float64Array(this.rows);
    let time = 0;
    for (let row = 0; row < this.rows; row++) this.ends[row] = time += this.seconds[row];
    this.duration = time;
    /** @type {Map<number, number> | null} */
    this._rowOfLine = null;
    /** @type {Path2D | null} */
    this.leadPath = null;
  }

  /** @param {number} row */
  x0(row) { return row > 0 ? this.place[3 * row - 3] : NaN; }
  /** @param {number} row */
  y0(row) { return row > 0 ? this.place[3 * row - 2] : NaN; }
  /** @param {number} row */
  z0(row) { return row > 0 ? this.place[3 * row - 1] : NaN; }
  /** @param {number} row */
  x1(row) { return this.place[3 * row]; }
  /** @param {number} row */
  y1(row) { return this.place[3 * row + 1]; }
  /** @param {number} row */
  z1(row) { return this.place[3 * row + 2]; }

  /** Whether a row moves in plan view, in x or y, from a known position.
   * @param {number} row */
  moves(row) {
    if (this.doing[row] === STAND || row === 0) return false;
    if (this.arcOf[row] >= 0) return true;
    const dx = this.x1(row) - this.x0(row), dy = this.y1(row) - this.y0(row);
    return Math.abs(dx) > 1e-6 || Math.abs(dy) > 1e-6;
  }

  /** Return centre, radius, start angle and sweep of an arc, or null.
   * @param {number} row */
  arcAt(row) {
    const k = this.arcOf[row];
    return k < 0 ? null : this.arc.subarray(5 * k, 5 * k + 5);
  }

  /** Return the length of a row in space, mm; 0 if unknown.
   * @param {number} row */
  lengthOf(row) {
    const dz = this.z1(row) - this.z0(row) || 0, arc = this.arcAt(row);
    if (arc) return Math.hypot(arc[2] * arc[4], dz);
    if (this.doing[row] === STAND) return 0;
    return Math.hypot(this.x1(row) - this.x0(row) || 0, this.y1(row) - this.y0(row) || 0, dz);
  }

  /** Return the row being run at a time in seconds: the first that has not ended.
   * @param {number} time */
  rowAt(time) {
    return firstWhere(this.rows - 1, (row) => this.ends[row] > time);
  }

  /** @param {number} row */
  startOf(row) { return row > 0 ? this.ends[row - 1] : 0; }

  /** Return row, completed fraction of the row, and position (x, y, z, including the origin) at a time.
   * @param {number} time */
  at(time) {
    const row = this.rowAt(time), length = this.seconds[row];
    const share = length > 0 ? Math.min(Math.max((time - this.startOf(row)) / length, 0), 1) : 1;
    const [x, y, z] = this.along(row, share);
    return { row, share, x: x + this.origin[0], y: y + this.origin[1], z };
  }

  /** Return the position at a fraction (0 … 1) of a row, relative to the origin.
   * @param {number} row @param {number} share */
  along(row, share) {
    const arc = this.arcAt(row), z = this.z0(row) + share * (this.z1(row) - this.z0(row));
    const height = Number.isFinite(z) ? z : this.z1(row);
    if (arc && share < 1) {
      const angle = arc[3] + share * arc[4];
      return [arc[0] + arc[2] * Math.cos(angle), arc[1] + arc[2] * Math.sin(angle), height];
    }
    const x0 = this.x0(row), y0 = this.y0(row);
    if (share >= 1 || !Number.isFinite(x0 + y0)) return [this.x1(row), this.y1(row), height];
    return [x0 + share * (this.x1(row) - x0), y0 + share * (this.y1(row) - y0), height];
  }

  /** Return the first row of a program line, or -1.
   * @param {number} line */
  rowOfLine(line) {
    if (!this._rowOfLine) {
      this._rowOfLine = new Map();
      for (let row = this.rows - 1; row >= 0; row--) this._rowOfLine.set(this.line[row], row);
    }
    return this._rowOfLine.get(line) ?? -1;
  }

  /** Return first and last row of the cycle or arc of a row.
   * @param {number} row */
  together(row) {
    let first = row, last = row;
    while (first > 0 && this.source[first - 1] === this.source[row]) first--;
    while (last < this.rows - 1 && this.source[last + 1] === this.source[row]) last++;
    return [first, last];
  }

  /** Return number (from 1) and position of the nearest pierce within `reach` mm, or null.
   * @param {number} x @param {number} y @param {number} reach */
  pierceNear(x, y, reach) {
    const { pierce, origin: [ox, oy] } = this;
    const place = (/** @type {number} */ k) => /** @type {Point} */ ([pierce[3 * k] + ox, pierce[3 * k + 1] + oy]);
    const found = nearest(Array(pierce.length / 3).keys(), reach, (k) => distance(place(k), x, y));
    return found < 0 ? null : { number: pierce[3 * found + 2], from: place(found) };
  }

  /** Return the number (from 1) of the stop at which a row works or to which it moves; 0 for none. Always 0 if the torch
   * starts more than once in a cut: then stops are not cuts.
   * @param {number} row */
  stopOf(row) {
    const { stop } = this;
    if (this.pierce.length && this.pierce.length !== 3 * stop.length) return 0;
    const low = firstWhere(stop.length, (k) => stop[k] >= row);
    if (low === 0 || low === stop.length || stop[low] === row) return Math.min(low + 1, stop.length);
    // Rows after the first one: the rest of a canned cycle or of a cut, then the move to the next.
    const works = this.doing[row] !== RAPID && this.doing[row] !== STAND;
    return works || this.source[stop[low - 1]] === this.source[row] ? low : low + 1;
  }

  /** Return x and y of a stop, relative to the origin.
   * @param {number} number @returns {Point} */
  stopPlace(number) {
    const row = this.stop[number];
    return row > 0 ? [this.x0(row), this.y0(row)] : [NaN, NaN];
  }

  /** Whether a row is a travel move, which may get an arrow.
   * @param {number} row */
  idle(row) { return isTravel(this.doing[row]); }

  /** Return the number shown at a stop.
   * @param {number} stop */
  label(stop) { return String(stop + 1); }

  /** @param {number} tool @returns {string} */
  toolWords(tool) { return this.header.tools?.[tool] ?? (tool ? `T${tool}` : ""); }
}

/** Best path of a running search, or an edited order, which has `visit`. */
export class PathScene extends Scene {
  /** @param {Header} header @param {Blocks} blocks */
  constructor(header, blocks) {
    super(header, blocks);
    this.point = /** @type {Float32Array} */ (blocks.point);
    /** Number of each point in the toolpath, and whether its rank is fixed, in an edited order. */
    this.visit = /** @type {Uint32Array} */ (blocks.visit ?? new Uint32Array());
    this.held = /** @type {Uint8Array} */ (blocks.held ?? new Uint8Array());
    this.rows = this.point.length / 2;
    /** @type {Path2D | null} */
    this._path = null;
    /** @type {number[] | null} */
    this._numbers = null;
    /** @type {ToolpathScene | null} */
    this._settled = null;
  }

  /** Whether this is an edited order. */
  get edited() { return Boolean(this.blocks.visit); }

  /** @param {number} k */
  x0(k) { return this.point[2 * k - 2]; }
  /** @param {number} k */
  y0(k) { return this.point[2 * k - 1]; }
  /** @param {number} k */
  x1(k) { return this.point[2 * k]; }
  /** @param {number} k */
  y1(k) { return this.point[2 * k + 1]; }

  /** Return whether a move leads from the previous point; not where the search chooses the order.
   * @param {number} k */
  idle(k) { return k > 0 && (!this.edited || Boolean(this.held[k] && this.held[k - 1])); }

  /** Path to draw, created once; empty if all points coincide. */
  get path() {
    if (this._path) return this._path;
    this._path = new Path2D();
    for (let k = 0; k < this.rows; k++) {
      if (this.idle(k)) this._path.lineTo(this.x1(k), this.y1(k));
      else this._path.moveTo(this.x1(k), this.y1(k));
    }
    return this._path;
  }

  /** Points in the order in which their numbers are drawn, without those that the search orders. */
  get numbers() { return (this._numbers ??= numberOrder(this.rows).filter((k) => this.held[k])); }

  /** Points in the format of a toolpath's pierces. */
  get pierce() {
    const pierce = new Float32Array(3 * this.rows);
    for (let k = 0; k < this.rows; k++) pierce.set([this.x1(k), this.y1(k), this.visit[k]], 3 * k);
    return pierce;
  }

  /** Return x and y of a point, relative to the origin.
   * @param {number} k @returns {Point} */
  stopPlace(k) { return k >= 0 && k < this.rows ? [this.x1(k), this.y1(k)] : [NaN, NaN]; }

  /** @param {number} k */
  label(k) { return `${k + 1}${this.header.signs[k] ?? ""}`; }

  /** Move stops that are pierces of the toolpath to the pierce position, unless they were dragged; return this.
   * @param {ToolpathScene} toolpath */
  settled(toolpath) {
    if (this._settled === toolpath) return this;
    this._settled = toolpath;
    this._path = null;
    const { pierce, origin } = toolpath, at = new Map();
    for (let k = 0; k < pierce.length; k += 3) at.set(pierce[k + 2], k);
    for (let k = 0; k < this.rows; k++) {
      const found = at.get(this.visit[k]);
      if (found === undefined || this.blocks.moved[k]) continue;
      this.point[2 * k] = pierce[found] + origin[0] - this.origin[0];
      this.point[2 * k + 1] = pierce[found + 1] + origin[1] - this.origin[1];
    }
    return this;
  }

  /** Return the index of a toolpath's stop in the edited order, or -1.
   * @param {number} number */
  indexOf(number) { return this.visit.indexOf(number); }

  /** Return number (in the toolpath, from 1) and position of the nearest stop within `reach` mm, or null.
   * @param {number} x @param {number} y @param {number} reach */
  near(x, y, reach) {
    const { point, origin: [ox, oy] } = this;
    const place = (/** @type {number} */ k) => /** @type {Point} */ ([point[2 * k] + ox, point[2 * k + 1] + oy]);
    const found = nearest(Array(this.rows).keys(), reach, (k) => distance(place(k), x, y), "first");
    return found < 0 ? null : { number: this.visit[found], from: place(found) };
  }
}

/** @param {Point} place @param {number} x @param {number} y */
function distance([px, py], x, y) { return Math.hypot(px - x, py - y); }

/** Return the stops in the order in which they are labelled: ends, then hundreds, tens, fives, all.
 * @param {number} count */
export function numberOrder(count) {
  const levels = /** @type {number[][]} */ ([[], [], [], [], []]);
  for (let k = 0; k < count; k++) {
    const number = k + 1;
    const level = k === 0 || k === count - 1 ? 0 : number % 100 === 0 ? 1 : number % 10 === 0 ? 2 : number % 5 === 0 ? 3 : 4;
    levels[level].push(k);
  }
  return levels.flat();
}

/** Edges between points, each with a strength. */
export class PheromoneScene extends Scene {
  /** @param {Header} header @param {Blocks} blocks */
  constructor(header, blocks) {
    super(header, blocks);
    this.point = /** @type {Float32Array} */ (blocks.point);
    this.edge = /** @type {Uint32Array} */ (blocks.edge);
    this.strength = /** @type {Float32Array} */ (blocks.strength);
  }
}

/** Differences of two programs with positions, relative to `origin`. */
export class DifferenceScene extends Scene {
  /** @param {Header} header @param {Blocks} blocks */
  constructor(header, blocks) {
    super(header, blocks);
    this.mark = /** @type {Float32Array} */ (blocks.mark);
    this.missing = /** @type {Float32Array} */ (blocks.missing);
    this.added = /** @type {Float32Array} */ (blocks.added);
    this.marks = this.mark.length / 4;
  }

  /** Return position, index of the difference, and change (0 missing, 1 added, 2 changed) of a mark.
   * @param {number} k */
  at(k) {
    const [x, y, index, change] = this.mark.subarray(4 * k, 4 * k + 4);
    return { x: x + this.origin[0], y: y + this.origin[1], index, change };
  }

  /** Return the mark nearest to a position within `reach` mm, or -1.
   * @param {number} x @param {number} y @param {number} reach */
  near(x, y, reach) {
    return nearest(Array(this.marks).keys(), reach, (k) => Math.hypot(this.at(k).x - x, this.at(k).y - y), "first");
  }

  /** Return the first mark of a difference, or -1.
   * @param {number} index */
  markOf(index) {
    for (let k = 0; k < this.marks; k++) if (this.mark[4 * k + 2] === index) return k;
    return -1;
  }
}

/** @type {Record<string, new (header: Header, blocks: Blocks) => Scene>} */
const KINDS = {
  part: PartScene, toolpath: ToolpathScene, path: PathScene, pheromone: PheromoneScene, differences: DifferenceScene,
};
