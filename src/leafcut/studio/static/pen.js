// Pen for Path2D.

/** Builds a Path2D without points closer than a tolerance to the previous point. */
export class Pen {
  constructor(tolerance) {
    this.path = new Path2D();
    this.tolerance = tolerance;
    this.count = 0;
    this.x = this.y = this.atX = this.atY = NaN;
  }

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
