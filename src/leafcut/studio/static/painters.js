// Painters of a pane's layers: ground (pheromone, cleared area, kerf, part), paths, finished moves, and marks.

import { isDense, paintDensity } from "./density.js";
import { paintDifferences } from "./differences.js";
import { drawEnds, paintArrows, paintNumbers } from "./marks.js";
import { pathsOfRows } from "./paths.js";
import { linePath } from "./pen.js";
import { firstWhere } from "./search.js";
import { colourOf } from "./theme.js";
import { paintWhole } from "./whole.js";

/** @import { Frame, Steps } from "./buffer.js" */
/** @import { Route } from "./marks.js" */
/** @import { Pane, Track } from "./pane.js" */
/** @import { PartPaths } from "./paths.js" */
/** @import { PartScene, PathScene, PheromoneScene, ToolpathScene } from "./scene.js" */
/** @import { Colours } from "./theme.js" */
/** @typedef {(ctx: Context, frame: Frame, pane: Pane) => Steps} Painter */
/** Colour, width in pixels, and opacity.
 * @typedef {[string, number, number]} Stroke */
/** @typedef {{ rapid: Stroke, cut: Stroke, lead: string }} Style */

const STRENGTHS = 8;
const RAPID_WIDTH = 1.15, CUT_WIDTH = 1.9, RIM = 1.2;
/** Kinds of moves, with their layers. */
const MOVES = /** @type {["rapid" | "cut", string][]} */ ([["rapid", "rapids"], ["cut", "cuts"]]);

/** Paint the ground: pheromone, kerf, outlines, slots and holes.
 * @type {Painter} */
export function* paintGround(ctx, frame, pane) {
  const { layers, colours, pheromone, partPaths, wholePaths } = pane;
  if (layers.pheromone && pheromone) yield* paintPheromone(ctx, frame, pheromone, colours);
  if (layers.whole && wholePaths) yield* paintWhole(ctx, frame, wholePaths, pane);
  if (layers.holes && partPaths) yield* paintPart(ctx, frame, partPaths, colours);
  if (layers.cleared) for (const track of pane.tracks) yield* paintCleared(ctx, frame, track, colours);
  if (layers.kerf) for (const track of pane.tracks) yield* paintKerf(ctx, frame, track, colours);
}

/** @param {Context} ctx @param {Frame} frame @param {PheromoneScene} scene @param {Colours} colours @returns {Steps} */
function* paintPheromone(ctx, frame, scene, colours) {
  const { point, edge, strength } = scene, paths = Array.from({ length: STRENGTHS }, () => new Path2D());
  const counts = new Array(STRENGTHS).fill(0);
  frame.inMm(ctx, scene.origin);
  for (let k = 0; k < strength.length; k++) {
    const level = Math.min(Math.floor(strength[k] * STRENGTHS), STRENGTHS - 1);
    if (!(strength[k] > 0.02)) continue;
    const a = 2 * edge[2 * k], b = 2 * edge[2 * k + 1];
    paths[level].moveTo(point[a], point[a + 1]);
    paths[level].lineTo(point[b], point[b + 1]);
    counts[level]++;
  }
  ctx.strokeStyle = colours.accent;
  ctx.lineCap = "round";
  for (let level = 0; level < STRENGTHS; level++) {
    if (!counts[level]) continue;
    const part = (level + 0.5) / STRENGTHS;
    ctx.lineWidth = (0.7 + 5.6 * part ** 1.5) / frame.scale;
    ctx.globalAlpha = 0.05 + 0.55 * part;
    ctx.stroke(paths[level]);
    ctx.globalAlpha = 1;
    yield counts[level];
  }
}

/** Fill the area cleared by a mill in one pass, so that adjacent passes do not darken it.
 * @param {Context} ctx @param {Frame} frame @param {Track} track @param {Colours} colours @returns {Steps} */
