// Solid view of the drawing: the stock in 3D, cut in step with the playback.
//
// A worker cuts the stock (solid_worker.js) and reports changes. During motion the resolution is reduced for a
// smooth display; at rest it is drawn once more, finer.

import { make } from "./icons.js";
import { mm } from "./describe.js";
import { readScene } from "./scene.js";
import { SolidCamera, meet, sectioned } from "./solid_camera.js";
import { COLOURINGS, FIXTURE, LESS, MORE, TOOL, paletteOf, scaleCss, sectionColour, tonesOf } from "./solid_colours.js";
import { ColumnRenderer } from "./solid_columns.js";
import { SolidInput } from "./solid_input.js";
import { SolidMarks } from "./solid_marks.js";
import { startOf } from "./solid_stock.js";
import { surface } from "./sweep.js";
import { coloursOf } from "./theme.js";

/** Maximum and minimum time of a frame during motion, ms; outside, the resolution is adapted. */
const SLOW = 42, QUICK = 18;
/** Time without change after which the view is at rest, and maximum time of a frame at rest, ms. */
const REST = 140, FINE = 450;
const COARSEST = 0.45;

export class Solid {
  constructor(host, drawing) {
    this.drawing = drawing;
    this.words = drawing.words;
    this.camera = new SolidCamera();
    this.offers = {};
    this.colouring = "metal";
    this.section = { axis: "", share: 0.5 };
    this.shows = { tool: true, path: false };
    this.stock = this.scene = this.worker = null;
    this.turn = 0; // number of the last request to the worker
    this.time = Infinity;
    this.quality = 1;
    this._build(host);
    this.marks = new SolidMarks(this);
    new SolidInput(this);
  }

  _build(host) {
    const { words } = this;
    this.host = make("div", "lc-pane lc-solid", { hidden: "" });
    this.bar = make("div", "lc-solid-bar", { role: "toolbar", "aria-label": words.solid });
    this.frame = make("div", "lc-solid-frame");
    this.over = make("canvas", "lc-over", { tabindex: "0", role: "application", "aria-label": words.solidDrawing });
    this.reason = make("p", "lc-empty lc-refused", { hidden: "" });
    this.legend = make("div", "lc-scale", { hidden: "" }, make("span"), make("i", "lc-ramp"), make("b"), make("b"));
    this.collisions = make("div", "lc-collisions", { hidden: "" });
    this.differs = make("div", "lc-differs", { hidden: "" });
    this.busy = make("div", "lc-busy", { hidden: "" }, words.solidCutting);
    this.frame.append(this.over, this.legend, this.collisions, this.differs, this.busy, this.reason);
    this._buildBar();
    this.host.append(this.bar, this.frame);
    host.append(this.host);
    this.ctx = this.over.getContext("2d");
  }

  _buildBar() {
    const { words, bar } = this;
    const looks = make("div", "lc-group", { role: "group", "aria-label": words.solidFrom });
    for (const from of ["iso", "top", "front"]) {
      const button = make("button", "lc-button", { type: "button" }, words[`solid_${from}`]);
      button.addEventListener("click", () => this.look(from));
      looks.append(button);
    }
    const chosen = (act) => (value) => {
      act(value);
      this.drawing.keepView();
    };
    this.colours = this._select("solidColour", COLOURINGS.map((name) => [name, words[`colour_${name}`]]), chosen((name) => this.colour(name)));
    this.axis = this._select("solidSection", [["", words.section_none], ["x", words.section_x], ["y", words.section_y]], chosen((axis) => this.cutOpen(axis, this.section.share)));
    this.plane = make("input", "lc-slider lc-plane", { type: "range", min: 0, max: 1000, value: 500, "aria-label": words.solidPlane, hidden: "" });
    this.plane.addEventListener("input", () => this.cutOpen(this.section.axis, this.plane.value / 1000));
    this.plane.addEventListener("change", () => this.drawing.keepView());
    this.toggles = {};
    const toggle = (name) => {
      const button = make("button", "lc-button", { type: "button", "aria-pressed": String(this.shows[name]) }, words[`solid_${name}`]);
      button.addEventListener("click", () => {
        this.show(name, !this.shows[name]);
        this.drawing.keepView();
      });
      this.toggles[name] = button;
      return button;
    };
    bar.append(
      looks, this.colours, this.axis, make("div", "lc-group", {}, toggle("tool"), toggle("path")), this.plane,
    );
  }

  _select(label, choices, act) {
    const select = make("select", "lc-select", { "aria-label": this.words[label], title: this.words[label] });
    for (const [value, words] of choices) select.append(make("option", "", { value }, words));
    select.addEventListener("change", () => act(select.value));
    return select;
  }

