// Solid view of the drawing: the stock in 3D, cut in step with the playback.
//
// A worker cuts the stock (solid_worker.js) and reports changes; three.js draws it (solid_view.js).

import { mm } from "./describe.js";
import { contextOf, make, selection } from "./icons.js";
import { readScene } from "./scene.js";
import { SolidCamera, meet, sectioned } from "./solid_camera.js";
import { COLOURINGS, FIXTURE, LESS, MORE, TOOL, paletteOf, scaleCss, sectionColour, tonesOf } from "./solid_colours.js";
import { listenToSolid } from "./solid_input.js";
import { SolidMarks } from "./solid_marks.js";
import { startOf } from "./solid_stock.js";
import { SolidView } from "./solid_view.js";
import { surface } from "./sweep.js";
import { isDark, rgbOf } from "./theme.js";

/** @import { Drawing, Which } from "./canvas.js" */
/** @import { Header, ToolpathScene } from "./scene.js" */
/** @import { Block } from "./solid_camera.js" */
/** @import { SolidPlace } from "./solid_marks.js" */
/** @import { Change } from "./solid_stock.js" */
/** @import { Stock, Tool, ToolPart } from "./solid_view.js" */
/** @import { Colours } from "./theme.js" */
/** Loads a stock; null if the server has removed it.
 * @typedef {() => Promise<ArrayBuffer | null>} Load */

/** Time without change after which the view is at rest, ms. */
const REST = 140;
const SIDES = /** @type {const} */ (["iso", "top", "front"]);

export class Solid {
  /** @param {HTMLElement} host @param {Drawing} drawing */
  constructor(host, drawing) {
    const { words } = drawing;
    this.drawing = drawing;
    this.words = words;
    this.camera = new SolidCamera();
    /** @type {Partial<Record<Which, Load>>} */
    this.offers = {};
    this.colouring = "metal";
    this.section = { axis: "", share: 0.5 };
    /** @type {Record<string, boolean>} */
    this.shows = { tool: true, path: false };
    /** @type {Stock | null} */
    this.stock = null;
    /** @type {ToolpathScene | null} */
    this.scene = null;
    /** @type {Worker | null} */
    this.worker = null;
    /** Blocks and header of the stock's scene. @type {any} */
    this.blocks = null;
    /** @type {Header | any} */
    this.header = null;
    /** Toolpath whose stock is loaded or being loaded. @type {{ which: Which, scene: ToolpathScene | null } | null} */
    this._loaded = null;
    this.turn = this.told = 0; // numbers of the last request to the worker, and of the last one it has reached
    this.cut = 0; // number of completed moves
    this.time = Infinity;
    /** @type {Block | null} */
    this.box = null;
    this.bottom = 0; // lowest height, mm
    this._place = ""; // box and origin for which the view was fitted
    /** @type {Uint8Array} */
    this.tones = new Uint8Array();
    this.ratio = 1;
    /** @type {Colours | null} */
    this.theme = null;
    this.dark = false;
    /** Picture of the stock, from the first stock on. @type {SolidView | null} */
    this.view = null;
    this.picture = make("canvas", "lc-picture", { hidden: "" });
    this.moved = 0; // time of the last change, ms
    this._request = this._late = this._resting = 0;
    this.host = make("div", "lc-pane lc-solid", { hidden: "" });
    this.over = make("canvas", "lc-over", { tabindex: "0", role: "application", "aria-label": words.solidDrawing });
    this.ctx = contextOf(this.over);
    this.reason = make("p", "lc-empty lc-refused", { hidden: "" });
    this.scale = { name: make("span"), ramp: make("i", "lc-ramp"), low: make("b"), high: make("b") };
    this.legend = make("div", "lc-scale", { hidden: "" }, ...Object.values(this.scale));
    this.collisions = make("div", "lc-collisions", { hidden: "" });
    this.differs = make("div", "lc-differs", { hidden: "" });
    this.busy = make("div", "lc-busy", { hidden: "" }, words.solidCutting);
    this.frame = make("div", "lc-solid-frame", {}, this.picture, this.over, this.legend, this.collisions, this.differs, this.busy, this.reason);
    this.colours = this._select("solidColour", COLOURINGS.map((name) => [name, words[`colour_${name}`]]), (name) => this.colour(name));
    const sections = /** @type {[string, string][]} */ ([["", words.section_none], ["x", words.section_x], ["y", words.section_y]]);
    this.axis = this._select("solidSection", sections, (axis) => this.cutOpen(axis, this.section.share));
    this.plane = make("input", "lc-slider lc-plane", { type: "range", min: 0, max: 1000, value: 500, "aria-label": words.solidPlane, hidden: "" });
    this.plane.addEventListener("input", () => this.cutOpen(this.section.axis, Number(this.plane.value) / 1000));
    this.plane.addEventListener("change", () => drawing.keepView());
    this.toggles = Object.fromEntries(Object.entries(this.shows).map(([name, shown]) => [name, this._button(`solid_${name}`, () => {
      this.show(name, !this.shows[name]);
      drawing.keepView();
    }, { "aria-pressed": String(shown) })]));
    this.bar = make(
      "div", "lc-solid-bar", { role: "toolbar", "aria-label": words.solid },
      make("div", "lc-group", { role: "group", "aria-label": words.solidFrom }, ...SIDES.map((from) => this._button(`solid_${from}`, () => this.look(from)))),
      this.colours, this.axis, make("div", "lc-group", {}, ...Object.values(this.toggles)), this.plane,
    );
    this.picture.addEventListener("webglcontextrestored", () => this.wake());
    this.host.append(this.bar, this.frame);
    host.append(this.host);
    this.marks = new SolidMarks(this);
    listenToSolid(this);
  }