function* paintCleared(ctx, frame, { scene, paths }, colours) {
  const width = scene.header.cleared, band = new Path2D();
  if (!setBand(ctx, frame, scene, colours, width)) return;
  let cost = 0;
  for (const [{ cut, costs }] of paths.visible(frame.seen, frame.scale)) {
    band.addPath(cut);
    cost += 2 * costs.cut;
  }
  ctx.globalAlpha = 0.16;
  ctx.stroke(band);
  ctx.globalAlpha = 1;
  yield cost;
}

/** @param {Context} ctx @param {Frame} frame @param {Track} track @param {Colours} colours @returns {Steps} */
function* paintKerf(ctx, frame, { scene, paths }, colours) {
  if (!setBand(ctx, frame, scene, colours, scene.header.kerf)) return;
  ctx.globalAlpha = 0.22;
  for (const [{ cut, costs }] of paths.visible(frame.seen, frame.scale)) {
    ctx.stroke(cut);
    yield 2 * costs.cut;
  }
  ctx.globalAlpha = 1;
}

/** Set the stroke of a band of a width, mm; return whether it is visible.
 * @param {Context} ctx @param {Frame} frame @param {ToolpathScene} scene @param {Colours} colours @param {number} width */
function setBand(ctx, frame, scene, colours, width) {
  frame.inMm(ctx, scene.origin);
  ctx.strokeStyle = colours.cut;
  ctx.lineWidth = width;
  ctx.lineCap = ctx.lineJoin = "round";
  return width * frame.scale >= 1.5;
}

/** @param {Context} ctx @param {Frame} frame @param {PartPaths} paths @param {Colours} colours @returns {Steps} */
function* paintPart(ctx, frame, paths, colours) {
  const { part } = paths, px = 1 / frame.scale;
  frame.inMm(ctx, part.origin);
  ctx.lineJoin = "round";
  for (const [kind, stroke, fill] of [
    ["sheet", colours["line-2"]], ["pocket", colours["hole-rim"], colours.hole],
    ["cut", colours["hole-rim"], part.header.filled && colours["accent-soft"]], ["mark", colours.idle],
  ]) {
    const outlines = paths.outlines[kind];
    if (!outlines) continue;
    if (fill) {
      ctx.fillStyle = fill;
      ctx.fill(outlines.whole, "evenodd");
      yield part.vertex.length / 3;
    }
    ctx.strokeStyle = stroke;
    ctx.lineWidth = 1.1 * px;
    for (const [path, cost] of outlines.visible(frame.seen, frame.scale)) {
      ctx.stroke(path);
      yield cost;
    }
  }
  yield* paintSlots(ctx, paths, colours, px);
  yield* paintHoles(ctx, frame, paths, colours);
}

/** @param {Context} ctx @param {PartPaths} paths @param {Colours} colours @param {number} px @returns {Steps} */
function* paintSlots(ctx, { part, slots }, colours, px) {
  ctx.lineCap = "round";
  for (const k of slots) {
    const [x0, y0, x1, y1, width] = part.slot.subarray(5 * k, 5 * k + 5), inner = width - 2 * RIM * px;
    ctx.beginPath();
    ctx.moveTo(x0, y0);
    ctx.lineTo(x1, y1);
    ctx.strokeStyle = colours["hole-rim"];
    ctx.lineWidth = Math.max(width, px);
    if (width > 0) ctx.stroke();
    ctx.strokeStyle = colours.hole;
    ctx.lineWidth = Math.max(inner, px);
    if (inner > 0) ctx.stroke();
  }
  if (slots.length) yield 4 * slots.length;
}

