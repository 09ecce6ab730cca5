// Marks in the solid view: collisions, differences, measurements, and the selected point.

import { mm } from "./describe.js";
import { iconButton, make } from "./icons.js";
import { FONT, haloed } from "./marks.js";
import { LESS, MORE, toneCss } from "./solid_colours.js";

const REACH = 12; // pixels

export class SolidMarks {
  constructor(solid) {
    this.solid = solid;
    this.forget();
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
    this.collisions = header.collisions.map(([kind, line], k) => {
      const [x, y, z, depth] = blocks.collision.subarray(4 * k, 4 * k + 4);
      return { kind, line, x, y, z, depth };
    });
    this.differences = (header.differs?.places ?? []).map(([x, y, z, other]) => ({ kind: "differs", x, y, z, other }));
    this.marks = [...this.collisions, ...this.differences];
    this._list();
  }

  /** Show the number of marks of each kind, and buttons to step through them. */
  _list() {
    const { solid, collisions, differences } = this, { words } = solid, differs = solid.header?.differs;
    solid.collisions.hidden = !collisions.length;
    solid.differs.hidden = !differs || !solid.stock;
    const buttons = (name, list) => [
      iconButton("up", words[`${name}Previous`], () => this.go(-1, list)), iconButton("down", words[`${name}Next`], () => this.go(1, list)),
    ];
    if (collisions.length) {
      const count = make("span", "", {}, words.collisions.replace("{number}", collisions.length));
      solid.collisions.replaceChildren(count, ...buttons("collision", collisions));
    }
    if (solid.differs.hidden) return;
    const count = make("span", "", {}, differs.count ? words.differs.replace("{number}", differs.count) : words.differsNone);
    const swatch = (tone, said) => {
      const square = make("i", "", { "aria-hidden": "true" });
      square.style.background = toneCss(tone);
      return [square, make("span", "", {}, said)];
    };
    const meaning = differs.count ? [...swatch(MORE, words.differsMore), ...swatch(LESS, words.differsLess)] : [];
    solid.differs.replaceChildren(count, ...meaning, ...(differences.length ? buttons("differs", differences) : []));
  }

  /** Go to the next or previous mark of a list. */
  go(step, list = this.marks) {
    const { length } = list;
    if (!length) return;
    const at = list.indexOf(this.marks[this.current]);
    this.choose(this.marks.indexOf(list[(at + step + length + (at < 0 && step < 0 ? 1 : 0)) % length]));
  }

  choose(index) {
    const one = this.marks[index], { solid } = this, { words, drawing } = solid;
    this.current = index;
    this.chosen = null;
    solid.wake();
    if (one.kind === "differs") {
      drawing._say([words.differsPlace.replace("{here}", mm(one.z)).replace("{other}", mm(one.other))]);
      return;
    }
    drawing.selectLine(one.line);
    const kind = words[`collision_${one.kind}`] ?? one.kind;
    drawing._say([kind, `${mm(one.depth)} mm`, `${words.line} ${one.line}`]);
  }

  /** Start or stop measuring; with the keyboard, the centre of the view is the cursor. */
  measure(on = !this.on, byKey = false) {
    this.on = on;
    this.from = this.to = this.at = null;
    this.byKey = byKey;
    this.solid.drawing.toolbar?.update();
    if (on && byKey) this.aim();
    this._tell();
  }

  aim() {
    const { camera } = this.solid;
    this.at = this.solid.placeAt(camera.width / 2, camera.height_px / 2);
    this._tell(true);
  }

  /** Handle a pointer position, or none. */
  move(px, py) {
    const { solid } = this, found = solid.placeAt(px, py);
    if (this.on) {
      this.byKey = false;
      this.at = found;
      this._tell(true);
    } else solid.drawing._say(found ? this._words(found) : [], true);
  }

