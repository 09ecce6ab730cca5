// Drawings painted over several frames. Until a drawing is finished, the previous drawing is shown, moved and scaled.

import { contextOf, make } from "./icons.js";

/** @import { Box, Point } from "./boxes.js" */
/** @import { View } from "./view.js" */
/** Centre, mm; pixels per mm; size, pixels.
 * @typedef {{ x: number, y: number, scale: number, width: number, height: number }} Shot */
/** Paints in steps; yields the cost of each, in segments.
 * @typedef {Generator<number, void>} Steps */

const SLICE = 9; // milliseconds of painting per frame

/** Number of segments that can be painted per frame, measured from previous frames. */
class Budget {
  constructor() {
    this.perMs = 400;
  }

  /** Number of segments for the next frame. */
  get segments() { return Math.max(SLICE * this.perMs, 600); }

  /** Record that `segments` took `ms` milliseconds.
   * @param {number} segments @param {number} ms */
  learn(segments, ms) {
    if (segments < 200) return;
    const now = segments / Math.max(ms, 0.2);
    const share = now < this.perMs ? 0.7 : 0.12; // react fast to slow frames, slowly to fast ones
    this.perMs = Math.min(Math.max(this.perMs + share * (now - this.perMs), 30), 50000);
  }
}

export const budget = new Budget();

const scratch = contextOf(make("canvas", "", { width: 1, height: 1 }));

/** Force the canvas to execute pending drawing commands, which browsers defer until it is read.
 * @param {HTMLCanvasElement} canvas */
function flush(canvas) { scratch.drawImage(canvas, 0, 0, 1, 1); }

/** One drawing. */
export class Buffer {
  /** @param {(ctx: Context, frame: Frame) => Steps} paint */
  constructor(paint, margin = 96) {
    this.paint = paint;
    this.margin = margin; // pixels painted beyond each edge, so that a pan shows no gap
    /** @type {{ canvas: HTMLCanvasElement, view: Shot } | null} */
    this.front = null;
    this.back = make("canvas");
    /** @type {{ view: Shot, drew: boolean, steps: Steps } | null} */
    this.job = null;
    this.stale = true;
    this.empty = true;
  }

  /** Mark the drawing as outdated for every view. */
  invalidate() {
    this.stale = true;
    this.job = null;
  }

  /** Return whether the drawing is finished for this view.
   * @param {Shot} view */
  ready(view) { return !this.stale && !this.job && same(this.front?.view, view); }

  /** Continue painting, at most for `segments`; return the cost.
   * @param {View} view @param {number} ratio @param {number} segments */
  step(view, ratio, segments) {
    if (this.ready(view)) return 0;
    const began = performance.now();
    const job = (this.job ??= this._begin(view, ratio));
    let spent = 0, finished = false;
    while (spent < segments) {
      const { value, done } = job.steps.next();
      if (done) {
        finished = true;
        break;
      }
      spent += value;
      job.drew ||= value > 0;
    }
    if (spent) flush(this.back);
    budget.learn(spent, performance.now() - began);
    if (finished) this._finish(job);
    return Math.max(spent, 1);
  }

  /** Copy the finished drawing to its position in a view.
   * @param {Context} ctx @param {Shot} view @param {number} ratio */
  blit(ctx, view, ratio, alpha = 1) {
    if (!this.front || this.empty) return;
    const { canvas, view: from } = this.front, zoom = view.scale / from.scale;
    const x = (from.x - view.x) * view.scale + view.width / 2 - zoom * (from.width / 2 + this.margin);
    const y = (view.y - from.y) * view.scale + view.height / 2 - zoom * (from.height / 2 + this.margin);
    ctx.globalAlpha = alpha;
    if (same(from, view)) ctx.drawImage(canvas, Math.round(x * ratio), Math.round(y * ratio));
    else ctx.drawImage(canvas, x * ratio, y * ratio, canvas.width * zoom, canvas.height * zoom);
    ctx.globalAlpha = 1;
  }

  /** Return context and view of the shown drawing, for additions; null without a drawing. */
  addition() {
    if (!this.front) return null;
    this.empty = false;
    return { ctx: contextOf(this.front.canvas), view: this.front.view };
  }

  /** @param {View} view @param {number} ratio */
  _begin(view, ratio) {
    const width = Math.round((view.width + 2 * this.margin) * ratio), height = Math.round((view.height + 2 * this.margin) * ratio);
    const canvas = this.back;
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    const ctx = contextOf(canvas), shot = view.snapshot();
    ctx.reset();
    this.stale = false;
    return { view: shot, drew: false, steps: this.paint(ctx, new Frame(shot, ratio, this.margin)) };
  }

  /** @param {{ view: Shot, drew: boolean }} job */
  _finish(job) {
    const shown = this.front?.canvas ?? make("canvas");
    this.front = { canvas: this.back, view: job.view };
    this.empty = !job.drew;
    this.back = shown;
    this.job = null;
  }
}

/** Transform from millimetres to pixels of a drawing, for painters. */
export class Frame {
  /** @param {Shot} view @param {number} ratio */
  constructor(view, ratio, margin = 0) {
    this.view = view;
    this.ratio = ratio;
    this.margin = margin;
    this.scale = view.scale;
  }

  /** Visible range.
   * @returns {Box} */
  get seen() {
    const { x, y, scale, width, height } = this.view;
    const dx = (width / 2 + this.margin) / scale, dy = (height / 2 + this.margin) / scale;
    return [x - dx, y - dy, x + dx, y + dy];
  }

  /** @param {number} x */
  toX(x) { return (x - this.view.x) * this.scale + this.view.width / 2 + this.margin; }
  /** @param {number} y */
  toY(y) { return (this.view.y - y) * this.scale + this.view.height / 2 + this.margin; }

  /** Set a context to millimetres relative to an origin, y up.
   * @param {Context} ctx @param {Point} origin */
  inMm(ctx, origin) {
    const k = this.scale * this.ratio;
    ctx.setTransform(k, 0, 0, -k, this.toX(origin[0]) * this.ratio, this.toY(origin[1]) * this.ratio);
  }

  /** Set a context to pixels from the upper left corner.
   * @param {Context} ctx */
  inPixels(ctx) { ctx.setTransform(this.ratio, 0, 0, this.ratio, 0, 0); }
}

/** @param {Shot | undefined} a @param {Shot} b */
function same(a, b) {
  return !!a && a.x === b.x && a.y === b.y && a.scale === b.scale && a.width === b.width && a.height === b.height;
}
