// Measuring between two points, both snapped to centres of holes, ends of lines and arcs, and stops.

import { emptyBox, widen } from "./boxes.js";
import { mm, xy } from "./describe.js";
import { gridOfPoints } from "./hit_test.js";
import { FONT, haloed, strokeHaloed } from "./marks.js";
import { linePath } from "./pen.js";
import { nearest } from "./search.js";

/** @import { Point } from "./boxes.js" */
/** @import { Drawing } from "./canvas.js" */
/** @import { PartScene, ToolpathScene } from "./scene.js" */
/** @import { Colours } from "./theme.js" */
/** @import { View } from "./view.js" */

const REACH = 12; // pixels

/** Snap points of a drawing, mm. */
export class Places {
  /** @param {Point[]} places */
  constructor(places) {
    const extents = emptyBox();
    for (const [x, y] of places) widen(extents, x, y);
    this.places = places;
    this.grid = gridOfPoints({ origin: [0, 0], extents }, places.length, (k) => places[k]);
  }

  /** Return the nearest snap point within a reach, mm, or null.
   * @param {number} x @param {number} y @param {number} reach @returns {Point | null} */
  near(x, y, reach) {
    const away = (/** @type {Point} */ place) => Math.hypot(place[0] - x, place[1] - y);
    return this.places[nearest(this.grid.around(x, y, reach), reach, (k) => away(this.places[k]))] ?? null;
  }
}

/** @param {PartScene} part @param {Set<string>} hidden @returns {Generator<Point>} */
export function* placesOfPart(part, hidden) {
  const [ox, oy] = part.origin;
  for (let k = 0; k < part.holes; k++) if (!hidden.has(part.layerName("hole", k))) yield part.holePlace(k);
  for (let k = 0; k < part.slots; k++) {
    const [x0, y0, x1, y1] = part.slot.subarray(5 * k, 5 * k + 4);
    yield [x0 + ox, y0 + oy];
    yield [x1 + ox, y1 + oy];
  }
  for (let k = 0; k < part.outlines; k++) {
    if (hidden.has(part.layerName("outline", k))) continue;
    const { first, count, closed } = part.outlineAt(k), v = part.vertex;
    for (let at = first; at < first + count; at++) yield [v[3 * at] + ox, v[3 * at + 1] + oy];
    // The centre of a circle, which is two half circles.
    if (closed && count === 2 && Math.abs(Math.abs(v[3 * first + 2]) - 1) < 1e-3) {
      yield [(v[3 * first] + v[3 * first + 3]) / 2 + ox, (v[3 * first + 1] + v[3 * first + 4]) / 2 + oy];
    }
  }
}

/** @param {ToolpathScene} scene @returns {Generator<Point>} */
function* placesOfPath(scene) {
  const [ox, oy] = scene.origin;
  for (let row = 0; row < scene.rows; row++) {
    const x = scene.x1(row) + ox, y = scene.y1(row) + oy;
    if (Number.isFinite(x + y)) yield [x, y];
  }
}

/** A measurement: without points, with the first point, or with both. */
export class Measure {
  /** @param {Drawing} drawing */
  constructor(drawing) {
    this.drawing = drawing;
    this.on = this.byKey = false;
    /** First and second point, and the point under the cursor, mm. @type {Point | null} */
    this.from = null;
    /** @type {Point | null} */
    this.to = null;
    /** @type {Point | null} */
    this.at = null;
    /** @type {Places | null} */
    this._places = null;
  }

  /** Start or stop measuring; with the keyboard, the centre of the drawing is the cursor. */
  toggle(on = !this.on, byKey = false) {
    this.on = on;
    this.byKey = byKey;
    this.from = this.to = this.at = null;
    this.renew();
    if (on && byKey) this.aim();
    this._tell();
  }

  /** Drop the snap points: the content of the drawing has changed. */
  renew() { this._places = null; }

  /** Return the snap point near a point of the drawing, mm, or else the point itself.
   * @param {number} x @param {number} y @returns {Point} */
  snapped(x, y) {
    const { scenes, main, hidden, view } = this.drawing;
    this._places ??= new Places([
      ...[scenes.part, scenes.whole].flatMap((part) => (part ? [...placesOfPart(part, hidden)] : [])),
      ...(main ? placesOfPath(main.scene) : []), [0, 0],
    ]);
    return this._places.near(x, y, REACH / view.scale) ?? [x, y];
  }

  /** Handle a pointer position, pixels.
   * @param {number} px @param {number} py */
  move(px, py) {
    const { view } = this.drawing;
    this.byKey = false;
    this.at = this.snapped(view.mmX(px), view.mmY(py));
    this._tell(true);
  }

  /** Use the centre of the drawing as the cursor while the view moves. */
  aim() {
    const { view } = this.drawing;
    this.byKey = true;
    this.at = this.snapped(view.x, view.y);
    this._tell(true);
  }

  /** Take the point under the cursor as the first or the second. */
  take() {
    if (!this.at) return;
    if (!this.from || this.to) [this.from, this.to] = [this.at, null];
    else this.to = this.at;
    this._tell();
  }

  /** Return the measurement as text. */
  words() {
    const { words } = this.drawing, { from } = this, to = this.to ?? this.at;
    if (!from) return [words.measure, words.measureFrom, ...(this.at ? [xy(...this.at)] : [])];
    if (!to) return [words.measure, words.measureTo];
    const dx = to[0] - from[0], dy = to[1] - from[1], angle = (Math.atan2(dy, dx) * 180) / Math.PI;
    return [`${mm(Math.hypot(dx, dy))} ${this.drawing.unit}`.trim(), `ΔX ${mm(dx)}  ΔY ${mm(dy)}`, `${angle.toFixed(2)}°`];
  }

  _tell(quiet = false) {
    this.drawing.tellMeasure(this.on ? this.words() : [], quiet);
  }

  /** Draw the points and the line between them; `ctx` is in pixels.
   * @param {Context} ctx @param {View} view @param {Colours} colours */
  draw(ctx, view, colours) {
    if (!this.on) return;
    const { from, at } = this, to = this.to ?? (from ? at : null);
    if (from && to) {
      const ax = view.toX(from[0]), ay = view.toY(from[1]), bx = view.toX(to[0]), by = view.toY(to[1]);
      strokeHaloed(ctx, linePath([ax, ay, bx, by]), colours.ink, 1.8, colours.card, 5);
      ctx.setLineDash([3, 4]);
      ctx.strokeStyle = colours["ink-2"];
      ctx.lineWidth = 1;
      ctx.stroke(linePath([ax, ay, bx, ay, bx, by]));
      ctx.setLineDash([]);
      ctx.font = FONT;
      ctx.textAlign = "center";
      ctx.textBaseline = "bottom";
      haloed(ctx, this.words()[0], (ax + bx) / 2, (ay + by) / 2 - 6, colours.ink, colours.card);
    }
    for (const place of [from, to, this.to ? null : at]) {
      if (!place) continue;
      const px = view.toX(place[0]), py = view.toY(place[1]);
      const cross = linePath([px - 8, py, px + 8, py, NaN, NaN, px, py - 8, px, py + 8]);
      strokeHaloed(ctx, cross, colours.accent, 2, colours.card, 4.5);
    }
  }
}
