// Painters of a pane's layers: ground (pheromone, cleared area, kerf, part), paths, finished moves, and marks.

import { isDense, paintDensity } from "./density.js";
import { paintDifferences } from "./differences.js";
import { drawEnds, paintArrows, paintNumbers } from "./marks.js";
import { pathsOfRows } from "./paths.js";
import { toolColour } from "./theme.js";
import { paintWhole } from "./whole.js";

const STRENGTHS = 8;
const RAPID_WIDTH = 1.15, CUT_WIDTH = 1.9, RIM = 1.2;

/** Paint the ground: pheromone, kerf, outlines, slots and holes; yields between steps. */
export function* paintGround(ctx, frame, pane) {
  const { layers, colours, pheromone, part, partPaths } = pane;
  if (layers.pheromone && pheromone) yield* paintPheromone(ctx, frame, pheromone, colours);
  if (pane.whole && layers.whole) yield* paintWhole(ctx, frame, pane);
  if (part && partPaths && layers.holes) yield* paintPart(ctx, frame, part, partPaths, colours);
  if (layers.cleared) for (const track of pane.tracks) yield* paintCleared(ctx, frame, track, colours);
  if (layers.kerf) for (const track of pane.tracks) yield* paintKerf(ctx, frame, track, colours);
}

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

/** Fill the area cleared by a mill in one pass, so that adjacent passes do not darken it. */
function* paintCleared(ctx, frame, { scene, paths }, colours) {
  const width = scene.header.cleared;
  if (!(width > 0) || width * frame.scale < 1.5) return;
  const level = paths.levelFor(frame.scale), band = new Path2D();
  let cost = 0;
  for (const piece of paths.visible(frame.seen)) {
    const { cut, costs } = paths.paths(piece, level);
    band.addPath(cut);
    cost += 2 * costs.cut;
  }
  frame.inMm(ctx, scene.origin);
  ctx.strokeStyle = colours.cut;
  ctx.lineWidth = width;
  ctx.lineCap = ctx.lineJoin = "round";
  ctx.globalAlpha = 0.16;
  ctx.stroke(band);
  ctx.globalAlpha = 1;
  yield cost;
}

function* paintKerf(ctx, frame, { scene, paths }, colours) {
  const kerf = scene.header.kerf;
  if (!(kerf > 0) || kerf * frame.scale < 1.5) return;
  const level = paths.levelFor(frame.scale);
  frame.inMm(ctx, scene.origin);
  ctx.strokeStyle = colours.cut;
  ctx.lineWidth = kerf;
  ctx.lineCap = ctx.lineJoin = "round";
  ctx.globalAlpha = 0.22;
  for (const piece of paths.visible(frame.seen)) {
    const { cut, costs } = paths.paths(piece, level);
    ctx.stroke(cut);
    yield 2 * costs.cut;
  }
  ctx.globalAlpha = 1;
}

function* paintPart(ctx, frame, part, paths, colours) {
  frame.inMm(ctx, part.origin);
  const px = 1 / frame.scale;
  ctx.lineJoin = "round";
  const fills = { pocket: colours.hole, cut: part.header.filled && colours["accent-soft"] };
  const strokes = { sheet: colours["line-2"], cut: colours["hole-rim"], mark: colours.idle, pocket: colours["hole-rim"] };
  for (const kind of ["sheet", "pocket", "cut", "mark"]) {
    const pieces = paths.strokes(kind);
    if (!pieces) continue;
    if (fills[kind]) {
      ctx.fillStyle = fills[kind];
      ctx.fill(paths.fill(kind), "evenodd");
      yield part.vertex.length / 3;
    }
    ctx.strokeStyle = strokes[kind];
    ctx.lineWidth = 1.1 * px;
    for (const [path, cost] of pieces.visible(frame.seen, frame.scale)) {
      ctx.stroke(path);
      yield cost;
    }
  }
  yield* paintSlots(ctx, part, paths.slots, colours, px);
  yield* paintHoles(ctx, frame, part, paths, colours);
}

function* paintSlots(ctx, part, shown, colours, px) {
  ctx.lineCap = "round";
  for (const k of shown) {
    const [x0, y0, x1, y1, width] = part.slot.subarray(5 * k, 5 * k + 5);
    ctx.beginPath();
    ctx.moveTo(x0, y0);
    ctx.lineTo(x1, y1);
    for (const [colour, wide] of [[colours["hole-rim"], width], [colours.hole, width - 2 * RIM * px]]) {
      if (wide <= 0) continue;
      ctx.strokeStyle = colour;
      ctx.lineWidth = Math.max(wide, px);
      ctx.stroke();
    }
  }
  if (shown.length) yield 4 * shown.length;
}