  /** @param {string} text @param {() => void} action */
  _button(text, action, attributes = {}) {
    const button = make("button", "lc-button", { type: "button", ...attributes }, this.words[text]);
    button.addEventListener("click", action);
    return button;
  }

  /** @param {string} label @param {[string, string][]} choices @param {(value: string) => void} action */
  _select(label, choices, action) {
    return selection("", this.words[label], choices, (value) => {
      action(value);
      this.drawing.keepView();
    });
  }

  // Content.

  /** Set the function that loads the stock with the moves "before" or "after"; null: no stock.
   * @param {Which} which @param {Load | null} load */
  offer(which, load) {
    if (load) this.offers[which] = load; else delete this.offers[which];
    if (this._loaded?.which === which) this._forget();
  }

  get offered() { return Object.keys(this.offers).length > 0; }

  /** Show the stock of the toolpath that is played, if the view is visible. */
  follow() {
    const scene = this.drawing.main?.scene ?? null;
    if (this.host.hidden || (this._loaded && this._loaded.scene === scene)) return;
    this._load(scene?.header.which ?? "", scene);
  }

  /** @param {Which} which @param {ToolpathScene | null} scene */
  async _load(which, scene) {
    this._forget();
    const loaded = (this._loaded = { which, scene }), load = this.offers[which];
    this._refuse(load ? "" : this.words.solidNone);
    if (!load || !scene) return;
    this.setBusy(true);
    let found = null;
    try {
      const bytes = await load();
      found = bytes?.byteLength ? readScene(bytes) : null;
    } catch (error) {
      console.error(error);
    }
    if (this._loaded !== loaded) return; // another stock was requested meanwhile
    if (!found || found.header.refused || found.header.of !== scene.rows) {
      this.setBusy(false);
      this._refuse(found?.header.refused || this.words.solidNone);
      return;
    }
    const opened = await this._open();
    if (this._loaded !== loaded) return;
    if (opened) this._begin(found, scene);
    else {
      this.setBusy(false);
      this._refuse(this.words.solidNoWebgl);
    }
  }

  /** Load three.js and open the picture; return whether the browser has WebGL. */
  async _open() {
    const { THREE } = await import("nicegui-scene");
    try {
      this.view ??= new SolidView(THREE, this.picture);
    } catch {
      return false; // three.js has written the reason to the console
    }
    return true;
  }

  /** Show why there is no stock; "" if there is one.
   * @param {string} line */
  _refuse(line) {
    this.reason.hidden = !line;
    this.reason.textContent = line ? `${this.words.solidRefused}: ${line}` : "";
    this.bar.inert = this.over.inert = Boolean(line);
  }