  // Content.

  /** Set the function that loads the stock with the moves "before" or "after"; null: no stock. */
  offer(which, load) {
    if (load) this.offers[which] = load; else delete this.offers[which];
    if (this._loaded === which) this._forget();
  }

  get offered() { return Object.keys(this.offers).length > 0; }

  /** Show the stock of the toolpath that is played, if the view is visible. */
  follow() {
    const { main } = this.drawing, which = main?.scene.header.which ?? "", seen = !this.host.hidden;
    if (!seen) return;
    if (this._loaded === which && this._of === main?.scene) return;
    this._load(which, main?.scene ?? null);
  }

  async _load(which, scene) {
    this._forget();
    this._loaded = which;
    this._of = scene;
    const offered = this.offers[which];
    this._refuse(offered ? "" : this.words.solidNone);
    if (!offered || !scene) return;
    this.setBusy(true);
    let found = null;
    try {
      const bytes = await offered();
      found = bytes?.byteLength ? readScene(bytes) : null;
    } catch (error) {
      console.error(error.message);
    }
    if (this._of !== scene || this._loaded !== which) return; // another stock was requested meanwhile
    if (!found || found.header.refused || found.header.of !== scene.rows) {
      this.setBusy(false);
      this._refuse(found?.header.refused || this.words.solidNone);
      return;
    }
    this._begin(found, scene);
  }

  _refuse(line) {
    this.reason.hidden = !line;
    this.reason.textContent = line ? `${this.words.solidRefused}: ${line}` : "";
    this.bar.inert = this.over.inert = Boolean(line);
  }

  _forget() {
    this.worker?.terminate();
    this.worker = this.stock = this.scene = this.blocks = null;
    this._loaded = this._of = undefined;
    this.marks?.forget();
    this.wake();
  }

  _begin(found, scene) {
    const { header } = found, { grid } = header, cells = grid.rows * grid.columns;
    this.scene = scene;
    this.blocks = found;
    this.header = header;
    this.stock = {
      grid, floor: header.floor, top: header.top, heights: startOf(header, found),
      by: new Uint32Array(cells), relief: new Uint32Array(cells).fill((200 << 24) >>> 0), tint: new Uint8Array(cells),
    };
    let low = header.top;
    for (const height of found.start ?? []) if (height > header.floor) low = Math.min(low, height);
    for (let k = 2; k < found.move.length; k += 3) low = Math.min(low, found.move[k]);
    this.bottom = Math.max(low, header.floor);
    const half = grid.cell / 2, box = [grid.x - half, grid.y - half, header.floor];
    this.box = [...box, box[0] + grid.columns * grid.cell, box[1] + grid.rows * grid.cell, header.top];
    const place = JSON.stringify([this.box, header.origin]);
    if (place !== this._place) this.camera.fit(this.box); // otherwise keep the view for the other program
    this._place = place;
    this._retone();
    this.cutOpen(this.section.axis, this.section.share); // updates its description
    this.marks.take();
    this.worker = new Worker(new URL("./solid_worker.js", import.meta.url), { type: "module" });
    this.worker.onmessage = ({ data }) => this._hear(data);
    this.worker.onerror = (event) => this._refuse(event.message || "Worker");
    const { kind, ...blocks } = found;
    delete blocks.header;
    this.worker.postMessage({ load: { header, blocks } });
    this.setTime(this.drawing.player.time);
  }

  /** Show the state at a time in seconds; null is the end. */
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

  _hear({ found, there, turn, done }) {
    if (found) this._change(found);
    if (there) this.told = turn;
    this.cut = done;
    if (this.ready) this.setBusy(false);
    this.worker.postMessage({ heard: true });
    this.wake();
  }

  /** Whether the shown state is the one requested last. */
  get ready() { return Boolean(this.stock) && this.told === this.turn; }

  _change({ rect: [c0, r0, c1, r1], heights, by, relief }) {
    const { stock } = this, { columns } = stock.grid, width = c1 - c0;
    for (let row = r0; row < r1; row++) {
      const to = row * columns + c0, from = (row - r0) * width;
      stock.heights.set(heights.subarray(from, from + width), to);
      stock.relief.set(relief.subarray(from, from + width), to);
      for (let k = 0; k < width; k++) {
        const move = by[from + k];
        stock.by[to + k] = move;
        stock.tint[to + k] = this._toneOf(to + k, move);
      }
    }
  }

