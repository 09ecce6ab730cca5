// A pane: a canvas with one or two toolpaths over a part, composed of cached layers.

import { boxAround } from "./boxes.js";
import { Buffer, Frame, budget } from "./buffer.js";
import { ringMark } from "./differences.js";
import { distanceToMove, gridOfMoves, gridOfPoints } from "./hit_test.js";
import { contextOf, make } from "./icons.js";
import { circle, drawGrid, drawMachine, drawRulers, drawScaleBar, drawTool } from "./marks.js";
import { paintDone, paintGround, paintMarks, paintMore, paintPaths } from "./painters.js";
import { ToolpathPaths, pathsOfRows } from "./paths.js";
import { STAND, isTravel, numberOrder } from "./scene.js";
import { nearest } from "./search.js";

/** @import { Point } from "./boxes.js" */
/** @import { Drawing } from "./canvas.js" */
/** @import { Picked } from "./describe.js" */
/** @import { Drag } from "./dragging.js" */
/** @import { Grid } from "./hit_test.js" */
/** @import { PartPaths } from "./paths.js" */
/** @import { DifferenceScene, PartScene, PathScene, PheromoneScene, ToolpathScene } from "./scene.js" */
/** @import { Colours } from "./theme.js" */
/** @import { WholePaths } from "./whole.js" */

const PALE = 0.3;
const REACH = 7; // maximum distance to the pointer, pixels

/** A toolpath with derived data: pieces, the order of its numbers, and grids for the pointer. */
export class Track {
  /** @param {ToolpathScene} scene */
  constructor(scene) {
    this.scene = scene;
    this.paths = new ToolpathPaths(scene);
    this.numbers = numberOrder(scene.stop.length);
    this.pale = false;
    const e = scene.extents ?? [0, 0, 1, 1];
    /** Radius of the dots for drilled holes, mm, small enough that few of them overlap. */
    this.drillRadius = 0.2 * Math.sqrt(((e[2] - e[0]) * (e[3] - e[1])) / Math.max(scene.stop.length, 1));
    /** @type {Grid | null} */
    this._moves = null;
    /** @type {Grid | null} */
    this._stops = null;
  }

  /** Return the row of the nearest move that is `shown` within `reach` mm, or -1; other moves win against travel moves.
   * @param {number} x @param {number} y @param {number} reach @param {(travel: boolean) => boolean} shown */
  moveNear(x, y, reach, shown) {
    const { scene, scene: { origin: [ox, oy] } } = this, grid = (this._moves ??= gridOfMoves(scene));
    return nearest(grid.around(x - ox, y - oy, reach), reach, (row) => {
      const travel = scene.idle(row);
      return shown(travel) ? distanceToMove(scene, row, x - ox, y - oy) + (travel ? reach * 0.2 : 0) : Infinity;
    });
  }

  /** Return the number (from 0) of the first stop within `reach` mm of a position, or -1.
   * @param {number} x @param {number} y @param {number} reach */
  stopNear(x, y, reach) {
    const { scene, scene: { origin: [ox, oy] } } = this, place = (/** @type {number} */ k) => scene.stopPlace(k);
    const grid = (this._stops ??= gridOfPoints(scene, scene.stop.length, place));
    return nearest(grid.around(x - ox, y - oy, reach), reach, (k) => Math.hypot(place(k)[0] + ox - x, place(k)[1] + oy - y), "first");
  }
}

export class Pane {
  /** @param {HTMLElement} host @param {Drawing} drawing @param {string} label @param {string} title */
  constructor(host, drawing, label, title) {
    this.host = host;
    this.shared = drawing;
    this.view = drawing.view;
    this.layers = drawing.layers;
    this.canvas = make("canvas", "lc-canvas", { tabindex: "0", role: "application", "aria-label": label });
    this.caption = make("div", "lc-caption", {}, title);
    host.append(this.canvas, this.caption);
    this.ctx = contextOf(this.canvas);
    /** @type {WholePaths | null} */
    this.wholePaths = null;
    /** @type {PartScene | null} */
    this.part = null;
    /** @type {PartPaths | null} */
    this.partPaths = null;
    /** @type {PheromoneScene | null} */
    this.pheromone = null;
    /** @type {PathScene | null} */
    this.live = null;
    /** @type {Track | null} */
    this.main = null;
    /** @type {DifferenceScene | null} */
    this.differences = null;
    /** @type {string[]} */
    this.drawnLayers = [];
    this.hidden = drawing.hidden;
    /** @type {Track[]} */
    this.tracks = [];
    /** @type {{ grid: Grid, largest: number } | null} */
    this._holes = null;
    /** @type {number | null} */
    this.time = null; // seconds; null: no playback
    /** @type {ReturnType<ToolpathScene["at"]> | null} */
    this.at = null;
    this.doneRow = this.paintedRow = 0;
    /** @type {Picked | null} */
    this.hovered = null;
    /** @type {Drag | null} */
    this.drag = null;
    this.dirty = true;
    this.buffers = {
      ground: new Buffer((ctx, frame) => paintGround(ctx, frame, this)),
      path: new Buffer((ctx, frame) => paintPaths(ctx, frame, this)),
      done: new Buffer((ctx, frame) => paintDone(ctx, frame, this)),
      marks: new Buffer((ctx, frame) => paintMarks(ctx, frame, this)),
    };
    /** @type {Colours} */
    this.colours = {};
  }