/** @param {Context} ctx @param {Frame} frame @param {PartPaths} paths @param {Colours} colours @returns {Steps} */
function* paintHoles(ctx, frame, paths, colours) {
  const { part } = paths, seen = frame.seen, px = 1 / frame.scale, few = part.holes <= 3000, plain = part.tools.length < 2;
  if (isDense(part, frame.scale)) {
    paintDensity(ctx, paths.density, frame.scale, colours["hole-rim"]);
    yield 400;
    return;
  }
  const room = Math.sqrt(((seen[2] - seen[0]) * (seen[3] - seen[1])) / Math.max(part.holes, 1));
  const smallest = Math.max(Math.min((few ? 3 : 1.1) * px, 0.3 * room), 0.5 * px);
  for (const piece of paths.visibleHoles(seen, smallest)) {
    const path = paths.holes(piece, smallest), colour = colourOf(colours, part.tools, piece.tool, colours["hole-rim"]);
    ctx.fillStyle = plain ? colours.hole : colour;
    ctx.globalAlpha = plain ? 1 : 0.22;
    ctx.fill(path);
    ctx.globalAlpha = 1;
    ctx.strokeStyle = colour;
    ctx.lineWidth = RIM * px;
    ctx.stroke(path);
    yield 3 * piece.holes.length;
  }
}

/** Paint all moves of a toolpath, pale if it only serves as a comparison.
 * @type {Painter} */
export function* paintPaths(ctx, frame, pane) {
  for (const { scene, paths, pale } of pane.tracks) {
    const style = styleOf(pane, scene, frame, pale || Boolean(pane.live));
    for (const [move, layer] of MOVES) {
      if (!pane.layers[layer]) continue;
      frame.inMm(ctx, scene.origin);
      setStroke(ctx, style[move], frame.scale);
      for (const [traced] of paths.visible(frame.seen, frame.scale)) {
        ctx.stroke(traced[move]);
        yield traced.costs[move] + 1;
      }
    }
    if (pane.layers.cuts) paintLeads(ctx, frame, scene, style);
    ctx.globalAlpha = 1;
  }
  if (pane.live && pane.layers.rapids) yield* paintLive(ctx, frame, pane.edited ?? pane.live, pane.colours);
}

/** Paint the best path of a running search.
 * @param {Context} ctx @param {Frame} frame @param {PathScene} scene @param {Colours} colours @returns {Steps} */
function* paintLive(ctx, frame, scene, colours) {
  frame.inMm(ctx, scene.origin);
  setStroke(ctx, [colours.rapid, scene.point.length > 4000 ? RAPID_WIDTH : 1.6, 1], frame.scale);
  ctx.stroke(scene.path);
  yield scene.point.length / 2;
}

/** @param {Pane} pane @param {ToolpathScene} scene @param {Frame} frame @returns {Style} */
function styleOf({ colours }, scene, frame, pale = false) {
  if (pale) return { rapid: [colours.before, 1.6, 0.9], cut: [colours.before, 2.2, 0.9], lead: colours.before };
  const { width, height } = frame.view, dense = Math.min(1, Math.max(0.55, 6 * Math.sqrt((width * height) / 1e4 / (scene.rows + 1))));
  return { rapid: [colours.rapid, RAPID_WIDTH * dense, 1], cut: [colours.cut, CUT_WIDTH * dense, 1], lead: colours.change };
}

/** @param {Context} ctx @param {Stroke} stroke @param {number} scale */
function setStroke(ctx, [colour, width, alpha], scale) {
  ctx.strokeStyle = colour;
  ctx.lineWidth = width / scale;
  ctx.globalAlpha = alpha;
  ctx.lineCap = "butt";
  ctx.lineJoin = "round";
}

/** @param {Context} ctx @param {Frame} frame @param {ToolpathScene} scene @param {Style} style */
function paintLeads(ctx, frame, scene, style) {
  if (!scene.lead.length) return;
  frame.inMm(ctx, scene.origin);
  setStroke(ctx, [style.lead, 2, 1], frame.scale);
  ctx.stroke((scene.leadPath ??= linePath(scene.lead)));
}

/** Paint the moves before a row.
 * @type {Painter} */
