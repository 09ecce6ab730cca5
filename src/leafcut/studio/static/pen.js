// Paths to draw, without details that are invisible at a scale.

import { diagonal } from "./boxes.js";

/** @import { Box } from "./boxes.js" */

const FINEST = 1 / 60000; // tolerance of the first simplified level, as a fraction of the extents
const LEVEL_STEP = 3, MOST_LEVELS = 9;

/** Levels of detail: 0 is exact, 1 has the finest tolerance, and each further level three times that. */
export class Levels {
  /** `visible`: smallest visible deviation, pixels.
   * @param {Box | null} extents @param {number} visible */
  constructor(extents, visible) {
    this.finest = diagonal(extents) * FINEST;
    this.visible = visible;
  }

  /** Return the coarsest level whose tolerance is invisible at a scale, pixels per mm.
   * @param {number} scale */
  at(scale) {
    const allowed = this.visible / scale / this.finest;
    return allowed < 1 ? 0 : Math.min(1 + Math.floor(Math.log(allowed) / Math.log(LEVEL_STEP)), MOST_LEVELS);
  }

  /** Return the tolerance of a level, mm.
   * @param {number} level */
  tolerance(level) { return level ? this.finest * LEVEL_STEP ** (level - 1) : 0; }
}

/** Builds a Path2D without points closer than a tolerance to the previous point. */
export class Pen {
  /** @param {number} tolerance */
  constructor(tolerance) {
    this.path = new Path2D();
    this.tolerance = tolerance;
    this.count = 0;
    this.x = this.y = this.atX = this.atY = NaN;
  }

  /** @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
  to(x0, y0, x1, y1) {
    // A gap within the tolerance is invisible, so join the lines.
    if (!(Math.abs(x0 - this.x) + Math.abs(y0 - this.y) <= this.tolerance)) {
      this.finish();
      this.path.moveTo(x0, y0);
      this.atX = x0;
      this.atY = y0;
    }
    this.x = x1;
    this.y = y1;
    if (this.tolerance && Math.abs(x1 - this.atX) + Math.abs(y1 - this.atY) < this.tolerance) return;
    this._line();
  }

  /** @param {number} cx @param {number} cy @param {number} radius @param {number} start @param {number} sweep
   * @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
  arc(cx, cy, radius, start, sweep, x0, y0, x1, y1) {
    if (radius < this.tolerance) {
      this.to(x0, y0, x1, y1);
      return;
    }
    if (x0 !== this.x || y0 !== this.y) {
      this.finish();
      this.path.moveTo(x0, y0);
    } else if (this.atX !== x0 || this.atY !== y0) this._line();
    this.path.arc(cx, cy, radius, start, start + sweep, sweep < 0);
    this.x = this.atX = x1;
    this.y = this.atY = y1;
    this.count += 4;
  }

  /** Draw the pending line, if any. */
  finish() {
    if (this.x !== this.atX || this.y !== this.atY) this._line();
    this.x = this.y = NaN;
    this.atX = this.atY = NaN;
  }

  _line() {
    if (!Number.isFinite(this.x)) return;
    this.path.lineTo(this.x, this.y);
    this.atX = this.x;
    this.atY = this.y;
    this.count++;
  }
}

/** Return a path through points x, y; NaN separates lines.
 * @param {ArrayLike<number>} points */
export function linePath(points) {
  const path = new Path2D();
  let down = false;
  for (let k = 0; k < points.length; k += 2) {
    if (!Number.isFinite(points[k])) down = false;
    else if (down) path.lineTo(points[k], points[k + 1]);
    else {
      path.moveTo(points[k], points[k + 1]);
      down = true;
    }
  }
  return path;
}