  /** Set new colours.
   * @param {Colours} colours */
  restyle(colours) {
    this.colours = colours;
    this.invalidate();
  }

  /** Show a part over the whole drawing; `drawnLayers` are the names of all layers.
   * @param {PartPaths | null} paths @param {WholePaths | null} wholePaths @param {string[]} drawnLayers */
  setPart(paths, wholePaths, drawnLayers) {
    this.part = paths?.part ?? null;
    this.partPaths = paths;
    this.wholePaths = wholePaths;
    this.drawnLayers = drawnLayers;
    this._holes = null;
    this.invalidate("ground", "marks");
  }

  /** Show toolpaths; `main` is used for numbers, playback and the selection.
   * @param {Track[]} tracks @param {Track | null} main */
  setTracks(tracks, main) {
    this.tracks = tracks;
    this.main = main;
    this.hovered = null;
    this.invalidate();
  }

  /** @param {PheromoneScene | null} scene */
  setPheromone(scene) {
    this.pheromone = scene;
    this.invalidate("ground");
  }

  /** @param {DifferenceScene | null} scene */
  setDifferences(scene) {
    this.differences = scene;
    this.invalidate("marks");
  }

  /** @param {PathScene | null} scene */
  setLive(scene) {
    this.live = scene;
    this.invalidate("path", "marks");
  }

  /** Toolpath of the pane: "before", "after", or undefined.
   * @returns {string | undefined} */
  get which() { return this.main?.scene.header.which; }

  /** The edited order, which replaces the toolpath for numbers, marks and dragging. */
  get edited() { return this.live?.edited && this.main ? this.live.settled(this.main.scene) : null; }

  /** Box around the whole drawing, or around the machined objects only. */
  get extents() { return boxAround([this.wholePaths?.part.extents, this.workedExtents]); }

  get workedExtents() {
    return boxAround([this.part, this.pheromone, this.live, ...this.tracks.map((track) => track.scene)].map((scene) => scene?.extents));
  }

  /** Mark layers as outdated, by default all.
   * @param {(keyof Pane["buffers"])[]} names */
  invalidate(...names) {
    for (const name of names.length ? names : this._names(true)) this.buffers[name].invalidate();
    this.dirty = true;
  }

  /** Names of the layers in painting order. */
  _names(played = this.time !== null) {
    return /** @type {(keyof Pane["buffers"])[]} */ (played ? ["ground", "path", "done", "marks"] : ["ground", "path", "marks"]);
  }

  /** Show the state at a time, s; null: everything, without a tool.
   * @param {number | null} time */
  setTime(time) {
    const was = this.time, scene = this.main?.scene;
    this.time = scene ? time : null;
    this.dirty = true;
    if (!scene || time === null) return;
    this.at = scene.at(Math.min(time, scene.duration));
    this.doneRow = time >= scene.duration ? scene.rows : this.at.row;
    if (was === null || this.doneRow < this.paintedRow) this.buffers.done.invalidate();
  }

  /** Continue painting; return whether something is left to paint. */
  frame() {
    const { view, canvas, ctx, buffers } = this, ratio = this.ratio(), names = this._names();
    const waiting = names.filter((name) => !buffers[name].ready(view));
    if (!waiting.length && !this.dirty) return false;
    let left = budget.segments;
    for (const name of waiting) {
      if (left > 0) left -= buffers[name].step(view, ratio, left);
    }
    this._catchUp(ratio);
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.clearRect(0, 0, canvas.width, canvas.height);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (this.layers.grid) drawGrid(ctx, view, this.colours);
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    buffers.ground.blit(ctx, view, ratio);
    buffers.path.blit(ctx, view, ratio, this.time === null ? 1 : PALE);
    if (this.time !== null) buffers.done.blit(ctx, view, ratio);
    buffers.marks.blit(ctx, view, ratio, this.time === null ? 1 : 0.75);
    this._overlay(ctx, ratio);
    this.dirty = names.some((name) => !buffers[name].ready(view));
    return this.dirty;
  }

