// Measuring between two points, both snapped to centres of holes, ends of lines and arcs, and stops.

import { mm } from "./describe.js";
import { haloed, FONT } from "./marks.js";

const REACH = 12; // pixels

/** All snap points of a drawing, in cells. */
class Places {
  /** `x` and `y` in mm, including the origin. */
  constructor(places) {
    this.places = places;
    let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
    for (const [x, y] of places) {
      x0 = Math.min(x0, x);
      y0 = Math.min(y0, y);
      x1 = Math.max(x1, x);
      y1 = Math.max(y1, y);
    }
    this.size = Math.max(Math.sqrt((Math.max(x1 - x0, 1e-3) * Math.max(y1 - y0, 1e-3)) / Math.max(places.length, 1)), 1e-3);
    this.cells = new Map();
    for (const place of places) {
      const key = this._key(Math.floor(place[0] / this.size), Math.floor(place[1] / this.size));
      if (this.cells.has(key)) this.cells.get(key).push(place); else this.cells.set(key, [place]);
    }
  }

  _key(column, row) { return `${column} ${row}`; }

  /** Return the nearest snap point within a reach, mm, or null. */
  near(x, y, reach) {
    const span = Math.ceil(reach / this.size);
    if ((2 * span + 1) ** 2 > 4 * this.cells.size) return nearest(this.places, x, y, reach);
    const column = Math.floor(x / this.size), row = Math.floor(y / this.size), found = [];
    for (let dx = -span; dx <= span; dx++) {
      for (let dy = -span; dy <= span; dy++) found.push(...(this.cells.get(this._key(column + dx, row + dy)) ?? []));
    }
    return nearest(found, x, y, reach);
  }
}

function nearest(places, x, y, reach) {
  let best = null, least = reach;
  for (const place of places) {
    const away = Math.hypot(place[0] - x, place[1] - y);
    if (away <= least) {
      least = away;
      best = place;
    }
  }
  return best;
}

function* placesOfPart(part, hidden) {
  const [ox, oy] = part.origin;
  for (let k = 0; k < part.holes; k++) {
    if (!hidden.has(part.layerName("hole", k))) yield [part.hole[3 * k] + ox, part.hole[3 * k + 1] + oy];
  }
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

function* placesOfPath(scene) {
  const [ox, oy] = scene.origin;
  for (let row = 0; row < scene.rows; row++) {
    const x = scene.x1(row) + ox, y = scene.y1(row) + oy;
    if (Number.isFinite(x + y)) yield [x, y];
  }
}

/** A measurement: without points, with the first point, or with both. */
export class Measure {
  constructor(drawing) {
    this.drawing = drawing;
    this.on = false;
    this.from = this.to = this.at = null;
  }

  /** Start or stop measuring; with the keyboard, the centre of the drawing is the cursor. */
  toggle(on = !this.on, byKey = false) {
    this.on = on;
    this.byKey = byKey;
    this.from = this.to = this.at = this._places = null;
    if (on && byKey) this.aim();
    this._tell();
  }

  /** Drop the snap points: the content of the drawing has changed. */
  renew() { this._places = null; }

  /** Return the snap point near a point of the drawing, mm, or else the point itself. */
  snapped(x, y) {
    const { scenes, main, hidden, view } = this.drawing;
    this._places ??= new Places([
      ...[scenes.part, scenes.whole].filter(Boolean).flatMap((part) => [...placesOfPart(part, hidden)]),
      ...(main ? placesOfPath(main.scene) : []), [0, 0],
    ]);
    return this._places.near(x, y, REACH / view.scale) ?? [x, y];
  }

  /** Handle a pointer position, pixels. */
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
    if (!from) return [words.measure, words.measureFrom, ...(this.at ? [`X ${mm(this.at[0])}  Y ${mm(this.at[1])}`] : [])];
    if (!to) return [words.measure, words.measureTo];
    const dx = to[0] - from[0], dy = to[1] - from[1], angle = (Math.atan2(dy, dx) * 180) / Math.PI;
    const unit = this.drawing.unitless ? "" : " mm";
    return [`${mm(Math.hypot(dx, dy))}${unit}`, `ΔX ${mm(dx)}  ΔY ${mm(dy)}`, `${angle.toFixed(2)}°`];
  }

  _tell(quiet = false) {
    this.drawing.tellMeasure(this.on ? this.words() : [], quiet);
  }

  /** Draw the points and the line between them; `ctx` is in pixels. */
  draw(ctx, view, colours) {
    if (!this.on) return;
    const { from, at } = this, to = this.to ?? (from ? at : null), pixel = ([x, y]) => [view.toX(x), view.toY(y)];
    if (from && to) {
      const [ax, ay] = pixel(from), [bx, by] = pixel(to);
      for (const [colour, width] of [[colours.card, 5], [colours.ink, 1.8]]) {
        ctx.strokeStyle = colour;
        ctx.lineWidth = width;
        ctx.beginPath();
        ctx.moveTo(ax, ay);
        ctx.lineTo(bx, by);
        ctx.stroke();
      }
      ctx.setLineDash([3, 4]);
      ctx.strokeStyle = colours["ink-2"];
      ctx.lineWidth = 1;
      ctx.beginPath();
      ctx.moveTo(ax, ay);
      ctx.lineTo(bx, ay);
      ctx.lineTo(bx, by);
      ctx.stroke();
      ctx.setLineDash([]);
      ctx.font = FONT;
      ctx.textAlign = "center";
      ctx.textBaseline = "bottom";
      haloed(ctx, this.words()[0], (ax + bx) / 2, (ay + by) / 2 - 6, colours.ink, colours.card);
    }
    for (const place of [from, to, this.to ? null : at]) if (place) cross(ctx, ...pixel(place), colours);
  }
}

function cross(ctx, px, py, colours) {
  for (const [colour, width] of [[colours.card, 4.5], [colours.accent, 2]]) {
    ctx.strokeStyle = colour;
    ctx.lineWidth = width;
    ctx.beginPath();
    ctx.moveTo(px - 8, py);
    ctx.lineTo(px + 8, py);
    ctx.moveTo(px, py - 8);
    ctx.lineTo(px, py + 8);
    ctx.stroke();
  }
}
