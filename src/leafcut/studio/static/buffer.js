// Pictures that are drawn over several frames: until a new one is ready, the last one is shown, moved and scaled.

const SLICE = 9; // milliseconds of drawing before the screen is shown again

/** How many segments can be drawn in a slice of time, learnt from what drawing takes. */
class Budget {
  constructor() {
    this.perMs = 400;
  }

  get segments() { return Math.max(SLICE * this.perMs, 600); }

  /** Learn that so many segments took so many milliseconds. */
  learn(segments, ms) {
    if (segments < 200) return;
    const now = segments / Math.max(ms, 0.2);
    const share = now < this.perMs ? 0.7 : 0.12; // quick to slow down, slow to believe that all is easy
    this.perMs = Math.min(Math.max(this.perMs + share * (now - this.perMs), 30), 50000);
  }
}

export const budget = new Budget();

const scratch = document.createElement("canvas");
scratch.width = scratch.height = 1;

/** Have drawn what was only noted down: browsers put off drawing on a canvas until somebody looks at it. */
function flush(canvas) { scratch.getContext("2d").drawImage(canvas, 0, 0, 1, 1); }

/** One picture. `paint(ctx, view)` is a generator that draws and yields what each step cost, in segments. */
export class Buffer {
  constructor(paint, margin = 96) {
    this.paint = paint;
    this.margin = margin; // pixels drawn beyond each edge, so that a pan does not show an empty one
    this.front = null; // { canvas, view }
    this.back = null;
    this.job = null;
    this.stale = true;
    this.empty = true;
  }

  /** Say that the picture is no longer right, whatever the view. */
  invalidate() {
    this.stale = true;
    this.job = null;
  }

  /** Whether there is a picture of just this view. */
  ready(view) { return !this.stale && !this.job && same(this.front?.view, view); }

  /** Draw on, at most for `segments`; return what it cost. */
  step(view, ratio, segments) {
    if (this.ready(view)) return 0;
    const began = performance.now();
    if (!this.job) this._begin(view, ratio);
    let spent = 0, finished = false;
    while (spent < segments && !finished) {
      const { value, done } = this.job.steps.next();
      finished = done;
      if (done) break;
      spent += value;
      this.job.drew ||= value > 0;
    }
    if (spent) flush(this.back);
    budget.learn(spent, performance.now() - began);
    if (finished) this._finish();
    return Math.max(spent, 1);
  }

  /** Show the picture where it belongs in a view. */
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

  /** Return the context of the picture that is shown, to add to it. */
  context() {
    this.empty = false;
    return this.front.canvas.getContext("2d");
  }

  _begin(view, ratio) {
    const width = Math.round((view.width + 2 * this.margin) * ratio), height = Math.round((view.height + 2 * this.margin) * ratio);
    const canvas = this.back ?? document.createElement("canvas");
    this.back = canvas;
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    const ctx = canvas.getContext("2d");
    ctx.reset();
    const shot = { ...view };
    this.job = { view: shot, drew: false, steps: this.paint(ctx, new Frame(shot, ratio, this.margin)) };
    this.stale = false;
  }

  _finish() {
    const shown = this.front?.canvas ?? null;
    this.front = { canvas: this.back, view: this.job.view };
    this.empty = !this.job.drew;
    this.back = shown;
    this.job = null;
  }
}

/** What a painter needs to know: where millimetres are in the picture. */
export class Frame {
  constructor(view, ratio, margin = 0) {
    this.view = view;
    this.ratio = ratio;
    this.margin = margin;
    this.scale = view.scale;
  }

  /** Return smallest x and y, largest x and y in the picture, mm. */
  get seen() {
    const { x, y, scale, width, height } = this.view;
    const dx = (width / 2 + this.margin) / scale, dy = (height / 2 + this.margin) / scale;
    return [x - dx, y - dy, x + dx, y + dy];
  }

  toX(x) { return (x - this.view.x) * this.scale + this.view.width / 2 + this.margin; }
  toY(y) { return (this.view.y - y) * this.scale + this.view.height / 2 + this.margin; }

  /** Let a context draw in millimetres relative to an origin, y up. */
  inMm(ctx, origin) {
    const k = this.scale * this.ratio;
    ctx.setTransform(k, 0, 0, -k, this.toX(origin[0]) * this.ratio, this.toY(origin[1]) * this.ratio);
  }

  /** Let a context draw in pixels from the upper left. */
  inPixels(ctx) { ctx.setTransform(this.ratio, 0, 0, this.ratio, 0, 0); }
}

function same(a, b) {
  return !!a && a.x === b.x && a.y === b.y && a.scale === b.scale && a.width === b.width && a.height === b.height;
}
