// Grid, axes, scale bar, arrows, numbers and tool: marks of constant size in the drawing.

import { emptyBox, widen } from "./boxes.js";
import { niceStep, tickWords } from "./view.js";

/** @import { Frame, Steps } from "./buffer.js" */
/** @import { PathScene, ToolpathScene } from "./scene.js" */
/** @import { Colours } from "./theme.js" */
/** @import { View } from "./view.js" */
/** A toolpath or an edited order, with numbered stops.
 * @typedef {ToolpathScene | PathScene} Route */

export const FONT = '500 11px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif';
const NUMBER_FONT = '600 11px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif';
const BETWEEN_LINES = 15; // minimum distance, pixels
const BETWEEN_TICKS = 76;
const RULER = 22;

/** Draw the grid: fine lines, stronger lines every fifth or tenth step, and the axes through zero.
 * @param {Context} ctx @param {View} view @param {Colours} colours */
export function drawGrid(ctx, view, colours) {
  const step = niceStep(BETWEEN_LINES / view.scale), coarse = step * 10 * (1 + 1e-9);
  const [x0, y0, x1, y1] = view.seen();
  const lines = { fine: new Path2D(), coarse: new Path2D(), axes: new Path2D() };
  const pick = (/** @type {number} */ value) => (Math.abs(value) < step / 2 ? "axes" : isMultiple(value, coarse) ? "coarse" : "fine");
  for (let k = Math.ceil(x0 / step); k * step <= x1; k++) {
    const px = Math.round(view.toX(k * step)) + 0.5, path = lines[pick(k * step)];
    path.moveTo(px, 0);
    path.lineTo(px, view.height);
  }
  for (let k = Math.ceil(y0 / step); k * step <= y1; k++) {
    const py = Math.round(view.toY(k * step)) + 0.5, path = lines[pick(k * step)];
    path.moveTo(0, py);
    path.lineTo(view.width, py);
  }
  ctx.lineWidth = 1;
  ctx.strokeStyle = colours.grid;
  ctx.stroke(lines.fine);
  ctx.strokeStyle = colours["grid-2"];
  ctx.stroke(lines.coarse);
  ctx.strokeStyle = colours["line-2"];
  ctx.globalAlpha = 0.55;
  ctx.stroke(lines.axes);
  ctx.globalAlpha = 1;
}

/** @param {number} value @param {number} step */
function isMultiple(value, step) { return Math.abs(value / step - Math.round(value / step)) < 1e-3; }

/** Draw rulers with ticks in millimetres along the left and the lower edge.
 * @param {Context} ctx @param {View} view @param {Colours} colours */
export function drawRulers(ctx, view, colours, unit = "mm") {
  const step = niceStep(BETWEEN_TICKS / view.scale), [x0, y0, x1, y1] = view.seen();
  ctx.font = FONT;
  const longest = Math.max(...[y0, y1].map((y) => ctx.measureText(tickWords(Math.round(y / step) * step, step)).width));
  const bottom = view.height - RULER, left = Math.max(46, longest + 14);
  ctx.fillStyle = colours.card;
  ctx.globalAlpha = 0.86;
  ctx.fillRect(0, bottom, view.width, RULER);
  ctx.fillRect(0, 0, left, bottom);
  ctx.globalAlpha = 1;
  ctx.strokeStyle = colours.line;
  ctx.lineWidth = 1;
  ctx.beginPath();
  ctx.moveTo(left + 0.5, 0);
  ctx.lineTo(left + 0.5, bottom + 0.5);
  ctx.lineTo(view.width, bottom + 0.5);
  ctx.stroke();
  ctx.fillStyle = colours["ink-2"];
  ctx.strokeStyle = colours["line-2"];
  ctx.beginPath();
  ctx.textBaseline = "middle";
  ctx.textAlign = "center";
  for (let k = Math.ceil(x0 / step); k * step <= x1; k++) {
    const px = Math.round(view.toX(k * step)) + 0.5;
    if (px < left + 22 || px > view.width - 18) continue;
    ctx.moveTo(px, bottom);
    ctx.lineTo(px, bottom + 4);
    ctx.fillText(tickWords(k * step, step), px, bottom + 13);
  }
  ctx.textAlign = "right";
  for (let k = Math.ceil(y0 / step); k * step <= y1; k++) {
    const py = Math.round(view.toY(k * step)) + 0.5;
    if (py < 12 || py > bottom - 8) continue;
    ctx.moveTo(left, py);
    ctx.lineTo(left - 4, py);
    ctx.fillText(tickWords(k * step, step), left - 7, py);
  }
  ctx.stroke();
  ctx.textAlign = "left";
  ctx.fillText(unit, 8, bottom + 13);
}

/** Draw a scale bar of a round length in the lower right corner.
 * @param {Context} ctx @param {View} view @param {Colours} colours */
