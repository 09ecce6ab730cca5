// The view: range of millimetres on the screen, shared by several panes, so that they move together.

/** @import { Box } from "./boxes.js" */

const SMALLEST_SPAN = 0.02; // mm across the screen: far below the precision of machines
const LARGEST_SPAN = 1e7;
const MARGIN = 0.06;

export class View extends EventTarget {
  constructor() {
    super();
    this.x = 0;
    this.y = 0;
    this.scale = 2; // pixels per mm
    this.width = 1;
    this.height = 1;
    this.fitted = true;
    /** @type {Box | null} */
    this.extents = null;
    this.insets = [0, 0, 0, 0]; // left, top, right, bottom, pixels
  }

  /** @param {number} x */
  toX(x) { return (x - this.x) * this.scale + this.width / 2; }
  /** @param {number} y */
  toY(y) { return (this.y - y) * this.scale + this.height / 2; }
  /** @param {number} px */
  mmX(px) { return (px - this.width / 2) / this.scale + this.x; }
  /** @param {number} py */
  mmY(py) { return this.y - (py - this.height / 2) / this.scale; }

  /** Return the visible range.
   * @returns {Box} */
  seen() { return [this.mmX(0), this.mmY(this.height), this.mmX(this.width), this.mmY(0)]; }

  /** Return a copy that does not change. */
  snapshot() { return { x: this.x, y: this.y, scale: this.scale, width: this.width, height: this.height }; }

  /** @param {number} width @param {number} height */
  resize(width, height) {
    if (width === this.width && height === this.height) return;
    this.width = Math.max(width, 1);
    this.height = Math.max(height, 1);
    if (this.fitted) this.fit(this.extents); else this._changed();
  }

  /** Pan by pixels.
   * @param {number} dx @param {number} dy */
  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.fitted = false;
    this._changed();
  }

  /** Zoom about (px, py).
   * @param {number} factor */
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const x = this.mmX(px), y = this.mmY(py);
    const span = Math.min(this.width, this.height);
    this.scale = Math.min(Math.max(this.scale * factor, span / LARGEST_SPAN), span / SMALLEST_SPAN);
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
    this.fitted = false;
    this._changed();
  }

  /** Fit a box with a margin; by default 100 mm.
   * @param {Box | null} extents */
  fit(extents, insets = this.insets) {
    this.extents = extents;
    this.insets = insets;
    const [x0, y0, x1, y1] = extents ?? [0, 0, 100, 100];
    const [left, top, right, bottom] = insets;
    const width = Math.max(this.width - left - right, 20), height = Math.max(this.height - top - bottom, 20);
    const spanX = Math.max(x1 - x0, 1e-3), spanY = Math.max(y1 - y0, 1e-3);
    const alone = Math.max(spanX, spanY) <= 1e-3 ? 1e4 : 1; // a single point: 10 mm around it
    this.scale = Math.min(width / (spanX * alone), height / (spanY * alone)) * (1 - 2 * MARGIN);
    this.x = (x0 + x1) / 2 + (right - left) / 2 / this.scale;
    this.y = (y0 + y1) / 2 + (top - bottom) / 2 / this.scale;
    this.fitted = true;
    this._changed();
  }

  /** Pan just enough to make a point visible.
   * @param {number} x @param {number} y */
  show(x, y) {
    const px = this.toX(x), py = this.toY(y), edge = Math.min(60, this.width / 4, this.height / 4);
    if (!Number.isFinite(px + py)) return;
    const out = px < edge || py < edge || px > this.width - edge || py > this.height - edge;
    if (out) this.pan(this.width / 2 - px, this.height / 2 - py);
  }

  _changed() { this.dispatchEvent(new Event("change")); }
}

/** Return the smallest step of 1, 2 or 5 times a power of ten that is at least `least`.
 * @param {number} least */
export function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  for (const factor of [1, 2, 5]) if (factor * power >= least * (1 - 1e-9)) return factor * power;
  return 10 * power;
}

/** Return a length in mm as text, with the decimals that a step needs.
 * @param {number} value @param {number} step */
export function tickWords(value, step) {
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const words = value.toFixed(Math.min(decimals, 6));
  return /^-0(\.0*)?$/.test(words) ? words.slice(1) : words;
}