  _forget() {
    this.worker?.terminate();
    this.worker = this.stock = this.scene = this.blocks = this._loaded = null;
    this.marks.forget();
    this.wake();
  }

  /** @param {any} found @param {ToolpathScene} scene */
  _begin(found, scene) {
    const { header } = found, { grid } = header, cells = grid.rows * grid.columns;
    this.scene = scene;
    this.blocks = found;
    this.header = header;
    this.stock = {
      grid, floor: header.floor, top: header.top, heights: startOf(header, found),
      by: new Uint32Array(cells), tint: new Uint8Array(cells),
    };
    let low = header.top;
    for (const height of found.start ?? []) if (height > header.floor) low = Math.min(low, height);
    for (let k = 2; k < found.move.length; k += 3) low = Math.min(low, found.move[k]);
    this.bottom = Math.max(low, header.floor);
    const { x0, y0, x1, y1 } = sectioned(grid, { axis: "", share: 0 }, this.camera);
    this.box = [x0, y0, header.floor, x1, y1, header.top];
    const place = JSON.stringify([this.box, header.origin]);
    if (place !== this._place) this.camera.fit(this.box); // otherwise keep the view for the other program
    this._place = place;
    this.view?.begin(this.stock, found.move);
    this._retone(this.stock, scene);
    this.cutOpen(this.section.axis, this.section.share); // updates its description
    this.marks.take();
    const worker = (this.worker = new Worker(new URL("./solid_worker.js", import.meta.url), { type: "module" }));
    worker.onmessage = ({ data }) => this._hear(worker, data);
    worker.onerror = (event) => this._refuse(event.message || "Worker");
    const { kind: _kind, header: _header, ...blocks } = found;
    worker.postMessage({ load: { header, blocks } });
    this.setTime(this.drawing.player.time);
  }

  /** Show the state at a time in seconds; null is the end.
   * @param {number | null} time */
  setTime(time) {
    const to = time ?? Infinity;
    this.time = to;
    this.wake();
    if (!this.worker) return;
    this.turn += 1;
    this.worker.postMessage({ time: to, turn: this.turn });
    clearTimeout(this._late);
    this._late = setTimeout(() => this.setBusy(this.told !== this.turn), 250);
  }

  /** @param {Worker} worker @param {{ found: Change | null, there: boolean, turn: number, done: number }} report */
  _hear(worker, { found, there, turn, done }) {
    if (worker !== this.worker || !this.stock) return;
    if (found) this._change(this.stock, found);
    if (there) this.told = turn;
    this.cut = done;
    if (this.ready) this.setBusy(false);
    worker.postMessage({ heard: true });
    this.wake();
  }

  /** Whether the shown state is the one requested last. */
  get ready() { return Boolean(this.stock) && this.told === this.turn; }

  /** @param {Stock} stock @param {Change} change */
  _change(stock, { rect, heights, by }) {
    const [c0, r0, c1, r1] = rect, { columns } = stock.grid, width = c1 - c0;
    for (let row = r0; row < r1; row++) {
      const to = row * columns + c0, from = (row - r0) * width;
      stock.heights.set(heights.subarray(from, from + width), to);
      for (let k = 0; k < width; k++) {
        const move = by[from + k];
        stock.by[to + k] = move;
        stock.tint[to + k] = this._toneOf(to + k, move);
      }
    }
    this.view?.paint(this._paint, rect);
  }

  /** @param {Stock} stock @param {ToolpathScene} scene */
  _retone({ by, tint }, scene) {
    const { tones, most } = tonesOf(this.colouring, this.blocks, scene);
    this.tones = tones;
    for (let k = 0; k < by.length; k++) tint[k] = this._toneOf(k, by[k]);
    this._scale(most);
    this._repaint();
  }

  get _paint() { return { colours: paletteOf(this.colouring, this.dark), byHeight: this.colouring === "depth", bottom: this.bottom }; }

  /** Draw everything in the colours of the colouring and the theme. */
  _repaint() {
    const { view, theme, blocks } = this;
    if (!view || !theme || !blocks) return;
    const [rapid, feed] = [theme.rapid, theme.cut].map((colour) => rgbOf(colour).reduce((all, part) => all << 8 | part));
    view.paint(this._paint);
    view.paintPath(blocks.rapid, rapid, feed);
  }