  _retone() {
    const { tones, most } = tonesOf(this.colouring, this.blocks, this.scene), { by, tint } = this.stock;
    this.tones = tones;
    for (let k = 0; k < by.length; k++) tint[k] = this._toneOf(k, by[k]);
    this._scale(most);
  }

  /** Return the tone of a cell by the move that cut it last; 0: uncut. */
  _toneOf(cell, move) {
    if (this.blocks.held?.[cell]) return FIXTURE;
    const differs = this.colouring === "metal" ? this.blocks.differs?.[cell] : 0;
    return differs ? (differs === 1 ? MORE : LESS) : move ? this.tones[move] : 0;
  }

  // Controls.

  look(from) {
    this.camera.look(from);
    this.wake();
  }

  fit() {
    if (this.box) this.camera.fit(this.box);
    this.wake();
  }

  zoom(factor) {
    this.camera.zoom(factor);
    this.wake();
  }

  colour(name) {
    this.colouring = this.colours.value = name;
    if (this.stock) this._retone();
    this.wake();
  }

  /** Show a section across "x" or "y" at a fraction of the length; "" closes it. */
  cutOpen(axis, share) {
    this.section = { axis, share };
    this.axis.value = axis;
    this.plane.hidden = !axis;
    this.plane.value = Math.round(1000 * share);
    if (axis && this.box) {
      const k = axis === "x" ? 0 : 1, at = this.box[k] + share * (this.box[k + 3] - this.box[k]) + this.header.origin[k];
      this.plane.setAttribute("aria-valuetext", `${axis.toUpperCase()} ${mm(at)}`);
    }
    this.wake();
  }

  /** Show or hide the "tool" or the "path". */
  show(name, shown) {
    this.shows[name] = shown;
    this.toggles[name].setAttribute("aria-pressed", shown);
    this.wake();
  }

  /** Restore the view of the previous page (solid_kept.js). */
  restore({ colouring, axis, share, tool, path }) {
    this.show("tool", tool);
    this.show("path", path);
    this.colour(colouring);
    this.cutOpen(axis, share);
  }

  setBusy(busy) {
    this.busy.hidden = !busy;
    this.frame.setAttribute("aria-busy", busy);
  }