export function drawScaleBar(ctx, view, colours, unit = "mm") {
  const step = niceStep(70 / view.scale), width = step * view.scale;
  const x = view.width - 16, y = view.height - RULER - 14;
  const metres = unit && step >= 1000 && isMultiple(step, 1000);
  const words = metres ? `${step / 1000} m` : step >= 0.001 ? `${tickWords(step, step)} ${unit}`.trim() : "";
  const bar = new Path2D();
  bar.moveTo(x - width, y - 4);
  bar.lineTo(x - width, y);
  bar.lineTo(x, y);
  bar.lineTo(x, y - 4);
  strokeHaloed(ctx, bar, colours["ink-2"], 1.5, colours.card, 5);
  ctx.font = FONT;
  ctx.textAlign = "center";
  ctx.textBaseline = "bottom";
  haloed(ctx, words, x - width / 2, y - 5, colours["ink-2"], colours.card);
}

/** Stroke a path over a wider stroke in the background colour, visible on lines.
 * @param {Context} ctx @param {Path2D} path @param {string} ink @param {number} width @param {string} ground
 * @param {number} wide */
export function strokeHaloed(ctx, path, ink, width, ground, wide) {
  for (const [colour, line] of /** @type {[string, number][]} */ ([[ground, wide], [ink, width]])) {
    ctx.strokeStyle = colour;
    ctx.lineWidth = line;
    ctx.stroke(path);
  }
}

/** Return a circle as a path.
 * @param {number} x @param {number} y @param {number} radius */
export function circle(x, y, radius) {
  const path = new Path2D();
  path.arc(x, y, radius, 0, 2 * Math.PI);
  return path;
}

/** Write a text with a halo in the background colour, readable on lines.
 * @param {Context} ctx @param {string} words @param {number} x @param {number} y @param {string} ink
 * @param {string} ground */
export function haloed(ctx, words, x, y, ink, ground) {
  ctx.lineJoin = "round";
  ctx.lineWidth = 3.5;
  ctx.strokeStyle = ground;
  ctx.strokeText(words, x, y);
  ctx.fillStyle = ink;
  ctx.fillText(words, x, y);
}

/** Occupied cells on the screen. */
class Room {
  /** @param {number} width @param {number} height */
  constructor(width, height) {
    this.width = width;
    this.height = height;
    this.taken = new Set();
  }

  /** Occupy the cell of a point; return false if it or an adjacent cell is occupied.
   * @param {number} x @param {number} y */
  take(x, y) {
    const column = Math.floor(x / this.width), row = Math.floor(y / this.height);
    for (let dx = -1; dx <= 1; dx++) {
      for (let dy = -1; dy <= 1; dy++) if (this.taken.has((column + dx) * 65536 + row + dy)) return false;
    }
    this.taken.add(column * 65536 + row);
    return true;
  }
}

/** Draw arrowheads on long rapids, spread over the screen; yields between steps.
 * @param {Context} ctx @param {Frame} frame @param {Route} scene @param {string} colour @returns {Steps} */
export function* paintArrows(ctx, frame, scene, colour) {
  const room = new Room(34, 34), seen = frame.seen, [ox, oy] = scene.origin, least = 30 / frame.scale;
  frame.inPixels(ctx);
  const path = new Path2D();
  for (let row = 1; row < scene.rows; row++) {
    if (row % 20000 === 0) yield 400;
    if (!scene.idle(row)) continue;
    const x0 = scene.x0(row), y0 = scene.y0(row), dx = scene.x1(row) - x0, dy = scene.y1(row) - y0;
    const length = Math.hypot(dx, dy);
    if (!(length >= least)) continue;
    const x = x0 + dx / 2 + ox, y = y0 + dy / 2 + oy;
    if (x < seen[0] || x > seen[2] || y < seen[1] || y > seen[3]) continue;
    const px = frame.toX(x), py = frame.toY(y);
    if (!room.take(px, py)) continue;
    const ux = dx / length, uy = -dy / length, reach = 4.5;
    path.moveTo(px + ux * reach, py + uy * reach);
    path.lineTo(px - ux * reach + uy * 3.1, py - uy * reach - ux * 3.1);
    path.lineTo(px - ux * reach - uy * 3.1, py - uy * reach + ux * 3.1);
    path.closePath();
  }
  ctx.fillStyle = colour;
  ctx.fill(path);
  yield 50;
}

/** Return the maximum number of labels for a mean distance of stops in pixels; only both ends in a dense field.
 * @param {number} apart */
function mostNumbers(apart) { return apart > 15 ? 900 : apart > 9 ? 40 : 2; }

/** Draw the numbers of the stops as space permits; `radius(x, y)` of the hole there, mm; yields between steps.
 * @param {Context} ctx @param {Frame} frame @param {Route} scene @param {number[]} order @param {Colours} colours
 * @param {(x: number, y: number) => number} radius @returns {Steps} */