  /** Return the tone of a cell by the move that cut it last; 0: uncut.
   * @param {number} cell @param {number} move */
  _toneOf(cell, move) {
    if (this.blocks.held?.[cell]) return FIXTURE;
    const differs = this.colouring === "metal" ? this.blocks.differs?.[cell] : 0;
    return differs ? (differs === 1 ? MORE : LESS) : move ? this.tones[move] : 0;
  }

  // Controls.

  /** @param {typeof SIDES[number]} from */
  look(from) {
    this.camera.look(from);
    this.wake();
  }

  fit() {
    if (this.box) this.camera.fit(this.box);
    this.wake();
  }

  /** @param {number} factor */
  zoom(factor) {
    this.camera.zoom(factor);
    this.wake();
  }

  /** @param {string} name */
  colour(name) {
    this.colouring = this.colours.value = name;
    if (this.stock && this.scene) this._retone(this.stock, this.scene);
    this.wake();
  }

  /** Show a section across "x" or "y" at a fraction of the length; "" closes it.
   * @param {string} axis @param {number} share */
  cutOpen(axis, share) {
    this.section = { axis, share };
    this.axis.value = axis;
    this.plane.hidden = !axis;
    this.plane.value = String(Math.round(1000 * share));
    if (axis && this.box) {
      const k = axis === "x" ? 0 : 1, at = this.box[k] + share * (this.box[k + 3] - this.box[k]) + this.header.origin[k];
      this.plane.setAttribute("aria-valuetext", `${axis.toUpperCase()} ${mm(at)}`);
    }
    this.wake();
  }

  /** Show or hide the "tool" or the "path".
   * @param {string} name @param {boolean} shown */
  show(name, shown) {
    this.shows[name] = shown;
    this.toggles[name].setAttribute("aria-pressed", String(shown));
    this.wake();
  }

  /** Restore the view of the previous page (solid_kept.js).
   * @param {NonNullable<ReturnType<typeof import("./solid_kept.js").readKept>>} kept */
  restore({ colouring, axis, share, tool, path }) {
    this.show("tool", tool);
    this.show("path", path);
    this.colour(colouring);
    this.cutOpen(axis, share);
  }

  /** @param {boolean} busy */
  setBusy(busy) {
    this.busy.hidden = !busy;
    this.frame.setAttribute("aria-busy", String(busy));
  }

  /** Show the colour scale; `most` is the highest feed, mm/s.
   * @param {number} most */
  _scale(most) {
    const { words, legend, colouring, scale } = this;
    legend.hidden = colouring === "metal";
    if (legend.hidden) return;
    scale.name.textContent = words[`scale_${colouring}`];
    scale.ramp.style.background = scaleCss(colouring);
    [scale.low.textContent, scale.high.textContent] = {
      depth: ["0 mm", `${+(this.bottom - this.header.top).toFixed(2)} mm`], engagement: ["0 %", "100 %"],
      feed: ["0", `${Math.round(60 * most).toLocaleString("en")} mm/min`],
    }[colouring] ?? ["", ""];
  }

  // Drawing.

  resize() {
    const box = this.frame.getBoundingClientRect();
    if (this.host.hidden || !box.width) return;
    this.ratio = Math.min(window.devicePixelRatio || 1, 3);
    this.camera.resize(box.width, box.height);
    this.over.width = Math.round(box.width * this.ratio);
    this.over.height = Math.round(box.height * this.ratio);
    this.wake();
  }

  /** @param {Colours} colours */
  restyle(colours) {
    this.theme = colours;
    this.dark = isDark(colours.card);
    this._repaint();
    this.wake();
  }

  wake() {
    this.moved = performance.now();
    this._again();
  }

  _again() {
    if (this._request || this.host.hidden) return;
    this._request = requestAnimationFrame(() => {
      this._request = 0;
      this._draw();
    });
  }

