// Marks in the solid view: collisions, differences, measurements, and the selected point.

import { drawChange } from "./differences.js";
import { mm, xy } from "./describe.js";
import { iconButton, make } from "./icons.js";
import { FONT, circle, haloed, strokeHaloed } from "./marks.js";
import { linePath } from "./pen.js";
import { nearest } from "./search.js";
import { LESS, MORE, toneCss } from "./solid_colours.js";

/** @import { Solid } from "./solid.js" */
/** @import { SolidCamera } from "./solid_camera.js" */
/** @import { Colours } from "./theme.js" */
/** @typedef {{ x: number, y: number, z: number }} Place3 */
/** Point of the stock, with the row of the toolpath and the program line that cut it last; -1 and 0 for none.
 * @typedef {Place3 & { path: number, line: number }} SolidPlace */
/** A collision with its line and depth, mm, or a difference ("differs") with the other program's height, mm.
 * @typedef {Place3 & { kind: string, line?: number, depth?: number, other?: number }} Mark */

const REACH = 12; // pixels

export class SolidMarks {
  /** @param {Solid} solid */
  constructor(solid) {
    this.solid = solid;
    /** @type {Mark[]} */
    this.collisions = [];
    /** @type {Mark[]} */
    this.differences = [];
    /** @type {Mark[]} */
    this.marks = [];
    this.current = -1; // index of the selected mark
    this.on = this.byKey = false;
    /** First and second point of the measurement. @type {SolidPlace | null} */
    this.from = null;
    /** @type {SolidPlace | null} */
    this.to = null;
    /** Point under the cursor. @type {SolidPlace | null} */
    this.at = null;
    /** Selected point. @type {SolidPlace | null} */
    this.chosen = null;
  }

  forget() {
    this.collisions = this.differences = this.marks = [];
    this.current = -1;
    this.on = false;
    this.from = this.to = this.at = this.chosen = null;
    this._list();
  }

  /** Load the marks of the scene: collisions, and differences from another program. */
  take() {
    const { blocks, header } = this.solid;
    this.collisions = header.collisions.map((/** @type {[string, number]} */ [kind, line], /** @type {number} */ k) => {
      const [x, y, z, depth] = blocks.collision.subarray(4 * k, 4 * k + 4);
      return { kind, line, x, y, z, depth };
    });
    this.differences = (header.differs?.places ?? []).map((/** @type {number[]} */ [x, y, z, other]) => ({ kind: "differs", x, y, z, other }));
    this.marks = [...this.collisions, ...this.differences];
    this._list();
  }

  /** Show the number of marks of each kind, and buttons to step through them. */
  _list() {
    const { solid, collisions, differences } = this, { words } = solid, differs = solid.stock ? solid.header.differs : null;
    solid.collisions.hidden = !collisions.length;
    solid.differs.hidden = !differs;
    const buttons = (/** @type {string} */ name, /** @type {Mark[]} */ list) => [
      iconButton("up", words[`${name}Previous`], () => this.go(-1, list)), iconButton("down", words[`${name}Next`], () => this.go(1, list)),
    ];
    if (collisions.length) {
      const count = make("span", "", {}, words.collisions.replace("{number}", String(collisions.length)));
      solid.collisions.replaceChildren(count, ...buttons("collision", collisions));
    }
    if (!differs) return;
    const count = make("span", "", {}, differs.count ? words.differs.replace("{number}", differs.count) : words.differsNone);
    const swatch = (/** @type {number} */ tone, /** @type {string} */ text) => {
      const square = make("i", "", { "aria-hidden": "true" });
      square.style.background = toneCss(tone);
      return [square, make("span", "", {}, text)];
    };
    const meaning = differs.count ? [...swatch(MORE, words.differsMore), ...swatch(LESS, words.differsLess)] : [];
    solid.differs.replaceChildren(count, ...meaning, ...(differences.length ? buttons("differs", differences) : []));
  }

  /** Go to the next or previous mark of a list.
   * @param {number} step */
  go(step, list = this.marks) {
    const { length } = list;
    if (!length) return;
    const at = list.indexOf(this.marks[this.current]);
    this.choose(this.marks.indexOf(list[(at + step + length + (at < 0 && step < 0 ? 1 : 0)) % length]));
  }

  /** @param {number} index */
  choose(index) {
    const { kind, line = 0, depth = 0, z, other = 0 } = this.marks[index], { solid } = this, { words, drawing } = solid;
    this.current = index;
    this.chosen = null;
    solid.wake();
    if (kind === "differs") {
      drawing.say([words.differsPlace.replace("{here}", mm(z)).replace("{other}", mm(other))]);
      return;
    }
    drawing.selectLine(line);
    drawing.say([words[`collision_${kind}`] ?? kind, `${mm(depth)} mm`, `${words.line} ${line}`]);
  }

  /** Start or stop measuring; with the keyboard, the centre of the view is the cursor. */
  measure(on = !this.on, byKey = false) {
    this.on = on;
    this.from = this.to = this.at = null;
    this.byKey = byKey;
    this.solid.drawing.toolbar.update();
    if (on && byKey) this.aim();
    this._tell();
  }

  aim() {
    const { camera } = this.solid;
    this.at = this.solid.placeAt(camera.width / 2, camera.height_px / 2);
    this._tell(true);
  }