function* paintHoles(ctx, frame, part, paths, colours) {
  const seen = frame.seen, px = 1 / frame.scale, few = part.holes <= 3000;
  if (isDense(part, frame.scale)) {
    paintDensity(ctx, paths.density, frame.scale, colours["hole-rim"]);
    yield 400;
    return;
  }
  const room = Math.sqrt(((seen[2] - seen[0]) * (seen[3] - seen[1])) / Math.max(part.holes, 1));
  const smallest = Math.max(Math.min((few ? 3 : 1.1) * px, 0.3 * room), 0.5 * px);
  for (const piece of paths.visibleHoles(seen, smallest)) {
    const path = paths.holes(piece, smallest), colour = toolColour(colours, part.tools, piece.tool);
    ctx.fillStyle = part.tools.length < 2 ? colours.hole : colour;
    ctx.globalAlpha = part.tools.length < 2 ? 1 : 0.22;
    ctx.fill(path);
    ctx.globalAlpha = 1;
    ctx.strokeStyle = colour;
    ctx.lineWidth = RIM * px;
    ctx.stroke(path);
    yield 3 * piece.holes.length;
  }
}

/** Paint all moves of a toolpath, pale if it only serves as a comparison; yields between steps. */
export function* paintPaths(ctx, frame, pane) {
  for (const track of pane.tracks) {
    const style = styleOf(pane, pane.live ? { ...track, pale: true } : track, frame);
    const level = track.paths.levelFor(frame.scale);
    for (const what of ["rapid", "cut"]) {
      if (!pane.layers[what === "rapid" ? "rapids" : "cuts"]) continue;
      frame.inMm(ctx, track.scene.origin);
      setStroke(ctx, style[what], frame.scale);
      for (const piece of track.paths.visible(frame.seen)) {
        const paths = track.paths.paths(piece, level);
        ctx.stroke(paths[what]);
        yield paths.costs[what] + 1;
      }
    }
    if (pane.layers.cuts) paintLeads(ctx, frame, track.scene, style);
    ctx.globalAlpha = 1;
  }
  if (pane.live && pane.layers.rapids) yield* paintLive(ctx, frame, pane.edited ?? pane.live, pane.colours);
}

/** Paint the best path of a running search; yields between steps. */
function* paintLive(ctx, frame, scene, colours) {
  frame.inMm(ctx, scene.origin);
  setStroke(ctx, [colours.rapid, scene.point.length > 4000 ? RAPID_WIDTH : 1.6, 1], frame.scale);
  ctx.stroke(scene.path);
  yield scene.point.length / 2;
}

function styleOf(pane, track, frame) {
  const { colours } = pane, dense = Math.min(1, Math.max(0.55, 6 * Math.sqrt((frame.view.width * frame.view.height) / 1e4 / (track.scene.rows + 1))));
  if (track.pale) {
    return { rapid: [colours.before, 1.6, 0.9], cut: [colours.before, 2.2, 0.9], lead: colours.before };
  }
  return { rapid: [colours.rapid, RAPID_WIDTH * dense, 1], cut: [colours.cut, CUT_WIDTH * dense, 1], lead: colours.change };
}

function setStroke(ctx, [colour, width, alpha], scale) {
  ctx.strokeStyle = colour;
  ctx.lineWidth = width / scale;
  ctx.globalAlpha = alpha;
  ctx.lineCap = "butt";
  ctx.lineJoin = "round";
}

function paintLeads(ctx, frame, scene, style) {
  if (!scene.lead.length) return;
  const path = (scene.leadPath ??= leadPath(scene.lead));
  frame.inMm(ctx, scene.origin);
  setStroke(ctx, [style.lead ?? style.cut[0], 2, 1], frame.scale);
  ctx.stroke(path);
}

function leadPath(lead) {
  const path = new Path2D();
  let down = false;
  for (let k = 0; k < lead.length; k += 2) {
    if (!Number.isFinite(lead[k])) down = false;
    else if (down) path.lineTo(lead[k], lead[k + 1]);
    else {
      path.moveTo(lead[k], lead[k + 1]);
      down = true;
    }
  }
  return path;
}

/** Paint the moves before a row; yields between steps. */
export function* paintDone(ctx, frame, pane) {
  const track = pane.main;
  if (!track) return;
  const { scene, paths } = track, end = pane.doneRow, style = styleOf(pane, { scene }, frame), level = paths.levelFor(frame.scale);
  pane.paintedRow = end;
  for (const what of ["rapid", "cut"]) {
    if (!pane.layers[what === "rapid" ? "rapids" : "cuts"]) continue;
    frame.inMm(ctx, scene.origin);
    setStroke(ctx, style[what], frame.scale);
    for (const index of paths.visible(frame.seen)) {
      const piece = paths.pieces[index];
      if (piece.first >= end) break;
      const drawn = piece.end <= end ? paths.paths(index, level) : pathsOfRows(scene, piece.first, end);
      ctx.stroke(drawn[what]);
      yield drawn.costs?.[what] ?? end - piece.first + 1;
    }
  }
  if (pane.layers.cuts) paintDrilled(ctx, frame, pane, 0, end);
  yield 10;
}

