// Painting of the differences of two programs: missing and added moves, and a mark at every difference with a position.

import { circle } from "./marks.js";
import { linePath } from "./pen.js";

/** @import { Frame } from "./buffer.js" */
/** @import { DifferenceScene } from "./scene.js" */
/** @import { Colours } from "./theme.js" */
/** @typedef {"missing" | "added" | "changed"} Change */

const CHANGES = /** @type {Change[]} */ (["missing", "added", "changed"]);
const SIZE = 8; // radius of a mark, pixels

/** @param {Context} ctx @param {Frame} frame @param {DifferenceScene} scene @param {Colours} colours */
export function paintDifferences(ctx, frame, scene, colours) {
  const ink = { missing: colours.bad, added: colours.accent, changed: colours.warn };
  frame.inMm(ctx, scene.origin);
  ctx.lineCap = "butt";
  for (const name of /** @type {const} */ (["missing", "added"])) {
    const path = linePath(scene[name]);
    for (const [colour, width] of /** @type {[string, number][]} */ ([[colours.card, 6], [ink[name], 3.4]])) {
      ctx.strokeStyle = colour;
      ctx.lineWidth = width / frame.scale;
      ctx.setLineDash(name === "missing" && width < 6 ? [7 / frame.scale, 4 / frame.scale] : []);
      ctx.stroke(path);
    }
  }
  ctx.setLineDash([]);
  frame.inPixels(ctx);
  for (let k = 0; k < scene.marks; k++) {
    const { x, y, change } = scene.at(k), name = CHANGES[change];
    drawChange(ctx, frame.toX(x), frame.toY(y), name, ink[name], colours.card, SIZE);
  }
}

/** Draw a disc with a minus, a plus, or the sign for a change.
 * @param {Context} ctx @param {number} px @param {number} py @param {Change} change @param {string} colour
 * @param {string} ground @param {number} size */
export function drawChange(ctx, px, py, change, colour, ground, size) {
  if (!Number.isFinite(px + py)) return;
  const disc = circle(px, py, size), sign = new Path2D();
  for (const dy of change === "changed" ? [-2, 2] : [0]) {
    sign.moveTo(px - 4, py + dy);
    sign.lineTo(px + 4, py + dy);
  }
  if (change === "added") {
    sign.moveTo(px, py - 4);
    sign.lineTo(px, py + 4);
  }
  ctx.fillStyle = colour;
  ctx.strokeStyle = ground;
  ctx.lineWidth = 2;
  ctx.fill(disc);
  ctx.stroke(disc);
  ctx.stroke(sign);
}

/** Draw a ring around the mark that is selected or under the pointer.
 * @param {Context} ctx @param {Frame} frame @param {{ x: number, y: number }} place @param {string} colour */
export function ringMark(ctx, frame, { x, y }, colour) {
  frame.inPixels(ctx);
  ctx.strokeStyle = colour;
  ctx.lineWidth = 2.5;
  ctx.stroke(circle(frame.toX(x), frame.toY(y), SIZE + 4));
}
