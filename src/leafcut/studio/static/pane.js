// A pane: a canvas with one or two toolpaths over a part, composed of cached layers.

import { Buffer, Frame, budget } from "./buffer.js";
import { ringMark } from "./differences.js";
import { drawGrid, drawMachine, drawRulers, drawScaleBar, drawTool } from "./marks.js";
import { distanceToMove, gridOfHoles, gridOfMoves, nearest } from "./hit_test.js";
import { paintDone, paintGround, paintMarks, paintMore, paintPaths } from "./painters.js";
import { PartPaths, ToolpathPaths, pathsOfRows } from "./paths.js";
import { DARK, RAPID, STAND, numberOrder } from "./scene.js";
import { stopNear } from "./stops.js";
import { coloursOf } from "./theme.js";

const PALE = 0.3;
const REACH = 7; // maximum distance to the pointer, pixels

/** A toolpath with derived data: pieces, the order of its numbers, and the grid for the pointer. */
export class Track {
  constructor(scene) {
    this.scene = scene;
    this.paths = new ToolpathPaths(scene);
    this.numbers = numberOrder(scene.stop.length);
    this.pale = false;
    this._grid = null;
    const e = scene.extents ?? [0, 0, 1, 1];
    /** Radius of the dots for drilled holes, mm, small enough that few of them overlap. */
    this.drillRadius = 0.2 * Math.sqrt(((e[2] - e[0]) * (e[3] - e[1])) / Math.max(scene.stop.length, 1));
  }

  get grid() { return (this._grid ??= gridOfMoves(this.scene)); }
}

export class Pane extends EventTarget {
  /** `shared`: state common to all panes: view, layers, and the selection. */
  constructor(host, shared, label) {
    super();
    this.host = host;
    this.shared = shared;
    this.view = shared.view;
    this.layers = shared.layers;
    this.canvas = document.createElement("canvas");
    this.canvas.className = "lc-canvas";
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", label);
    host.append(this.canvas);
    this.ctx = this.canvas.getContext("2d", { alpha: true });
    this.whole = this.wholePaths = this.part = this.partPaths = this.pheromone = this.live = this.main = this.differences = null;
    this.tracks = [];
    this.time = null; // seconds; null: no playback
    this.doneRow = this.paintedRow = 0;
    this.hovered = null;
    this.drag = null;
    this.buffers = {
      ground: new Buffer((ctx, frame) => paintGround(ctx, frame, this)),
      path: new Buffer((ctx, frame) => paintPaths(ctx, frame, this)),
      done: new Buffer((ctx, frame) => paintDone(ctx, frame, this)),
      marks: new Buffer((ctx, frame) => paintMarks(ctx, frame, this)),
    };
    this.colours = {};
  }

  /** Read the colours again; the pane must be on the page. */
  restyle() {
    this.colours = coloursOf(this.host);
    this.invalidate();
  }

  /** Show a part over the whole drawing; `drawnLayers` are the names of all layers, `hidden` those not shown. */
  setPart(scene, paths, whole, wholePaths, drawnLayers, hidden) {
    Object.assign(this, { whole, wholePaths, drawnLayers, hidden });
    this.part = scene;
    this.partPaths = paths;
    this._holes = null;
    this.invalidate("ground", "marks");
  }

  /** Show toolpaths; `main` is used for numbers, playback and the selection. */
  setTracks(tracks, main) {
    this.tracks = tracks;
    this.main = main;
    this.hovered = null;
    this.invalidate();
  }

  setPheromone(scene) {
    this.pheromone = scene;
    this.invalidate("ground");
  }

  setDifferences(scene) {
    this.differences = scene;
    this.invalidate("marks");
  }

  setLive(scene) {
    this.live = scene;
    this.invalidate("path", "marks");
  }

  /** The edited order, which replaces the toolpath for numbers, marks and dragging. */
  get edited() { return this.live?.visit && this.main ? this.live.settled(this.main.scene) : null; }

  /** Smallest x and y, largest x and y of the whole drawing, or of the machined objects only. */
  get extents() { return around([this.whole, ...this._worked]); }

  get workedExtents() { return around(this._worked); }

  get _worked() { return [this.part, this.pheromone, this.live, ...this.tracks.map((track) => track.scene)]; }


  invalidate(...names) {
    for (const name of names.length ? names : Object.keys(this.buffers)) this.buffers[name].invalidate();
    this.dirty = true;
  }