  /** Handle a click or Enter: take a point of the measurement, or select a point. */
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
    if (found?.path >= 0) solid.drawing.select(found.path);
    solid.drawing._say(found ? this._words(found) : []);
    solid.wake();
  }

  near(px, py) {
    const { camera } = this.solid;
    let best = -1, least = REACH;
    this.marks.forEach((one, k) => {
      const [x, y] = camera.project(one.x, one.y, one.z), away = Math.hypot(x - px, y - py);
      if (away <= least) [least, best] = [away, k];
    });
    return best;
  }

  _words({ x, y, z, line }) {
    const [ox, oy] = this.solid.header.origin, { words } = this.solid;
    return [`X ${mm(x + ox)}  Y ${mm(y + oy)}  Z ${mm(z)}`, line ? `${words.line} ${line}` : words.solidUncut];
  }

  /** Return the measurement as text. */
  get words() {
    const { words } = this.solid, { from } = this, to = this.to ?? this.at;
    if (!from) return [words.measure, words.measureFrom];
    if (!to) return [words.measure, words.measureTo];
    const d = ["x", "y", "z"].map((axis) => to[axis] - from[axis]);
    return [`${mm(Math.hypot(...d))} mm`, `ΔX ${mm(d[0])}  ΔY ${mm(d[1])}  ΔZ ${mm(d[2])}`];
  }

  _tell(quiet = false) {
    this.solid.drawing._say(this.on ? this.words : [], quiet);
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

  draw(ctx, camera, theme) {
    this.marks.forEach((one, k) => (one.kind === "differs" ? unlike : warning)(ctx, camera.project(one.x, one.y, one.z), theme, k === this.current));
    if (this.chosen) ring(ctx, camera.project(this.chosen.x, this.chosen.y, this.chosen.z), theme.accent, theme.card);
    if (!this.on) return;
    const { from, at } = this, to = this.to ?? (from ? at : null);
    if (from && to) {
      const corner = { x: to.x, y: to.y, z: from.z }, turn = { x: to.x, y: from.y, z: from.z };
      line(ctx, camera, [from, turn, corner, to], theme["ink-2"], 1.2, [4, 4]);
      for (const [colour, width] of [[theme.card, 4.5], [theme.accent, 2]]) line(ctx, camera, [from, to], colour, width);
      const [ax, ay] = camera.project(from.x, from.y, from.z), [bx, by] = camera.project(to.x, to.y, to.z);
      ctx.font = FONT;
      ctx.textAlign = "center";
      ctx.textBaseline = "bottom";
      haloed(ctx, this.words[0], (ax + bx) / 2, (ay + by) / 2 - 8, theme.ink, theme.card);
    }
    for (const place of [from, to, this.to ? null : at]) if (place) ring(ctx, camera.project(place.x, place.y, place.z), theme.accent, theme.card);
  }
}

function line(ctx, camera, places, colour, width, dash = []) {
  ctx.strokeStyle = colour;
  ctx.lineWidth = width;
  ctx.setLineDash(dash);
  ctx.beginPath();
  places.forEach(({ x, y, z }, k) => {
    const [px, py] = camera.project(x, y, z);
    if (k) ctx.lineTo(px, py); else ctx.moveTo(px, py);
  });
  ctx.stroke();
  ctx.setLineDash([]);
}

function ring(ctx, [x, y], colour, card) {
  for (const [stroke, width] of [[card, 5], [colour, 2.2]]) {
    ctx.strokeStyle = stroke;
    ctx.lineWidth = width;
    ctx.beginPath();
    ctx.arc(x, y, 6, 0, 2 * Math.PI);
    ctx.stroke();
  }
}

/** Draw a disc with the sign for a change, as in the plan. */
function unlike(ctx, [x, y], theme, chosen) {
  const size = chosen ? 11 : 8;
  ctx.beginPath();
  ctx.arc(x, y, size, 0, 2 * Math.PI);
  ctx.fillStyle = theme.warn;
  ctx.strokeStyle = theme.card;
  ctx.lineWidth = 2;
  ctx.fill();
  ctx.stroke();
  ctx.beginPath();
  for (const dy of [-2, 2]) {
    ctx.moveTo(x - 4, y + dy);
    ctx.lineTo(x + 4, y + dy);
  }
  ctx.moveTo(x - 3, y + 5);
  ctx.lineTo(x + 3, y - 5);
  ctx.stroke();
}

/** Draw a triangle with an exclamation mark, recognizable without colour. */
function warning(ctx, [x, y], theme, chosen) {
  const size = chosen ? 13 : 10;
  ctx.beginPath();
  ctx.moveTo(x, y - size);
  ctx.lineTo(x + size, y + 0.75 * size);
  ctx.lineTo(x - size, y + 0.75 * size);
  ctx.closePath();
  ctx.lineJoin = "round";
  ctx.strokeStyle = theme.card;
  ctx.lineWidth = 4;
  ctx.stroke();
  ctx.fillStyle = theme.bad;
  ctx.fill();
  ctx.fillStyle = theme.card;
  ctx.font = `700 ${size + 2}px system-ui, sans-serif`;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  ctx.fillText("!", x, y + 0.15 * size);
}