export function* paintDone(ctx, frame, pane) {
  const { main, doneRow: end } = pane;
  if (!main) return;
  const { scene, paths } = main, style = styleOf(pane, scene, frame);
  pane.paintedRow = end;
  for (const [move, layer] of MOVES) {
    if (!pane.layers[layer]) continue;
    frame.inMm(ctx, scene.origin);
    setStroke(ctx, style[move], frame.scale);
    for (const [traced, piece] of paths.visible(frame.seen, frame.scale)) {
      if (piece.first >= end) break;
      const drawn = piece.end <= end ? traced : pathsOfRows(scene, piece.first, end);
      ctx.stroke(drawn[move]);
      yield drawn.costs[move];
    }
  }
  if (pane.layers.cuts) paintDrilled(ctx, frame, pane, main, 0, end);
  yield 10;
}

/** Paint a dot at every hole drilled in the rows from `first` to before `end`.
 * @param {Context} ctx @param {Frame} frame @param {Pane} pane @param {Track} track @param {number} first
 * @param {number} end */
function paintDrilled(ctx, frame, pane, { scene, drillRadius }, first, end) {
  const { stop, origin } = scene, seen = frame.seen, path = new Path2D();
  const radius = Math.min(Math.max(drillRadius * frame.scale, 1.2), 3.4);
  frame.inPixels(ctx);
  for (let k = firstWhere(stop.length, (at) => stop[at] >= first); k < stop.length && stop[k] < end; k++) {
    if (scene.moves(stop[k])) continue;
    const [sx, sy] = scene.stopPlace(k), x = sx + origin[0], y = sy + origin[1];
    if (!(x >= seen[0] && x <= seen[2] && y >= seen[1] && y <= seen[3])) continue;
    const px = frame.toX(x), py = frame.toY(y);
    path.moveTo(px + radius, py);
    path.arc(px, py, radius, 0, 2 * Math.PI);
  }
  ctx.globalAlpha = 1;
  ctx.fillStyle = pane.colours.cut;
  ctx.fill(path);
}

/** Add the rows from `first` to before `end` to the finished moves.
 * @param {Context} ctx @param {Frame} frame @param {Pane} pane @param {Track} track @param {number} first
 * @param {number} end */
export function paintMore(ctx, frame, pane, track, first, end) {
  const { scene } = track, drawn = pathsOfRows(scene, first, end), style = styleOf(pane, scene, frame);
  if (pane.layers.cuts) paintDrilled(ctx, frame, pane, track, first, end);
  for (const [move, layer] of MOVES) {
    if (!pane.layers[layer]) continue;
    frame.inMm(ctx, scene.origin);
    setStroke(ctx, style[move], frame.scale);
    ctx.stroke(drawn[move]);
  }
}

/** Paint the marks: arrows, pierces, first and last stop, numbers, issues.
 * @type {Painter} */
export function* paintMarks(ctx, frame, pane) {
  const { layers, colours, main, edited, part } = pane;
  if (main) {
    const route = edited ?? main.scene;
    if (layers.arrows && layers.rapids) yield* paintArrows(ctx, frame, route, colours.rapid);
    if (layers.cuts && main.scene.pierce.length) yield* paintPierces(ctx, frame, route, colours);
    if (edited) drawEnds(ctx, frame, edited, colours, edited.held[0] - 1, edited.held.at(-1) ? edited.rows - 1 : -1);
    else drawEnds(ctx, frame, route, colours, 0, main.scene.stop.length - 1);
    if (layers.numbers) {
      const { numbers } = edited ?? main;
      yield* paintNumbers(ctx, frame, route, numbers, colours, (x, y) => pane.holeRadius(x, y));
    }
  }
  if (layers.extents) paintExtents(ctx, frame, pane);
  if (layers.issues && part) {
    paintMissing(ctx, frame, part, colours);
    paintIssues(ctx, frame, part, colours);
  }
  if (layers.differences && pane.differences) paintDifferences(ctx, frame, pane.differences, colours);
  yield 10;
}