  /** Show the state at a time, s; null: everything, without a tool. */
  setTime(time) {
    const { main } = this;
    const was = this.time;
    this.time = main ? time : null;
    this.dirty = true;
    if (this.time === null) return;
    const at = main.scene.at(Math.min(time, main.scene.duration));
    this.at = at;
    this.doneRow = time >= main.scene.duration ? main.scene.rows : at.row;
    if (was === null || this.doneRow < this.paintedRow) this.buffers.done.invalidate();
  }

  /** Continue painting; return whether something is left to paint. */
  frame() {
    const { view, canvas, ctx } = this, ratio = this.ratio();
    const names = this.time === null ? ["ground", "path", "marks"] : ["ground", "path", "done", "marks"];
    const waiting = names.filter((name) => !this.buffers[name].ready(view));
    if (!waiting.length && !this.dirty) return false;
    let left = budget.segments;
    for (const name of waiting) {
      if (left > 0) left -= this.buffers[name].step(view, ratio, left);
    }
    this._catchUp(ratio);
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.clearRect(0, 0, canvas.width, canvas.height);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (this.layers.grid) drawGrid(ctx, view, this.colours);
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    this.buffers.ground.blit(ctx, view, ratio);
    this.buffers.path.blit(ctx, view, ratio, this.time === null ? 1 : PALE);
    if (this.time !== null) this.buffers.done.blit(ctx, view, ratio);
    this.buffers.marks.blit(ctx, view, ratio, this.time === null ? 1 : 0.75);
    this._overlay(ctx, ratio);
    this.dirty = names.some((name) => !this.buffers[name].ready(view));
    return this.dirty;
  }

  ratio() { return Math.min(window.devicePixelRatio || 1, 3); }

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

  /** Add the rows run since the last frame to the finished moves. */
  _catchUp(ratio) {
    const { done } = this.buffers;
    if (this.time === null || !done.ready(this.view) || this.doneRow <= this.paintedRow) return;
    if (this.doneRow - this.paintedRow > 20000) {
      done.invalidate();
      return;
    }
    paintMore(done.context(), new Frame(done.front.view, ratio, done.margin), this, this.paintedRow, this.doneRow);
    this.paintedRow = this.doneRow;
  }

  /** Draw what changes in every frame: selection, hover, tool, drag; then the rulers. */
  _overlay(ctx, ratio) {
    const { view, colours } = this, frame = new Frame(view, ratio);
    const { selected } = this.shared;
    if (selected) this._highlight(ctx, frame, selected, colours.accent, 1);
    if (this.hovered) this._highlight(ctx, frame, this.hovered, colours.ink, 0.75);
    if (this.time !== null && this.main) this._current(ctx, frame);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (this.shared.tool) drawMachine(ctx, view, colours, this.shared.tool);
    if (this.drag) this._dragLine(ctx);
    const unit = [this.part, this.main?.scene].some((scene) => scene?.header.unitless) ? "" : "mm";
    this.shared.placement.draw(ctx, view, colours);
    this.shared.measure.draw(ctx, view, colours);
    if (this.layers.grid) drawRulers(ctx, view, colours, unit);
    drawScaleBar(ctx, view, colours, unit);
  }

  _current(ctx, frame) {
    const { main, at, colours, view } = this, { scene } = main, what = scene.doing[at.row];
    const working = what !== RAPID && what !== DARK && what !== STAND;
    if (scene.moves(at.row)) {
      frame.inMm(ctx, scene.origin);
      ctx.strokeStyle = working ? colours.cut : colours.rapid;
      ctx.lineWidth = (working ? 2.4 : 1.6) / frame.scale;
      ctx.beginPath();
      partOfRow(ctx, scene, at.row, at.share);
      ctx.stroke();
    }
    ctx.setTransform(frame.ratio, 0, 0, frame.ratio, 0, 0);
    drawTool(ctx, view, colours, at.x, at.y, working);
  }

  _highlight(ctx, frame, what, colour, alpha) {
    ctx.globalAlpha = alpha;
    if (what.mark !== undefined && this.differences) ringMark(ctx, frame, this.differences.at(what.mark), colour);
    if (what.hole !== undefined && this.part && what.hole < this.part.holes) this._ringHole(ctx, frame, what.hole, colour);
    const drawn = what.row !== undefined && what.which === this.main?.scene.header.which;
    const { scene } = this.main ?? {}, still = !this.edited || (scene.pierce.length && !scene.idle(what.row));
    if (drawn && still) this._strokeRows(ctx, frame, what.row, colour);
    if (this.edited && what.stop) this._strokeWay(ctx, frame, this.edited.indexOf(what.stop), colour);
    ctx.globalAlpha = 1;
  }