/** Paint a dot at every hole drilled in the rows from `first` to before `end`. */
function paintDrilled(ctx, frame, pane, first, end) {
  const { scene } = pane.main, { stop, origin } = scene, seen = frame.seen, path = new Path2D();
  const radius = Math.min(Math.max(pane.main.drillRadius * frame.scale, 1.2), 3.4);
  frame.inPixels(ctx);
  for (let k = firstAtLeast(stop, first); k < stop.length && stop[k] < end; k++) {
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

function firstAtLeast(sorted, value) {
  let low = 0, high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] < value) low = middle + 1; else high = middle;
  }
  return low;
}

/** Add the rows from `first` to before `end` to the finished moves. */
export function paintMore(ctx, frame, pane, first, end) {
  if (pane.layers.cuts) paintDrilled(ctx, frame, pane, first, end);
  const { scene } = pane.main, drawn = pathsOfRows(scene, first, end), style = styleOf(pane, { scene }, frame);
  for (const what of ["rapid", "cut"]) {
    if (!pane.layers[what === "rapid" ? "rapids" : "cuts"]) continue;
    frame.inMm(ctx, scene.origin);
    setStroke(ctx, style[what], frame.scale);
    ctx.stroke(drawn[what]);
  }
}

/** Paint the marks: arrows, pierces, first and last stop, numbers, issues; yields between steps. */
export function* paintMarks(ctx, frame, pane) {
  const { layers, colours, main, edited } = pane, scene = edited ?? main?.scene;
  if (scene) {
    const ends = edited ? [edited.held[0] - 1, edited.held.at(-1) ? edited.rows - 1 : -1] : [0, scene.stop.length - 1];
    if (layers.arrows && layers.rapids) yield* paintArrows(ctx, frame, scene, colours.rapid);
    if (layers.cuts && main?.scene.pierce.length) yield* paintPierces(ctx, frame, scene, colours);
    drawEnds(ctx, frame, scene, colours, ...ends);
    if (layers.numbers) {
      yield* paintNumbers(ctx, frame, scene, (edited ?? main).numbers, colours, (x, y) => pane.holeRadius(x, y));
    }
  }
  if (layers.extents) paintExtents(ctx, frame, pane);
  if (layers.issues && pane.part) {
    paintMissing(ctx, frame, pane.part, colours);
    paintIssues(ctx, frame, pane.part, colours);
  }
  if (layers.differences && pane.differences) paintDifferences(ctx, frame, pane.differences, colours);
  yield 10;
}

function* paintPierces(ctx, frame, scene, colours) {
  const { pierce, origin } = scene, path = new Path2D(), size = 3.2;
  if (!pierce.length) return;
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

/** Hatch missing work in red. */
function paintMissing(ctx, frame, part, colours) {
  frame.inPixels(ctx);
  ctx.strokeStyle = colours.bad;
  ctx.lineWidth = 1.2;
  for (const ring of part.header.missing ?? []) {
    const points = ring.map(([x, y]) => [frame.toX(x), frame.toY(y)]);
    const xs = points.map(([x]) => x), ys = points.map(([, y]) => y);
    const left = Math.max(Math.min(...xs), 0), right = Math.min(Math.max(...xs), ctx.canvas.width);
    const top = Math.max(Math.min(...ys), 0), bottom = Math.min(Math.max(...ys), ctx.canvas.height);
    ctx.save();
    ctx.beginPath();
    points.forEach(([x, y], k) => (k ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
    ctx.closePath();
    ctx.stroke();
    ctx.clip();
    ctx.beginPath();
    for (let sum = Math.ceil((left + top) / 7) * 7; sum < right + bottom; sum += 7) {
      ctx.moveTo(sum - bottom, bottom);
      ctx.lineTo(sum - top, top);
    }
    ctx.stroke();
    ctx.restore();
  }
}

function paintIssues(ctx, frame, part, colours) {
  frame.inPixels(ctx);
  for (let k = 0; k < part.issue.length; k += 3) {
    const px = frame.toX(part.issue[k] + part.origin[0]), py = frame.toY(part.issue[k + 1] + part.origin[1]);
    const severity = part.header.issues[part.issue[k + 2]]?.[1];
    ctx.beginPath();
    ctx.moveTo(px, py - 8);
    ctx.lineTo(px + 8, py + 6);
    ctx.lineTo(px - 8, py + 6);
    ctx.closePath();
    ctx.fillStyle = severity === "missing" ? colours.bad : severity === "note" ? colours["ink-2"] : colours.warn;
    ctx.strokeStyle = colours.card;
    ctx.lineWidth = 2;
    ctx.stroke();
    ctx.fill();
    ctx.fillStyle = colours.card;
    ctx.fillRect(px - 0.9, py - 3.2, 1.8, 5);
    ctx.fillRect(px - 0.9, py + 2.8, 1.8, 1.8);
  }
}