/** @param {Context} ctx @param {Frame} frame @param {Route} scene @param {Colours} colours @returns {Steps} */
function* paintPierces(ctx, frame, { pierce, origin }, colours) {
  const path = new Path2D(), size = 3.2;
  frame.inPixels(ctx);
  for (let k = 0; k < pierce.length; k += 3) {
    const px = frame.toX(pierce[k] + origin[0]), py = frame.toY(pierce[k + 1] + origin[1]);
    path.moveTo(px + size, py);
    path.arc(px, py, size, 0, 2 * Math.PI);
  }
  ctx.fillStyle = colours.change;
  ctx.strokeStyle = colours.card;
  ctx.lineWidth = 1.5;
  ctx.stroke(path);
  ctx.fill(path);
  yield pierce.length;
}

/** @param {Context} ctx @param {Frame} frame @param {Pane} pane */
function paintExtents(ctx, frame, pane) {
  const e = pane.workedExtents;
  if (!e) return;
  frame.inPixels(ctx);
  ctx.strokeStyle = pane.colours["line-2"];
  ctx.lineWidth = 1;
  ctx.setLineDash([5, 4]);
  ctx.strokeRect(frame.toX(e[0]), frame.toY(e[3]), (e[2] - e[0]) * frame.scale, (e[3] - e[1]) * frame.scale);
  ctx.setLineDash([]);
}

/** Hatch missing work in red.
 * @param {Context} ctx @param {Frame} frame @param {PartScene} part @param {Colours} colours */
function paintMissing(ctx, frame, part, colours) {
  frame.inPixels(ctx);
  ctx.strokeStyle = colours.bad;
  ctx.lineWidth = 1.2;
  for (const ring of /** @type {[number, number][][]} */ (part.header.missing ?? [])) {
    const points = ring.map(([x, y]) => [frame.toX(x), frame.toY(y)]);
    const xs = points.map(([x]) => x), ys = points.map(([, y]) => y);
    const left = Math.max(Math.min(...xs), 0), right = Math.min(Math.max(...xs), ctx.canvas.width);
    const top = Math.max(Math.min(...ys), 0), bottom = Math.min(Math.max(...ys), ctx.canvas.height);
    const outline = linePath(points.flat()), hatching = new Path2D();
    outline.closePath();
    for (let sum = Math.ceil((left + top) / 7) * 7; sum < right + bottom; sum += 7) {
      hatching.moveTo(sum - bottom, bottom);
      hatching.lineTo(sum - top, top);
    }
    ctx.stroke(outline);
    ctx.save();
    ctx.clip(outline);
    ctx.stroke(hatching);
    ctx.restore();
  }
}

/** @param {Context} ctx @param {Frame} frame @param {PartScene} part @param {Colours} colours */
function paintIssues(ctx, frame, part, colours) {
  frame.inPixels(ctx);
  for (let k = 0; k < part.issue.length; k += 3) {
    const px = frame.toX(part.issue[k] + part.origin[0]), py = frame.toY(part.issue[k + 1] + part.origin[1]);
    const severity = part.header.issues[part.issue[k + 2]]?.[1];
    const isNote = severity === "note"; // a dot, since a triangle would warn
    ctx.beginPath();
    if (isNote) ctx.arc(px, py, 4, 0, 2 * Math.PI);
    else {
      ctx.moveTo(px, py - 8);
      ctx.lineTo(px + 8, py + 6);
      ctx.lineTo(px - 8, py + 6);
      ctx.closePath();
    }
    ctx.fillStyle = severity === "missing" ? colours.bad : isNote ? colours["ink-2"] : colours.warn;
    ctx.strokeStyle = colours.card;
    ctx.lineWidth = 2;
    ctx.stroke();
    ctx.fill();
    if (isNote) continue;
    ctx.fillStyle = colours.card;
    ctx.fillRect(px - 0.9, py - 3.2, 1.8, 5);
    ctx.fillRect(px - 0.9, py + 2.8, 1.8, 1.8);
  }
}