  _ringHole(ctx, frame, hole, colour) {
    const { part } = this, x = part.hole[3 * hole] + part.origin[0], y = part.hole[3 * hole + 1] + part.origin[1];
    const radius = Math.max((part.hole[3 * hole + 2] / 2) * frame.scale, 4) + 4;
    frame.inPixels(ctx);
    ctx.strokeStyle = colour;
    ctx.lineWidth = 2.5;
    ctx.beginPath();
    ctx.arc(frame.toX(x), frame.toY(y), radius, 0, 2 * Math.PI);
    ctx.stroke();
  }

  _strokeRows(ctx, frame, row, colour) {
    const { scene } = this.main, [first, last] = scene.together(row), paths = pathsOfRows(scene, first, last + 1);
    frame.inMm(ctx, scene.origin);
    ctx.strokeStyle = colour;
    ctx.lineWidth = 3.4 / frame.scale;
    ctx.lineCap = "round";
    ctx.stroke(paths.rapid);
    ctx.stroke(paths.cut);
    const px = frame.toX(scene.x1(last) + scene.origin[0]), py = frame.toY(scene.y1(last) + scene.origin[1]);
    if (!Number.isFinite(px + py)) return;
    frame.inPixels(ctx);
    ctx.fillStyle = colour;
    ctx.beginPath();
    ctx.arc(px, py, 4, 0, 2 * Math.PI);
    ctx.fill();
  }

  /** Draw the move to a stop in the edited order, and the stop. */
  _strokeWay(ctx, frame, k, colour) {
    const { edited } = this, [ox, oy] = edited.origin, px = frame.toX(edited.x1(k) + ox), py = frame.toY(edited.y1(k) + oy);
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
    ctx.beginPath();
    ctx.arc(px, py, 4, 0, 2 * Math.PI);
    ctx.fill();
  }

  _dragLine(ctx) {
    const { from, to } = this.drag;
    ctx.strokeStyle = this.colours.accent;
    ctx.lineWidth = 1.6;
    ctx.setLineDash([4, 4]);
    ctx.beginPath();
    ctx.moveTo(this.view.toX(from[0]), this.view.toY(from[1]));
    ctx.lineTo(this.view.toX(to[0]), this.view.toY(to[1]));
    ctx.stroke();
    ctx.setLineDash([]);
    ctx.beginPath();
    ctx.arc(this.view.toX(to[0]), this.view.toY(to[1]), 6, 0, 2 * Math.PI);
    ctx.stroke();
  }

  /** Return the object at a screen position: { issue }, { hole, row, which } or { row, which }, or null; for an
   * edited order also the `stop`: its number in the toolpath, from 1. */
  pick(px, py) {
    const found = this._pick(px, py), { edited } = this;
    if (!edited || found?.issue !== undefined || found?.mark !== undefined) return found;
    const reach = REACH / this.view.scale, near = edited.near(this.view.mmX(px), this.view.mmY(py), reach);
    if (!near && found?.hole === undefined) return found && { ...found, stop: this.main.scene.stopOf(found.row) };
    const { part } = this, hole = found?.hole, at = hole === undefined ? near : edited.near(
      part.hole[3 * hole] + part.origin[0], part.hole[3 * hole + 1] + part.origin[1], 0.02) ?? near;
    return at ? { ...found, stop: at.number, which: this.main.scene.header.which } : found;
  }

  _pick(px, py) {
    const x = this.view.mmX(px), y = this.view.mmY(py), reach = REACH / this.view.scale;
    const issue = this.layers.issues ? this._pickIssue(x, y, reach) : -1;
    if (issue >= 0) return { issue };
    const mark = this.layers.differences ? this.differences?.near(x, y, 1.3 * reach) ?? -1 : -1;
    if (mark >= 0) return this._differing(mark);
    const hole = this.layers.holes ? this._pickHole(x, y, reach) : -1;
    if (hole >= 0) return { hole, row: this._rowAtHole(hole), which: this.main?.scene.header.which };
    const { main } = this;
    if (!main) return null;
    const [ox, oy] = main.scene.origin;
    const [row] = nearest(main.grid, x - ox, y - oy, reach, (item) => {
      const rapid = main.scene.doing[item] === RAPID || main.scene.doing[item] === DARK;
      if (!this.layers[rapid ? "rapids" : "cuts"] || (rapid && this.edited)) return Infinity;
      return distanceToMove(main.scene, item, x - ox, y - oy) + (rapid ? reach * 0.2 : 0);
    });
    return row >= 0 ? { row, which: main.scene.header.which } : null;
  }