  /** Handle a pointer position.
   * @param {number} px @param {number} py */
  move(px, py) {
    const { solid } = this, found = solid.placeAt(px, py);
    if (this.on) {
      this.byKey = false;
      this.at = found;
      this._tell(true);
    } else solid.drawing.say(found ? this._words(found) : [], true);
  }

  /** Handle a click or Enter: take a point of the measurement, or select a point.
   * @param {number} px @param {number} py */
  press(px, py) {
    const { solid } = this;
    if (this.on) {
      if (!this.byKey) this.at = solid.placeAt(px, py);
      if (!this.at) return;
      if (!this.from || this.to) [this.from, this.to] = [this.at, null];
      else this.to = this.at;
      this._tell();
      return;
    }
    const mark = this.near(px, py);
    if (mark >= 0) {
      this.choose(mark);
      return;
    }
    const found = solid.placeAt(px, py);
    this.chosen = found;
    this.current = -1;
    if (found && found.path >= 0) solid.drawing.select(found.path);
    solid.drawing.say(found ? this._words(found) : []);
    solid.wake();
  }

  /** Return the index of the nearest mark, or -1.
   * @param {number} px @param {number} py */
  near(px, py) {
    const { camera } = this.solid;
    return nearest(this.marks.keys(), REACH, (k) => {
      const { x, y, z } = this.marks[k], [mx, my] = camera.project(x, y, z);
      return Math.hypot(mx - px, my - py);
    });
  }

  /** @param {SolidPlace} place */
  _words({ x, y, z, line }) {
    const [ox, oy] = this.solid.header.origin, { words } = this.solid;
    return [`${xy(x + ox, y + oy)}  Z ${mm(z)}`, line ? `${words.line} ${line}` : words.solidUncut];
  }

  /** Return the measurement as text. */
  get words() {
    const { words } = this.solid, { from } = this, to = this.to ?? this.at;
    if (!from) return [words.measure, words.measureFrom];
    if (!to) return [words.measure, words.measureTo];
    const dx = to.x - from.x, dy = to.y - from.y, dz = to.z - from.z;
    return [`${mm(Math.hypot(dx, dy, dz))} mm`, `ΔX ${mm(dx)}  ΔY ${mm(dy)}  ΔZ ${mm(dz)}`];
  }

  _tell(quiet = false) {
    this.solid.drawing.say(this.on ? this.words : [], quiet);
    this.solid.wake();
  }

  /** Cancel the measurement, or else the selection; return whether anything was cancelled. */
  escape() {
    if (this.on) this.measure(false);
    else if (this.chosen || this.current >= 0) {
      this.chosen = null;
      this.current = -1;
      this.solid.wake();
    } else return false;
    return true;
  }

  /** @param {Context} ctx @param {SolidCamera} camera @param {Colours} theme */
  draw(ctx, camera, theme) {
    for (const [k, mark] of this.marks.entries()) drawMark(ctx, camera, mark, theme, k === this.current);
    if (this.chosen) ring(ctx, camera, this.chosen, theme);
    if (!this.on) return;
    const { from, at } = this, to = this.to ?? (from ? at : null);
    if (from && to) {
      const corners = [from, { ...from, x: to.x }, { ...to, z: from.z }, to].map(({ x, y, z }) => camera.project(x, y, z));
      const [[ax, ay], , , [bx, by]] = corners;
      ctx.strokeStyle = theme["ink-2"];
      ctx.lineWidth = 1.2;
      ctx.setLineDash([4, 4]);
      ctx.stroke(linePath(corners.flatMap(([x, y]) => [x, y])));
      ctx.setLineDash([]);
      strokeHaloed(ctx, linePath([ax, ay, bx, by]), theme.accent, 2, theme.card, 4.5);
      ctx.font = FONT;
      ctx.textAlign = "center";
      ctx.textBaseline = "bottom";
      haloed(ctx, this.words[0], (ax + bx) / 2, (ay + by) / 2 - 8, theme.ink, theme.card);
    }
    for (const place of [from, to, this.to ? null : at]) if (place) ring(ctx, camera, place, theme);
  }
}

/** @param {Context} ctx @param {SolidCamera} camera @param {Place3} place @param {Colours} theme */
function ring(ctx, camera, { x, y, z }, theme) {
  const [px, py] = camera.project(x, y, z);
  strokeHaloed(ctx, circle(px, py, 6), theme.accent, 2.2, theme.card, 5);
}

/** Draw the sign of a difference, or a triangle with an exclamation mark, recognizable without colour.
 * @param {Context} ctx @param {SolidCamera} camera @param {Mark} mark @param {Colours} theme @param {boolean} chosen */
function drawMark(ctx, camera, { kind, x, y, z }, theme, chosen) {
  const [px, py] = camera.project(x, y, z);
  if (kind === "differs") {
    drawChange(ctx, px, py, "changed", theme.warn, theme.card, chosen ? 11 : 8);
    ctx.stroke(linePath([px - 3, py + 5, px + 3, py - 5]));
    return;
  }
  const size = chosen ? 13 : 10, triangle = linePath([px, py - size, px + size, py + 0.75 * size, px - size, py + 0.75 * size]);
  triangle.closePath();
  ctx.lineJoin = "round";
  ctx.strokeStyle = theme.card;
  ctx.lineWidth = 4;
  ctx.stroke(triangle);
  ctx.fillStyle = theme.bad;
  ctx.fill(triangle);
  ctx.fillStyle = theme.card;
  ctx.font = `700 ${size + 2}px system-ui, sans-serif`;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  ctx.fillText("!", px, py + 0.15 * size);
}