  _draw() {
    const { stock, theme, view } = this;
    if (this.host.hidden || !theme) return;
    this.picture.hidden = !stock;
    this.ctx.setTransform(1, 0, 0, 1, 0, 0);
    this.ctx.clearRect(0, 0, this.over.width, this.over.height);
    if (!stock || !view) return;
    view.draw(this.camera, {
      ratio: this.ratio, section: this.section, sectionColour: sectionColour(this.dark), tool: this._tool(), path: this.shows.path ? this.cut : 0,
      moves: performance.now() - this.moved < REST,
    });
    this._overlay(theme);
    clearTimeout(this._resting);
    if (view.software && performance.now() - this.moved < REST) this._resting = setTimeout(() => this._again(), REST);
  }

  /** Return the current tool, or null: its position, its shape, and its sections from the top down.
   * @returns {Tool | null} */
  _tool() {
    const { scene, header } = this;
    if (!this.shows.tool || !Number.isFinite(this.time) || !scene) return null;
    const at = scene.at(Math.min(this.time, scene.duration)), known = header.tools[scene.tool[at.row]];
    if (!known || !Number.isFinite(at.x + at.y + at.z)) return null;
    const { shape, length } = known, radius = shape[0], point = shape[5] > 0 || shape[2] > 0 ? surface(shape, radius) : 0;
    const cuts = Math.max(length, point), parts = partsOf(known, point, cuts);
    return { x: at.x - header.origin[0], y: at.y - header.origin[1], z: at.z, shape, point, parts };
  }

  /** @param {Colours} theme */
  _overlay(theme) {
    const { ctx, ratio, camera } = this;
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.marks.draw(ctx, camera, theme);
    axes(ctx, camera, theme);
  }

  /** Return the point of the stock under a pixel, with the line that cut it last (0: none), or null.
   * @param {number} px @param {number} py @returns {SolidPlace | null} */
  placeAt(px, py) {
    const { stock, camera, blocks, scene } = this;
    if (!stock || !scene) return null;
    const found = meet(camera, stock, sectioned(stock.grid, this.section, camera), px, py);
    if (!found) return null;
    const move = stock.by[found.row * stock.grid.columns + found.column], row = move ? blocks.row[move - 1] : -1;
    return { x: found.x, y: found.y, z: found.z, path: row, line: row < 0 ? 0 : scene.line[row] };
  }

  destroy() {
    this.view?.destroy();
    clearTimeout(this._resting);
    clearTimeout(this._late);
    this.worker?.terminate();
    cancelAnimationFrame(this._request);
  }
}

/** Return the cylinders of a tool from the top down. Unknown parts above the flutes are as wide as the flutes.
 * @param {any} known @param {number} point @param {number} cuts */
function partsOf({ shape, bodies }, point, cuts) {
  const radius = shape[0], parts = /** @type {ToolPart[]} */ ([[point, cuts, radius, TOOL.cuts]]);
  const above = bodies?.length ? bodies : [["shank", cuts, radius]];
  for (const [kind, low, wide] of above) {
    const last = parts[parts.length - 1];
    if (parts.length === 1 && low > cuts + 1e-6) parts.push([cuts, low, radius, TOOL.shank]);
    else last[1] = Math.max(low, last[0]);
    parts.push([low, low + (kind === "holder" ? 1.2 : 2) * wide, wide, kind === "holder" ? TOOL.holder : TOOL.shank]);
  }
  return parts.reverse();
}

/** Draw the directions of the axes at the lower left.
 * @param {Context} ctx @param {SolidCamera} camera @param {Colours} theme */
function axes(ctx, camera, theme) {
  const x = 46, y = camera.height_px - 78, // the readout is below
    { right, ahead, sin, cos } = camera.axes, long = 26;
  const ends = /** @type {[string, number, number, string][]} */ ([
    ["X", right[0], ahead[0] * sin, theme.bad], ["Y", right[1], ahead[1] * sin, theme.accent], ["Z", 0, cos, theme.rapid],
  ]);
  ctx.font = "600 11px system-ui, sans-serif";
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  for (const [name, dx, dy, colour] of ends) {
    if (Math.hypot(dx, dy) < 0.08) continue;
    ctx.strokeStyle = ctx.fillStyle = colour;
    ctx.lineWidth = 2;
    ctx.beginPath();
    ctx.moveTo(x, y);
    ctx.lineTo(x + dx * long, y - dy * long);
    ctx.stroke();
    ctx.fillText(name, x + dx * (long + 10), y - dy * (long + 10));
  }
}