export function* paintNumbers(ctx, frame, scene, order, colours, radius) {
  const seen = frame.seen, [ox, oy] = scene.origin, shown = /** @type {[number, number, number][]} */ ([]);
  for (let k = 0; k < order.length; k++) {
    if (k % 20000 === 19999) yield 400;
    const [sx, sy] = scene.stopPlace(order[k]);
    const x = sx + ox, y = sy + oy;
    if (x >= seen[0] && x <= seen[2] && y >= seen[1] && y <= seen[3]) shown.push([order[k], x, y]);
  }
  const { width, height } = frame.view, most = mostNumbers(spread(shown, frame, width * height));
  const room = new Room(0.62 * (7 * String(order.length).length + 6), 8);
  frame.inPixels(ctx);
  ctx.font = NUMBER_FONT;
  ctx.textAlign = "left";
  ctx.textBaseline = "alphabetic";
  let written = 0;
  for (const [stop, x, y] of shown) {
    // Outside the hole, to the upper right, unless that is too far away.
    const off = Math.min(Math.max(radius(x, y) * frame.scale * 0.75 + 2, 5), 60), px = frame.toX(x) + off, py = frame.toY(y) - off;
    if (written >= most) break;
    if (!room.take(px, py)) continue;
    haloed(ctx, scene.label(stop), px, py, colours.ink, colours.card);
    if (++written % 50 === 0) yield 600;
  }
  yield 20;
}

/** Return the mean distance that the visible stops would have if evenly spread over their extent, pixels.
 * @param {[number, number, number][]} shown @param {Frame} frame @param {number} screen */
function spread(shown, frame, screen) {
  const box = emptyBox();
  for (const [, x, y] of shown) widen(box, x, y);
  const area = Math.max((box[2] - box[0]) * frame.scale, 40) * Math.max((box[3] - box[1]) * frame.scale, 40);
  return Math.sqrt(Math.min(area, 2 * screen) / Math.max(shown.length, 1));
}

/** Draw a ring around the first stop and a square around the last, numbered from 0.
 * @param {Context} ctx @param {Frame} frame @param {Route} scene @param {Colours} colours @param {number} first
 * @param {number} last */
export function drawEnds(ctx, frame, scene, colours, first, last) {
  const marks = new Path2D();
  for (const stop of [first, last]) {
    const [x, y] = scene.stopPlace(stop), px = frame.toX(x + scene.origin[0]), py = frame.toY(y + scene.origin[1]);
    if (!Number.isFinite(px + py)) continue;
    if (stop === last) marks.rect(px - 6.5, py - 6.5, 13, 13);
    if (stop === first) marks.addPath(circle(px, py, 7));
  }
  frame.inPixels(ctx);
  ctx.lineJoin = "miter";
  strokeHaloed(ctx, marks, colours.ink, 2, colours.card, 5);
}

/** Draw the tool: a cross-hair in a disc, filled while it works.
 * @param {Context} ctx @param {View} view @param {Colours} colours @param {number} x @param {number} y
 * @param {boolean} working */
export function drawTool(ctx, view, colours, x, y, working) {
  const px = view.toX(x), py = view.toY(y);
  if (!Number.isFinite(px + py)) return;
  ctx.lineWidth = 2;
  ctx.fillStyle = working ? colours.cut : colours.card;
  ctx.strokeStyle = working ? colours.cut : colours.rapid;
  const disc = circle(px, py, 10);
  ctx.globalAlpha = working ? 0.25 : 0.75;
  ctx.fill(disc);
  ctx.globalAlpha = 1;
  ctx.stroke(disc);
  ctx.fillStyle = colours.ink;
  ctx.fill(circle(px, py, 2.6));
}

/** Draw the actual position of the machine: a cross with a ring, filled while it cuts, and the next hole.
 * @param {Context} ctx @param {View} view @param {Colours} colours
 * @param {{ x: number, y: number, cuts?: boolean, next?: [number, number] | null }} place */
export function drawMachine(ctx, view, colours, { x, y, cuts, next }) {
  if (next) strokeHaloed(ctx, circle(view.toX(next[0]), view.toY(next[1]), 13), colours.accent, 3, colours.card, 7);
  const px = view.toX(x), py = view.toY(y), arm = 20;
  if (!Number.isFinite(px + py)) return;
  const ring = circle(px, py, 11), cross = new Path2D(ring);
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    cross.moveTo(px + 4 * dx, py + 4 * dy);
    cross.lineTo(px + arm * dx, py + arm * dy);
  }
  ctx.lineCap = "butt";
  strokeHaloed(ctx, cross, colours.bad, 2, colours.card, 5);
  ctx.fillStyle = colours.bad;
  ctx.globalAlpha = cuts ? 0.35 : 0.1;
  ctx.fill(ring);
  ctx.globalAlpha = 1;
}