  /** Show the colour scale. */
  _scale(most) {
    const { words, legend, colouring } = this, [name, , low, high] = legend.children;
    legend.hidden = colouring === "metal";
    if (legend.hidden) return;
    const ends = { depth: ["0 mm", `${+(this.bottom - this.header.top).toFixed(2)} mm`], engagement: ["0 %", "100 %"], feed: ["0", `${Math.round(60 * most).toLocaleString("en")} mm/min`] }[colouring];
    name.textContent = words[`scale_${colouring}`];
    legend.children[1].style.background = scaleCss(colouring);
    [low.textContent, high.textContent] = ends;
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

  restyle() {
    this.theme = coloursOf(this.host);
    this.dark = brightness(this.theme.card) < 128;
    this.wake();
  }

  wake() {
    this.moved = performance.now();
    this.fine = false;
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
    if (this.host.hidden || !this.theme) return;
    if (!this.stock) {
      this.picture?.remove();
      this.picture = null;
      this.ctx.clearRect(0, 0, this.over.width, this.over.height);
      return;
    }
    if (!this.picture) {
      this.picture = make("canvas", "lc-picture");
      this.frame.prepend(this.picture);
      this.renderer = new ColumnRenderer(this.picture);
    }
    const rests = performance.now() - this.moved > REST && !this.drawing.player.playing;
    const finest = 2 * this.ratio, cost = this.frameMs ? this.frameMs / this.quality ** 2 : 0;
    const pixels = rests ? (cost ? Math.min(finest, Math.max(Math.sqrt(FINE / cost), this.quality)) : finest) : this.quality;
    const began = performance.now(), tool = this._tool();
    this.renderer.draw(this.stock, this.camera, { ...this._look(), tool }, pixels);
    this._adapt(performance.now() - began, rests);
    this._overlay();
    this.fine = rests;
    if (!rests) {
      if (this.drawing.player.playing) this._again();
      else {
        clearTimeout(this._resting);
        this._resting = setTimeout(() => this._again(), REST + 10);
      }
    }
  }

  /** Adapt the resolution to the time of the last frame. */
  _adapt(took, rests) {
    if (rests) return;
    this.frameMs = took;
    if (took > SLOW) this.quality = Math.max(this.quality * Math.max(Math.sqrt(SLOW / took), 0.6), COARSEST);
    else if (took < QUICK) this.quality = Math.min(this.quality * 1.08, this.ratio);
  }

  _look() {
    const { colouring, dark } = this;
    if (this._palette?.colouring !== colouring || this._palette.dark !== dark) {
      this._palette = { colouring, dark, colours: paletteOf(colouring, dark) };
    }
    return {
      palette: this._palette.colours, byHeight: colouring === "depth", bottom: this.bottom, ratio: this.ratio,
      section: this.section, sectionColour: sectionColour(dark),
    };
  }

  /** Return the current tool, or null: its position, its shape, and its sections from the top down. */
  _tool() {
    const { scene, header } = this;
    if (!this.shows.tool || !Number.isFinite(this.time) || !scene) return null;
    const at = scene.at(Math.min(this.time, scene.duration)), known = header.tools[scene.tool[at.row]];
    if (!known || !Number.isFinite(at.x + at.y + at.z)) return null;
    const { shape, length } = known, radius = shape[0], point = shape[5] > 0 || shape[2] > 0 ? surface(shape, radius) : 0;
    const cuts = Math.max(length, point), parts = partsOf(known, point, cuts);
    return {
      x: at.x - header.origin[0], y: at.y - header.origin[1], z: at.z, shape, point, radius, parts,
      long: parts[0][1], largest: Math.max(...parts.map((part) => part[2])),
    };
  }

  _overlay() {
    const { ctx, ratio, camera } = this;
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.clearRect(0, 0, this.over.width, this.over.height);
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (this.shows.path) this._path(ctx);
    this.marks.draw(ctx, camera, this.theme);
    axes(ctx, camera, this.theme);
  }

  /** Draw the path of the tool so far, limited to the last moves. */
  _path(ctx) {
    const { blocks, camera, theme } = this, { move, rapid } = blocks, most = 12000;
    const last = Math.min(this.cut ?? 0, blocks.row.length), first = Math.max(0, last - most);
    for (const [kind, colour, width] of [[1, theme.rapid, 0.9], [0, theme.cut, 1.1]]) {
      ctx.beginPath();
      for (let k = first; k < last; k++) {
        if (rapid[k] !== kind) continue;
        const [ax, ay] = camera.project(move[6 * k], move[6 * k + 1], move[6 * k + 2]);
        const [bx, by] = camera.project(move[6 * k + 3], move[6 * k + 4], move[6 * k + 5]);
        ctx.moveTo(ax, ay);
        ctx.lineTo(bx, by);
      }
      ctx.globalAlpha = 0.7;
      ctx.strokeStyle = colour;
      ctx.lineWidth = width;
      ctx.stroke();
      ctx.globalAlpha = 1;
    }
  }

  /** Return the point of the stock under a pixel, with the line that cut it last (0: none), or null. */
  placeAt(px, py) {
    const { stock, camera, blocks, scene } = this;
    if (!stock) return null;
    const found = meet(camera, stock, sectioned(stock.grid, this.section, camera), px, py);
    if (!found) return null;
    const move = stock.by[found.row * stock.grid.columns + found.column], row = move ? blocks.row[move - 1] : -1;
    return { ...found, move, path: row, line: row < 0 ? 0 : scene.line[row] };
  }

  destroy() {
    clearTimeout(this._resting);
    clearTimeout(this._late);
    this.worker?.terminate();
    cancelAnimationFrame(this._request);
  }
}


/** Return the sections of a tool from the top down: lower and upper end above the tip, radius, colour, fluted or not.
 * Unknown sections above the flutes are as wide as the flutes. */
function partsOf({ shape, bodies }, point, cuts) {
  const radius = shape[0], parts = [[point, cuts, radius, TOOL.cuts, true]], above = bodies?.length ? bodies : [["shank", cuts, radius]];
  for (const [kind, low, wide] of above) {
    const last = parts[parts.length - 1];
    if (parts.length === 1 && low > cuts + 1e-6) parts.push([cuts, low, radius, TOOL.shank, false]);
    else last[1] = Math.max(low, last[0]);
    parts.push([low, low + (kind === "holder" ? 1.2 : 2) * wide, wide, kind === "holder" ? TOOL.holder : TOOL.shank, false]);
  }
  return parts.reverse();
}

/** Draw the directions of the axes at the lower left. */
function axes(ctx, camera, theme) {
  const x = 46, y = camera.height_px - 78, // the readout is below
    { right, ahead, sin, cos } = camera.axes, long = 26;
  const ends = [["X", right[0], ahead[0] * sin, theme.bad], ["Y", right[1], ahead[1] * sin, theme.accent], ["Z", 0, cos, theme.rapid]];
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

function brightness(colour) {
  const [r, g, b] = [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16));
  return 0.3 * r + 0.59 * g + 0.11 * b;
}