  /** Return the description of a difference's mark, with its line in the program that has it. */
  _differing(mark) {
    const difference = this.differences.at(mark).index, [, , original, added] = this.differences.header.differences[difference];
    return { mark, difference, which: added ? "after" : "before", line: added || original };
  }

  _pickIssue(x, y, reach) {
    const { issue, origin } = this.part ?? { issue: [] };
    for (let k = 0; k < issue.length; k += 3) {
      if (Math.hypot(issue[k] + origin[0] - x, issue[k + 1] + origin[1] - y) <= reach) return issue[k + 2];
    }
    return -1;
  }

  _pickHole(x, y, reach) {
    const { part } = this;
    if (!part?.holes) return -1;
    const { grid, largest } = this._holesGrid(), [ox, oy] = part.origin, { hole } = part;
    const away = (k) => this.hidden.has(part.layerName("hole", k)) ? Infinity : Math.max(Math.hypot(hole[3 * k] + ox - x, hole[3 * k + 1] + oy - y) - hole[3 * k + 2] / 2, -hole[3 * k + 2] / 2);
    // Take the smallest hole under the pointer, so that no hole is hidden by another.
    let best = -1, least = Infinity;
    grid.around(x - ox, y - oy, largest + reach, (k) => {
      const d = away(k), score = Math.max(d, 0) * 1e6 + hole[3 * k + 2];
      if (d <= reach && score < least) {
        least = score;
        best = k;
      }
    });
    return best;
  }

  /** Return the first row of the toolpath that works at a hole, or undefined. */
  _rowAtHole(hole) {
    const { main, part } = this;
    if (!main) return undefined;
    const x = part.hole[3 * hole] + part.origin[0], y = part.hole[3 * hole + 1] + part.origin[1];
    const stop = this.stopNear(x, y, Math.max(part.hole[3 * hole + 2] / 4, 0.02));
    return stop < 0 ? undefined : main.scene.stop[stop];
  }

  /** Return the radius of the largest hole at a position, mm; 0 if none. */
  holeRadius(atX, atY) {
    if (!this.part?.holes) return 0;
    const x = atX - this.part.origin[0], y = atY - this.part.origin[1], { hole } = this.part;
    let radius = 0;
    this._holesGrid().grid.around(x, y, 0.05, (k) => {
      if (Math.hypot(hole[3 * k] - x, hole[3 * k + 1] - y) <= 0.05) radius = Math.max(radius, hole[3 * k + 2] / 2);
    });
    return radius;
  }

  /** Return the grid of the part's holes, and the largest radius. */
  _holesGrid() {
    if (!this._holes) {
      let largest = 0;
      for (let k = 2; k < this.part.hole.length; k += 3) largest = Math.max(largest, this.part.hole[k] / 2);
      this._holes = { grid: gridOfHoles(this.part), largest };
    }
    return this._holes;
  }

  /** Return the number (from 0) of the first stop within `reach` mm of a position, or -1. */
  stopNear(x, y, reach) { return stopNear(this.main, x, y, reach); }
}

/** Return the bounding box of the scenes that have extents. */
function around(scenes) {
  const every = scenes.filter((scene) => scene?.extents).map((scene) => scene.extents);
  if (!every.length) return null;
  return [Math.min, Math.min, Math.max, Math.max].map((pick, k) => pick(...every.map((e) => e[k])));
}

function partOfRow(ctx, scene, row, share) {
  const arc = scene.arcAt(row);
  if (arc) {
    ctx.arc(arc[0], arc[1], arc[2], arc[3], arc[3] + share * arc[4], arc[4] < 0);
    return;
  }
  const [x, y] = scene.along(row, share);
  ctx.moveTo(scene.x0(row), scene.y0(row));
  ctx.lineTo(x, y);
}
