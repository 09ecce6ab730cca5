// Many small holes as shades of grey: the number per cell, as an image created once per cell size.

import { contextOf, make } from "./icons.js";
import { rgbOf } from "./theme.js";

/** @import { PartScene } from "./scene.js" */

const CELL = 2.5; // minimum size of a cell, pixels
const MANY = 3000; // minimum number of holes
const TINY = 2; // pixels; smaller holes are mere dots
const CROWDED = 4; // mean distance of holes, pixels
const MOST_CELLS = 1 << 20;

/** Return whether the holes are many, tiny and crowded, and are therefore shown as shades of grey.
 * @param {PartScene} part @param {number} scale */
export function isDense(part, scale) {
  if (part.holes < MANY || !part.extents) return false;
  const [x0, y0, x1, y1] = part.extents;
  const apart = Math.sqrt((Math.max(x1 - x0, 1e-6) * Math.max(y1 - y0, 1e-6)) / part.holes) * scale;
  return apart < CROWDED && typicalDiameter(part) * scale < TINY;
}

/** Return the median diameter of a sample of the holes, mm.
 * @param {PartScene} part */
function typicalDiameter(part) {
  const sample = Math.min(part.holes, 999);
  const radii = Float64Array.from({ length: sample }, (_, k) => part.holeRadius(Math.floor((k * part.holes) / sample))).sort();
  return 2 * radii[Math.floor(sample / 2)];
}

/** Density images of a part's holes by cell size; each size is twice the previous. */
export class Density {
  /** `shown`: indices of the holes.
   * @param {PartScene} part @param {number[]} shown */
  constructor(part, shown) {
    this.part = part;
    this.shown = shown;
    /** @type {Map<string, { canvas: HTMLCanvasElement, x: number, y: number, width: number, height: number }>} */
    this.pictures = new Map();
  }

  /** Return an image for a scale: canvas, lower left corner and size in mm, relative to the origin.
   * @param {number} scale @param {string} colour */
  at(scale, colour) {
    const { part } = this, [ox, oy] = part.origin, [x0, y0, x1, y1] = part.extents ?? [0, 0, 1, 1];
    let power = Math.ceil(Math.log2(CELL / scale));
    while (((x1 - x0) / 2 ** power + 1) * ((y1 - y0) / 2 ** power + 1) > MOST_CELLS) power++;
    const key = `${power} ${colour}`;
    let found = this.pictures.get(key);
    if (found) return found;
    if (this.pictures.size > 6) this.pictures.clear();
    const size = 2 ** power, columns = Math.floor((x1 - x0) / size) + 1, rows = Math.floor((y1 - y0) / size) + 1;
    const counts = new Uint32Array(columns * rows);
    let most = 1;
    for (const k of this.shown) {
      const [x, y] = part.holePlace(k);
      const column = Math.min(Math.max(Math.floor((x - x0) / size), 0), columns - 1);
      const row = Math.min(Math.max(Math.floor((y - y0) / size), 0), rows - 1);
      most = Math.max(most, ++counts[row * columns + column]);
    }
    found = { canvas: shaded(counts, columns, rows, most, colour), x: x0 - ox, y: y0 - oy, width: columns * size, height: rows * size };
    this.pictures.set(key, found);
    return found;
  }
}

/** Return a canvas with one pixel per cell, the first row at the bottom; more holes are darker.
 * @param {Uint32Array} counts @param {number} columns @param {number} rows @param {number} most @param {string} colour */
function shaded(counts, columns, rows, most, colour) {
  const canvas = make("canvas", "", { width: columns, height: rows }), ctx = contextOf(canvas), picture = ctx.createImageData(columns, rows);
  const [r, g, b] = rgbOf(colour);
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      const count = counts[row * columns + column];
      if (count) picture.data.set([r, g, b, Math.round(255 * (0.3 + 0.7 * (count / most) ** 0.6))], 4 * ((rows - 1 - row) * columns + column));
    }
  }
  ctx.putImageData(picture, 0, 0);
  return canvas;
}

/** Paint the holes of a part by density; `ctx` is in mm relative to the part's origin.
 * @param {CanvasRenderingContext2D} ctx @param {Density} density @param {number} scale @param {string} colour */
export function paintDensity(ctx, density, scale, colour) {
  const { canvas, x, y, width, height } = density.at(scale, colour);
  ctx.save();
  ctx.translate(x, y + height);
  ctx.scale(1, -1);
  ctx.imageSmoothingEnabled = false;
  ctx.drawImage(canvas, 0, 0, width, height);
  ctx.restore();
}
