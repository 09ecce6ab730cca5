// The whole drawing, faint, below the machined part: its layers with colours, except hidden ones.

import { isDense, paintDensity } from "./density.js";
import { PartPaths } from "./paths.js";
import { OUTLINES } from "./scene.js";
import { colourOf } from "./theme.js";

/** @import { Frame, Steps } from "./buffer.js" */
/** @import { Pane } from "./pane.js" */
/** @import { PartScene } from "./scene.js" */

const POINT = 2; // pixels
const FAINT = 0.62;

/** Return the names of the layers of some parts, in the order of their numbers.
 * @param {(PartScene | null)[]} parts @returns {string[]} */
export function layersOf(...parts) {
  const names = new Set();
  for (const part of parts) for (const name of part?.header.layers ?? []) names.add(name);
  return [...names];
}

/** Paths of a part by layer; "" for objects without a layer. */
export class WholePaths {
  /** @param {PartScene} part */
  constructor(part) {
    const names = /** @type {string[]} */ ([...part.header.layers, ""]);
    this.part = part;
    this.layers = new Map(names.map((name) => [name, new PartPaths(part, new Set(names.filter((other) => other !== name)))]));
  }
}

/** Paint the whole drawing, with a colour per layer if there are several; yields between steps.
 * @param {Context} ctx @param {Frame} frame @param {WholePaths} wholePaths @param {Pane} pane @returns {Steps} */
export function* paintWhole(ctx, frame, wholePaths, { drawnLayers, hidden, colours }) {
  const px = 1 / frame.scale, whole = wholePaths.part;
  for (const [name, paths] of wholePaths.layers) {
    if (hidden.has(name)) continue;
    frame.inMm(ctx, whole.origin);
    const colour = (ctx.strokeStyle = colourOf(colours, drawnLayers, name));
    ctx.lineJoin = ctx.lineCap = "round";
    ctx.lineWidth = px;
    ctx.globalAlpha = FAINT;
    for (const kind of OUTLINES) {
      for (const [path, cost] of paths.outlines[kind]?.visible(frame.seen, frame.scale) ?? []) {
        ctx.stroke(path);
        yield cost;
      }
    }
    if (isDense(whole, frame.scale)) {
      paintDensity(ctx, paths.density, frame.scale, colour);
      yield 400;
    } else yield* paintHoles(ctx, frame, whole, paths);
    ctx.stroke(slotsOf(whole, paths.slots));
    ctx.globalAlpha = 1;
  }
}

/** @param {Context} ctx @param {Frame} frame @param {PartScene} whole @param {PartPaths} paths @returns {Steps} */
function* paintHoles(ctx, frame, whole, paths) {
  for (const piece of paths.visibleHoles(frame.seen)) {
    ctx.stroke(paths.holes(piece, (whole.holes > 3000 ? 0.5 : POINT) / frame.scale));
    yield 2 * piece.holes.length;
  }
}

/** @param {PartScene} part @param {number[]} slots */
function slotsOf(part, slots) {
  const path = new Path2D();
  for (const k of slots) {
    path.moveTo(part.slot[5 * k], part.slot[5 * k + 1]);
    path.lineTo(part.slot[5 * k + 2], part.slot[5 * k + 3]);
  }
  return path;
}