  ratio() { return Math.min(window.devicePixelRatio || 1, 3); }

  /** Adapt the canvas to its element; return the size in pixels.
   * @returns {Point} */
  resize() {
    const box = this.host.getBoundingClientRect(), ratio = this.ratio();
    const width = Math.max(Math.round(box.width * ratio), 1), height = Math.max(Math.round(box.height * ratio), 1);
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.invalidate();
    }
    return [box.width, box.height];
  }

  /** Add the rows run since the last frame to the finished moves.
   * @param {number} ratio */
  _catchUp(ratio) {
    const { main, doneRow, paintedRow, buffers: { done } } = this;
    if (this.time === null || !main || !done.ready(this.view) || doneRow <= paintedRow) return;
    const addition = doneRow - paintedRow > 20000 ? null : done.addition();
    if (!addition) {
      done.invalidate();
      return;
    }
    paintMore(addition.ctx, new Frame(addition.view, ratio, done.margin), this, main, paintedRow, doneRow);
    this.paintedRow = doneRow;
  }

  /** Draw what changes in every frame: selection, hover, tool, drag; then the rulers.
   * @param {Context} ctx @param {number} ratio */
  _overlay(ctx, ratio) {
    const { view, colours } = this, frame = new Frame(view, ratio), { selected, tool, placement, measure, unit } = this.shared;
    if (selected) this._highlight(ctx, frame, selected, colours.accent, 1);
    if (this.hovered) this._highlight(ctx, frame, this.hovered, colours.ink, 0.75);
    if (this.time !== null && this.main && this.at) this._current(ctx, frame, this.main.scene, this.at);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (tool) drawMachine(ctx, view, colours, tool);
    if (this.drag) this._dragLine(ctx, this.drag);
    placement.draw(ctx, view, colours);
    measure.draw(ctx, view, colours);
    if (this.layers.grid) drawRulers(ctx, view, colours, unit);
    drawScaleBar(ctx, view, colours, unit);
  }

  /** @param {Context} ctx @param {Frame} frame @param {ToolpathScene} scene @param {ReturnType<ToolpathScene["at"]>} at */
  _current(ctx, frame, scene, { row, share, x, y }) {
    const { colours, view } = this, working = !isTravel(scene.doing[row]) && scene.doing[row] !== STAND;
    if (scene.moves(row)) {
      frame.inMm(ctx, scene.origin);
      ctx.strokeStyle = working ? colours.cut : colours.rapid;
      ctx.lineWidth = (working ? 2.4 : 1.6) / frame.scale;
      ctx.stroke(partOfRow(scene, row, share));
    }
    ctx.setTransform(frame.ratio, 0, 0, frame.ratio, 0, 0);
    drawTool(ctx, view, colours, x, y, working);
  }

  /** @param {Context} ctx @param {Frame} frame @param {Picked} what @param {string} colour @param {number} alpha */
  _highlight(ctx, frame, { mark, hole, row, which, stop, layer }, colour, alpha) {
    const { differences, part, main, edited } = this, scene = main?.scene;
    ctx.globalAlpha = alpha;
    if (mark !== undefined && differences) ringMark(ctx, frame, differences.at(mark), colour);
    if (hole !== undefined && part && hole < part.holes) {
      const [x, y] = part.holePlace(hole);
      frame.inPixels(ctx);
      ctx.strokeStyle = colour;
      ctx.lineWidth = 2.5;
      ctx.stroke(circle(frame.toX(x), frame.toY(y), Math.max(part.holeRadius(hole) * frame.scale, 4) + 4));
    }
    if (layer !== undefined) this._strokeLayer(ctx, frame, layer, (path) => { ctx.stroke(path); }, colour);
    const still = scene && row !== undefined && (!edited || (scene.pierce.length && !scene.idle(row)));
    if (still && which === this.which) this._strokeRows(ctx, frame, scene, row, colour);
    if (edited && stop) this._strokeWay(ctx, frame, edited, edited.indexOf(stop), colour);
    ctx.globalAlpha = 1;
  }

  /** Call `act` with the outlines of a layer of the whole drawing, with a wide pen.
   * @param {Context} ctx @param {Frame} frame @param {string} layer @param {(path: Path2D) => void} act */
  _strokeLayer(ctx, frame, layer, act, colour = "", width = 3.4) {
    const { wholePaths } = this;
    if (!wholePaths) return;
    frame.inMm(ctx, wholePaths.part.origin);
    ctx.strokeStyle = colour;
    ctx.lineWidth = width / frame.scale;
    for (const outlines of Object.values(wholePaths.layers.get(layer)?.outlines ?? {})) {
      for (const [path] of outlines.visible(frame.seen, frame.scale)) act(path);
    }
  }

  /** @param {Context} ctx @param {Frame} frame @param {ToolpathScene} scene @param {number} row @param {string} colour */
  _strokeRows(ctx, frame, scene, row, colour) {
    const [first, last] = scene.together(row), paths = pathsOfRows(scene, first, last + 1);
    frame.inMm(ctx, scene.origin);
    ctx.strokeStyle = ctx.fillStyle = colour;
    ctx.lineWidth = 3.4 / frame.scale;
    ctx.lineCap = "round";
    ctx.stroke(paths.rapid);
    ctx.stroke(paths.cut);
    const px = frame.toX(scene.x1(last) + scene.origin[0]), py = frame.toY(scene.y1(last) + scene.origin[1]);
    if (!Number.isFinite(px + py)) return;
    frame.inPixels(ctx);
    ctx.fill(circle(px, py, 4));
  }

  /** Draw the move to a stop in the edited order, and the stop.
   * @param {Context} ctx @param {Frame} frame @param {PathScene} edited @param {number} k @param {string} colour */
  _strokeWay(ctx, frame, edited, k, colour) {
    const [ox, oy] = edited.origin, px = frame.toX(edited.x1(k) + ox), py = frame.toY(edited.y1(k) + oy);
    if (k < 0) return;
    frame.inPixels(ctx);
    ctx.strokeStyle = ctx.fillStyle = colour;
    ctx.lineWidth = 3.4;
    ctx.lineCap = "round";
    ctx.beginPath();
    if (edited.idle(k)) {
      ctx.moveTo(frame.toX(edited.x0(k) + ox), frame.toY(edited.y0(k) + oy));
      ctx.lineTo(px, py);
      ctx.stroke();
    }
    ctx.fill(circle(px, py, 4));
  }

  /** @param {Context} ctx @param {Drag} drag */
  _dragLine(ctx, { from, to }) {
    const { view } = this, x = view.toX(to[0]), y = view.toY(to[1]);
    ctx.strokeStyle = this.colours.accent;
    ctx.lineWidth = 1.6;
    ctx.setLineDash([4, 4]);
    ctx.beginPath();
    ctx.moveTo(view.toX(from[0]), view.toY(from[1]));
    ctx.lineTo(x, y);
    ctx.stroke();
    ctx.setLineDash([]);
    ctx.stroke(circle(x, y, 6));
  }

  /** Return the object at a screen position, or null.
   * @param {number} px @param {number} py @returns {Picked | null} */
  pick(px, py) {
    const x = this.view.mmX(px), y = this.view.mmY(py), reach = REACH / this.view.scale;
    const found = this._pick(x, y, reach), { edited, main, part, which } = this;
    if (!edited || !main || found?.issue !== undefined || found?.mark !== undefined) return found;
    const near = edited.near(x, y, reach);
    if (found?.hole === undefined || !part) {
      if (near) return { ...found, stop: near.number, which };
      return found && { ...found, stop: main.scene.stopOf(/** @type {number} */ (found.row)) };
    }
    const at = edited.near(...part.holePlace(found.hole), 0.02) ?? near;
    return at ? { ...found, stop: at.number, which } : found;
  }

  /** Return the layer of the outline at a screen position, or null. It is not picked below the pointer, because that
   * tests all outlines.
   * @param {number} px @param {number} py @returns {Picked | null} */
  layerAt(px, py) {
    const { ctx } = this, ratio = this.ratio(), frame = new Frame(this.view, ratio);
    if (this.main) return null;
    for (const layer of this.wholePaths?.layers.keys() ?? []) {
      let hit = false;
      if (!this.hidden.has(layer)) this._strokeLayer(ctx, frame, layer, (path) => { hit ||= ctx.isPointInStroke(path, px * ratio, py * ratio); }, "", 2 * REACH);
      if (hit) return { layer };
    }
    return null;
  }

  /** @param {number} x @param {number} y @param {number} reach @returns {Picked | null} */
  _pick(x, y, reach) {
    const { layers, which } = this, issue = layers.issues ? this._pickIssue(x, y, reach) : -1;
    if (issue >= 0) return { issue };
    const mark = (layers.differences ? this.differences?.near(x, y, 1.3 * reach) : null) ?? -1;
    if (mark >= 0) return this.differing(mark);
    const hole = layers.holes ? this._pickHole(x, y, reach) : -1;
    if (hole >= 0) return { hole, row: this.rowAtHole(hole), which };
    const shown = (/** @type {boolean} */ travel) => (travel ? layers.rapids && !this.edited : layers.cuts);
    const row = this.main?.moveNear(x, y, reach, shown) ?? -1;
    return row >= 0 ? { row, which } : null;
  }

  /** Return a difference's mark, with its line in the program that has it.
   * @param {number} mark @returns {Picked | null} */
  differing(mark) {
    if (!this.differences) return null;
    const difference = this.differences.at(mark).index, [, , original, added] = this.differences.header.differences[difference];
    return { mark, difference, which: added ? "after" : "before", line: added || original };
  }

  /** @param {number} x @param {number} y @param {number} reach */
  _pickIssue(x, y, reach) {
    if (!this.part) return -1;
    const { issue, origin } = this.part;
    for (let k = 0; k < issue.length; k += 3) {
      if (Math.hypot(issue[k] + origin[0] - x, issue[k + 1] + origin[1] - y) <= reach) return issue[k + 2];
    }
    return -1;
  }

  /** @param {number} x @param {number} y @param {number} reach */
  _pickHole(x, y, reach) {
    const { part } = this;
    if (!part?.holes) return -1;
    const { grid, largest } = this._holesGrid(part), [ox, oy] = part.origin;
    // Take the smallest hole under the pointer, so that no hole is hidden by another.
    let best = -1, least = Infinity;
    for (const k of grid.around(x - ox, y - oy, largest + reach)) {
      if (this.hidden.has(part.layerName("hole", k))) continue;
      const [hx, hy] = part.holePlace(k), radius = part.holeRadius(k), away = Math.hypot(hx - x, hy - y) - radius;
      const score = Math.max(away, 0) * 1e6 + radius;
      if (away <= reach && score < least) {
        least = score;
        best = k;
      }
    }
    return best;
  }

  /** Return the first row of the toolpath that works at a hole, or undefined.
   * @param {number} hole */
  rowAtHole(hole) {
    const { main, part } = this;
    if (!main || !part) return undefined;
    const stop = main.stopNear(...part.holePlace(hole), Math.max(part.holeRadius(hole) / 2, 0.02));
    return stop < 0 ? undefined : main.scene.stop[stop];
  }

  /** Return the radius of the largest hole at a position, mm; 0 if none.
   * @param {number} x @param {number} y */
  holeRadius(x, y) {
    const { part } = this;
    if (!part?.holes) return 0;
    let radius = 0;
    for (const k of this._holesGrid(part).grid.around(x - part.origin[0], y - part.origin[1], 0.05)) {
      const [hx, hy] = part.holePlace(k);
      if (Math.hypot(hx - x, hy - y) <= 0.05) radius = Math.max(radius, part.holeRadius(k));
    }
    return radius;
  }

  /** Return the grid of the part's holes, and the largest radius.
   * @param {PartScene} part */
  _holesGrid(part) {
    if (!this._holes) {
      let largest = 0;
      for (let k = 0; k < part.holes; k++) largest = Math.max(largest, part.holeRadius(k));
      this._holes = { grid: gridOfPoints(part, part.holes, (k) => [part.hole[3 * k], part.hole[3 * k + 1]]), largest };
    }
    return this._holes;
  }
}

/** Return the path of a row up to a fraction.
 * @param {ToolpathScene} scene @param {number} row @param {number} share */
function partOfRow(scene, row, share) {
  const arc = scene.arcAt(row), path = new Path2D();
  if (arc) path.arc(arc[0], arc[1], arc[2], arc[3], arc[3] + share * arc[4], arc[4] < 0);
  else {
    const [x, y] = scene.along(row, share);
    path.moveTo(scene.x0(row), scene.y0(row));
    path.lineTo(x, y);
  }
  return path;
}
