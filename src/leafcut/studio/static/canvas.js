// Drawing of the studio: parts and toolpaths with pan, zoom, hover, selection and playback.
//
//   const drawing = new Drawing(host, { words });
//   drawing.show(await (await fetch(url)).arrayBuffer(), "after");
//   drawing.on("select", ({ row, line, hole }) => …);
//
// Layers of `show`: whole, part, before, after, pheromone, live, differences, solid_before, solid_after. Events of
// `on`: hover, select, time, drag, mode, layers, and main for a new toolpath or program to select in.

import { boxAround } from "./boxes.js";
import { describe, xy } from "./describe.js";
import { droppedOn, grab } from "./dragging.js";
import { make } from "./icons.js";
import { listenToPane } from "./input.js";
import { Measure } from "./measure.js";
import { Pane, Track } from "./pane.js";
import { PartPaths } from "./paths.js";
import { Placement } from "./placement.js";
import { Player } from "./player.js";
import { readScene } from "./scene.js";
import { Solid } from "./solid.js";
import { SPACES, keep, readKept } from "./solid_kept.js";
import { coloursOf, watchTheme } from "./theme.js";
import { MODES, Toolbar } from "./toolbar.js";
import { View } from "./view.js";
import { WholePaths, layersOf } from "./whole.js";

/** @import { Point } from "./boxes.js" */
/** @import { Picked } from "./describe.js" */
/** @import { PlacementSettings } from "./placement.js" */
/** @import { DifferenceScene, PartScene, PathScene, PheromoneScene } from "./scene.js" */
/** @import { Store } from "./solid_kept.js" */
/** @typedef {"before" | "after"} Which */
/** Actual position of the machine, mm: whether it cuts, and the next position.
 * @typedef {{ x: number, y: number, cuts?: boolean, next?: Point | null }} MachinePlace */
/** @typedef {{
 *   whole: PartScene | null, part: PartScene | null, before: unknown, after: unknown,
 *   pheromone: PheromoneScene | null, live: PathScene | null, differences: DifferenceScene | null,
 * }} Scenes */

const NUMBER_ROOM = 18; // width in pixels for a number beside the rightmost stop

// Readout, pixels: left and bottom margin, minimum width, and minimum distance to the pointer.
const ROOM_LEFT = 56, ROOM_BELOW = 32, ROOM_LEAST = 200, ROOM_BESIDE = 44;

/** Toolpaths that can be compared. */
const BOTH = /** @type {Which[]} */ (["before", "after"]);
/** Return for which toolpath a layer is the stock; undefined for another layer.
 * @param {string} layer */
function solidOf(layer) { return BOTH.find((which) => layer === `solid_${which}`); }

export class Drawing {
  /** `storage` keeps the selected view of the stock across pages, such as localStorage; null for none.
   * @param {HTMLElement} host @param {{ words: Words, layers?: Record<string, boolean>, storage?: Store }} settings */
  constructor(host, { words, layers = {}, storage = null }) {
    this.words = words;
    this.view = new View();
    /** @type {Record<string, boolean>} */
    this.layers = {
      rapids: true, cuts: true, holes: true, numbers: true, arrows: true, extents: false, issues: true, pheromone: true,
      kerf: true, cleared: true, grid: true, whole: true, travel: true, origin: true, differences: true, ...layers,
    };
    this.editable = false;
    /** @type {Picked | null} */
    this.selected = null;
    /** @type {MachinePlace | null} */
    this.tool = null;
    /** Names of the drawing's own layers that are hidden.
     * @type {Set<string>} */
    this.hidden = new Set();
    /** @type {Scenes} */
    this.scenes = { whole: null, part: null, before: null, after: null, pheromone: null, live: null, differences: null };
    /** @type {PartPaths | null} */
    this.partPaths = null;
    /** @type {WholePaths | null} */
    this.wholePaths = null;
    /** @type {Record<Which, Track | null>} */
    this.tracks = { before: null, after: null };
    this.mode = "after";
    /** Mode that the user chose. @type {string | null} */
    this._chosen = null;
    /** Offset of program zero after a drag, until the drawing is read again, mm. @type {Point | null} */
    this._moved = null;
    /** Toolpaths of the last event `main`. @type {(Track | null)[]} */
    this._told = [];
    /** Pointer position to describe in the next frame. @type {{ pane: Pane, px: number, py: number } | null} */
    this._pointing = null;
    this._request = 0;
    const kept = readKept(storage);
    this.space = kept?.space ?? "plan";
    this._storage = storage;
    /** @type {Map<string, Set<(detail: any) => void>>} */
    this._listeners = new Map();
    this.measure = new Measure(this);
    this.placement = new Placement(this);
    this.root = make("div", "lc-drawing");
    this.stage = make("div", "lc-stage");
    this.readout = make("div", "lc-readout", { role: "status", "aria-live": "polite" });
    this.empty = make("div", "lc-empty", {}, words.empty);
    const bar = make("div", "lc-bar");
    this.root.append(bar, this.stage);
    host.append(this.root);
    this.panes = BOTH.map((which) => {
      const box = make("div", "lc-pane"), pane = new Pane(box, this, `${words.drawing}: ${words[which]}`, words[which]);
      this.stage.append(box);
      listenToPane(pane, this);
      return pane;
    });
    this.solid = new Solid(this.stage, this);
    this.legend = make("div", "lc-caption lc-legend", {}, make("i", "lc-swatch lc-before"), words.before, make("i", "lc-swatch lc-rapids"), words.after);
    this.stage.append(this.empty, this.legend, this.readout);
    this.toolbar = new Toolbar(bar, this);
    this.player = new Player(this.root, words, (detail) => this._time(detail), () => this._wake());
    if (kept) this.solid.restore(kept);
    this.view.addEventListener("change", () => {
      if (this.measure.on && this.measure.byKey) this.measure.aim();
      this._wake();
    });
    this._endTheme = watchTheme(() => this._restyle());
    this._observer = new ResizeObserver(() => this._resize());
    this._observer.observe(this.stage);
    this._restyle();
    this._arrange();
  }

  /** Call `act` for every event `name`; return a function that unsubscribes.
   * @param {string} name @param {(detail: any) => void} act */
  on(name, act) {
    const all = this._listeners.get(name) ?? new Set();
    this._listeners.set(name, all.add(act));
    return () => all.delete(act);
  }

  /** @param {string} name @param {any} detail */
  emit(name, detail) { [...(this._listeners.get(name) ?? [])].forEach((act) => act(detail)); }

  /** Show a scene in a layer.
   * @param {ArrayBuffer} bytes @param {string} layer */
  show(bytes, layer) {
    const solid = solidOf(layer);
    if (solid) {
      this.offerSolid(solid, async () => bytes);
      return;
    }
    const scene = readScene(bytes), first = !this.shows, which = BOTH.find((name) => name === layer);
    if (this._renew(scene, layer)) return;
    this.scenes[/** @type {keyof Scenes} */ (layer)] = scene;
    if (layer === "part") {
      if (this._moved && !first) {
        this.view.x -= this._moved[0];
        this.view.y -= this._moved[1];
      }
      this._moved = null;
      this.partPaths = new PartPaths(scene, this.hidden);
    }
    if (layer === "whole") this.wholePaths = new WholePaths(scene);
    if (which) {
      scene.header.which = layer;
      this.tracks[which] = new Track(scene);
      this.selected = null;
      if (which === "after" || !this.tracks[/** @type {Which} */ (this.mode)]) this.mode = this._chosen ?? which;
    }
    this._arrange();
    if (first || this.view.fitted) this.fit();
  }

  /** Set the function that loads the stock and its moves, "before" or "after", when it becomes visible. Null removes
   * the stock.
   * @param {Which} which @param {(() => Promise<ArrayBuffer | null>) | null} load */
  offerSolid(which, load) {
    this.solid.offer(which, load);
    this._arrange();
  }

  /** Show the "plan", the "solid", or "both".
   * @param {string} space */
  setSpace(space) {
    if (!SPACES.includes(space)) return;
    this.space = space;
    if (this.measure.on) this.measure.toggle(false);
    if (this.solid.marks.on) this.solid.marks.measure(false);
    this._arrange();
    if (this.view.fitted) this.view.fit(this._extents(), this._insets());
    this.keepView();
    this.emit("space", { space });
  }

  /** Store the view of the stock for the next page. */
  keepView() { keep(this._storage, this); }

  /** Update a layer that changes during a search; return whether the scene belongs to such a layer.
   * @param {any} scene @param {string} layer */
  _renew(scene, layer) {
    const name = /** @type {keyof Scenes} */ (layer);
    if (!this.scenes[name] || !["path", "pheromone"].includes(scene.kind)) return false;
    this.scenes[name] = scene;
    this.panes.forEach((pane) => {
      if (layer === "live") pane.setLive(scene);
      else pane.setPheromone(this.scenes.pheromone);
      if (layer === "live" && pane.hovered?.stop) this.say(describe(pane.hovered, pane, this.words)); // the number of the stop has changed
    });
    this._wake();
    return true;
  }

  /** Remove all layers, or one. */
  clear(layer = "") {
    const solid = solidOf(layer);
    if (solid) {
      this.offerSolid(solid, null);
      return;
    }
    if (!layer) for (const which of BOTH) this.solid.offer(which, null);
    for (const name of /** @type {(keyof Scenes)[]} */ (layer ? [layer] : Object.keys(this.scenes))) {
      this.scenes[name] = null;
      if (name === "before" || name === "after") this.tracks[name] = null;
      if (name === "part") this.partPaths = null;
      if (name === "whole") this.wholePaths = null;
    }
    this.selected = null;
    if (!layer) this._chosen = null;
    this._arrange();
  }

  fit() {
    this.view.fit(this._extents(), this._insets());
    this.solid.fit();
  }

  /** Zoom the visible views.
   * @param {number} factor */
  zoom(factor) {
    if (this.sees !== "solid") this.view.zoom(factor);
    if (this.sees !== "plan") this.solid.zoom(factor);
  }

  /** Start or stop measuring, on the stock if it is visible, else in the plan. */
  toggleMeasure() {
    if (this.sees === "plan") this.measure.toggle(); else this.solid.marks.measure();
    this.toolbar.update();
  }

  /** Current view: "plan", "solid", or "both". */
  get sees() { return this.solid.offered ? this.space : "plan"; }

  /** Return whether a mode is available in the current view; the stock shows one toolpath at a time.
   * @param {string} mode */
  offers(mode) { return this.modes.includes(mode) && (this.sees !== "solid" || mode === "before" || mode === "after"); }

  /** Mode of the toolpaths in the current view. */
  get seenMode() { return this.offers(this.mode) ? this.mode : "after"; }

  /** @param {string} mode */
  setMode(mode) {
    if (!this.modes.includes(mode)) return;
    this.mode = this._chosen = mode;
    this._arrange();
    if (this.view.fitted) this.fit();
    this.emit("mode", { mode });
  }

  /** Switch to the next mode: before, after, side by side, overlaid. */
  nextMode() {
    const modes = MODES.filter((mode) => this.offers(mode));
    if (modes.length) this.setMode(modes[(modes.indexOf(this.seenMode) + 1) % modes.length]);
  }

  /** @param {Record<string, boolean>} changes */
  setLayers(changes) {
    Object.assign(this.layers, changes);
    this.panes.forEach((pane) => pane.invalidate());
    this.toolbar.update();
    this._wake();
    this.emit("layers", { ...this.layers });
  }

  /** Names of the drawing's own layers. */
  get drawnLayers() { return layersOf(this.scenes.whole, this.scenes.part); }

  /** Show or hide a layer of the drawing.
   * @param {string} name @param {boolean} shown */
  showDrawnLayer(name, shown) {
    if (shown) this.hidden.delete(name); else this.hidden.add(name);
    if (this.scenes.part) this.partPaths = new PartPaths(this.scenes.part, this.hidden);
    this._givePart();
    this.toolbar.update();
    this._wake();
  }

  _givePart() {
    for (const pane of this.panes) pane.setPart(this.partPaths, this.wholePaths, this.drawnLayers);
  }

  /** Show the state at a machine time, s; null shows the whole toolpath.
   * @param {number | null} seconds */
  seek(seconds) { if (seconds === null) this.player.showAll(); else this.player.seek(seconds); }

  /** Select a row of the toolpath and pan to it; null clears the selection.
   * @param {number | null} row */
  select(row) {
    const scene = this.main?.scene;
    if (!scene || row === null || row < 0 || row >= scene.rows) {
      this._choose(null);
      this.say([]);
      return;
    }
    this.view.show(scene.x1(row) + scene.origin[0], scene.y1(row) + scene.origin[1]);
    this._choose({ row, which: scene.header.which });
  }

  /** Show the actual position of the machine; null hides it.
   * @param {MachinePlace | null} place */
  setTool(place) {
    this.tool = place;
    this._redraw();
  }

  /** Select the moves of a program line.
   * @param {number} line */
  selectLine(line) { this.select(this.main?.scene.rowOfLine(line) ?? -1); }

  /** Select a difference of two programs by index and pan to it; return whether it has a position.
   * @param {number} index */
  selectDifference(index) {
    const { differences } = this.scenes, mark = differences?.markOf(index) ?? -1;
    if (!differences || mark < 0) return false;
    const { x, y } = differences.at(mark);
    this.view.show(x, y);
    this._choose(this.panes[1].differing(mark));
    return true;
  }

  /** Emphasize the shapes of a layer, without an event; null emphasizes none.
   * @param {string | null} layer */
  selectLayer(layer) { this._choose(layer === null ? null : { layer }, true); }

  /** Select a stop of the edited order by its number in the toolpath, from 1, and pan to it, without an event.
   * @param {number} stop */
  selectStop(stop) {
    const { main } = this, { edited } = this.panes[1], k = edited ? edited.indexOf(stop) : -1;
    if (!main || !edited || k < 0) return;
    this.view.show(edited.x1(k) + edited.origin[0], edited.y1(k) + edited.origin[1]);
    this._choose({ row: main.scene.stop[stop - 1], which: main.scene.header.which, stop }, true);
  }

  /** The toolpath for numbers, playback and selection. */
  get main() {
    const { before, after } = this.tracks;
    return this.mode === "before" ? before ?? after : after ?? before;
  }

  destroy() {
    this._observer.disconnect();
    this._endTheme();
    this.solid.destroy();
    cancelAnimationFrame(this._request);
    this._request = -1;
    this.root.remove();
  }

  /** Set the placement of the part: whether program zero can be moved, and the travel of the machine.
   * @param {PlacementSettings} placement */
  setPlacement(placement) {
    this.placement.set(placement);
    this.toolbar.update();
    this._redraw();
  }

  /** Show the measurement as text and in the drawing.
   * @param {string[]} parts @param {boolean} quiet */
  tellMeasure(parts, quiet) {
    this.say(parts, quiet);
    if (!quiet) this.toolbar.update();
    this._redraw();
  }

  /** Draw what is not cached again. */
  _redraw() {
    for (const pane of this.panes) pane.dirty = true;
    this._wake();
  }

  /** Whether anything is shown; whether it is a map without millimetres; the unit of its lengths. */
  get shows() { return Object.values(this.scenes).some(Boolean); }
  get unit() { return this.unitless ? "" : "mm"; }
  get unitless() { return [this.scenes.part, this.main?.scene].some((scene) => scene?.header.unitless); }

  // Pointer and keys.

  /** Handle a pointer position: describe the object there, at most once per frame.
   * @param {Pane} pane @param {number} px @param {number} py */
  point(pane, px, py) {
    pane.canvas.classList.toggle("lc-grab", !this.measure.on && this.placement.over(px, py));
    if (this.measure.on) {
      this.measure.move(px, py);
      return;
    }
    this._pointing = { pane, px, py };
    this._wake();
  }

  /** Mark and describe an object; null: none.
   * @param {Pane} pane @param {Picked | null} what */
  hover(pane, what, px = 0, py = 0) {
    this._pointing = null;
    if (this.measure.on) return;
    const same = JSON.stringify(what) === JSON.stringify(pane.hovered);
    pane.hovered = what;
    pane.dirty = true;
    if (what) this.say(describe(what, pane, this.words));
    else if (px || py) this.say([xy(this.view.mmX(px), this.view.mmY(py))], true);
    else this.say([]);
    this._makeRoom(pane, px, py);
    if (!same) this.emit("hover", what && { ...what, words: this.readout.textContent });
    this._wake();
  }

  /** Select the object at a pointer position, or take it as a point of the measurement.
   * @param {Pane} pane @param {number} px @param {number} py */
  choose(pane, px, py) {
    pane.canvas.focus({ preventScroll: true });
    if (this.measure.on) {
      this.measure.move(px, py);
      this.measure.take();
    } else this._choose(pane.pick(px, py) ?? pane.layerAt(px, py));
  }

  /** @param {Picked | null} what */
  _choose(what, silent = false) {
    this.selected = what;
    if (what) this.say(describe(what, this.panes.find((pane) => pane.main && pane.which === what.which) ?? this.panes[1], this.words));
    if (!silent) this.emit("select", what && this._placed(what));
    this._redraw();
  }

  /** Add the program line and the stop to a picked object; 0 for none.
   * @param {Picked} what */
  _placed(what) {
    const { row, which, line = 0, stop } = what, scene = this.tracks[/** @type {Which} */ (which)]?.scene;
    if (row === undefined || !scene) return { ...what, line, stop: stop ?? 0 };
    return { ...what, line: scene.line[row], stop: stop ?? scene.stopOf(row) };
  }

  /** Cancel dragging, or else playback, or else the selection; return whether anything was cancelled. */
  escape() {
    if (this.measure.on) this.measure.toggle(false);
    else if (this.panes.some((pane) => pane.drag)) this.panes.forEach((pane) => this.drop(pane, true));
    else if (this.player.time !== null) this.player.showAll();
    else if (this.selected) this._choose(null);
    else return false;
    return true;
  }

  /** @param {Pane} pane @param {number} px @param {number} py */
  grab(pane, px, py) { pane.drag = grab(this, pane, px, py); }

  /** @param {Pane} pane @param {number} px @param {number} py */
  dragTo(pane, px, py) {
    if (!pane.drag) return;
    this._makeRoom(pane, px, py);
    pane.drag.to = pane.drag.what === "origin" ? this.placement.dragTo(px, py) : [this.view.mmX(px), this.view.mmY(py)];
    pane.dirty = true;
    this._wake();
  }

  /** End dragging and report the target.
   * @param {Pane} pane @param {boolean} cancelled */
  drop(pane, cancelled) {
    const { drag } = pane;
    pane.drag = null;
    pane.dirty = true;
    this._wake();
    if (drag?.what === "origin") {
      const to = this.placement.drop(cancelled);
      this._moved = to; // the dragged zero keeps its screen position when the drawing is read again
      if (to) this.emit("origin", { x: to[0], y: to[1] });
    } else if (drag && !cancelled) this.emit("drag", { ...drag, onto: droppedOn(this, pane, drag), which: pane.which });
  }

  // Content.

  /** Available modes: a single toolpath, or several for two toolpaths.
   * @returns {string[]} */
  get modes() {
    const { before, after } = this.tracks;
    if (this.scenes.live?.edited && after) return ["after"]; // the order edited by hand belongs to this toolpath
    return before && after ? MODES : before ? ["before"] : ["after"];
  }

  /** Assign toolpaths and part to the panes. */
  _arrange() {
    if (!this.modes.includes(this.mode)) this.mode = this.modes[0];
    const { before, after } = this.tracks, [left, right] = this.panes, side = this.mode === "side";
    const seen = this.sees;
    left.host.hidden = !side || seen !== "plan";
    right.host.hidden = seen === "solid";
    this.solid.host.hidden = seen === "plan";
    this._givePart();
    for (const pane of this.panes) {
      pane.setPheromone(this.scenes.pheromone);
      pane.setLive(this.scenes.live);
      pane.setDifferences(this.scenes.differences);
      pane.caption.hidden = !side;
    }
    this.measure.renew();
    this.legend.hidden = this.mode !== "overlay" || seen === "solid";
    this.say([]);
    const { main } = this, overlay = this.mode === "overlay";
    if (before) before.pale = overlay;
    left.setTracks(side && before ? [before] : [], side ? before : null);
    right.setTracks([overlay ? before : null, main].filter((track) => track !== null), main);
    const durations = [main, side ? before : null].map((track) => track?.scene.duration ?? 0);
    this.player.setScene(main?.scene ?? null, Math.max(...durations));
    const told = [main, after];
    if (told.some((track, k) => track !== (this._told[k] ?? null))) this.emit("main", {});
    this._told = told;
    this.empty.hidden = this.shows;
    this.toolbar.update();
    this._resize();
    this.solid.follow();
    this._wake();
  }

  _extents() { return boxAround(this.panes.map((pane) => pane.extents)); }

  /** Return the insets for rulers and captions at the left, top, right and bottom, pixels. */
  _insets() {
    const top = this.mode === "side" || this.mode === "overlay" ? 30 : 0;
    const right = this.layers.numbers && this.main?.scene.stop.length ? NUMBER_ROOM : 0;
    return this.layers.grid ? [46, top, right, 22] : [0, top, right, 0];
  }

  _resize() {
    const shown = this.panes.filter((pane) => !pane.host.hidden);
    const sizes = shown.map((pane) => pane.resize());
    this.view.resize(...(sizes.at(-1) ?? [this.view.width, this.view.height]));
    this.solid.resize();
    // Messages appear below the buttons, whose number of rows varies.
    const { top, height } = this.stage.getBoundingClientRect();
    if (height > 0) document.documentElement.style.setProperty("--drawing-top", `${top}px`);
    this._wake();
  }

  _restyle() {
    const colours = coloursOf(this.root);
    for (const view of [...this.panes, this.solid]) view.restyle(colours);
    this._wake();
  }

  /** @param {import("./player.js").PlayedTime} detail */
  _time(detail) {
    this.panes.forEach((pane) => pane.setTime(detail.time));
    this.solid.setTime(detail.time);
    this._wake();
    this.emit("time", detail);
  }

  /** Show the parts of a description in the readout; a screen reader does not read a `quiet` one.
   * @param {string[]} parts */
  say(parts, quiet = false) {
    this.readout.hidden = !parts.length;
    this.readout.setAttribute("aria-live", quiet ? "off" : "polite");
    const spans = parts.map((part, k) => make("span", k || quiet ? "" : "lc-name", {}, part));
    this.readout.replaceChildren(...spans.flatMap((span, k) => (k ? [" · ", span] : [span])));
  }

  /** Move the readout to the top while it would cover the pointer at the bottom.
   * @param {Pane} pane @param {number} px @param {number} py */
  _makeRoom(pane, px, py) {
    const stage = this.stage.getBoundingClientRect(), box = pane.canvas.getBoundingClientRect(), { readout } = this;
    const right = ROOM_LEFT + Math.max(readout.offsetWidth, ROOM_LEAST), low = stage.height - ROOM_BELOW - readout.offsetHeight;
    const over = box.left - stage.left + px < right + ROOM_BESIDE && box.top - stage.top + py > low - ROOM_BESIDE;
    readout.classList.toggle("lc-above", over);
  }

  _wake() {
    if (this._request) return;
    this._request = requestAnimationFrame((now) => this._frame(now));
  }

  /** @param {number} now */
  _frame(now) {
    if (this._request === -1) return;
    this._request = 0;
    if (this._pointing) {
      const { pane, px, py } = this._pointing;
      this.hover(pane, pane.pick(px, py), px, py);
    }
    let more = this.player.tick(now);
    for (const pane of this.panes) if (!pane.host.hidden) more = pane.frame() || more;
    if (more) this._wake();
    else this.emit("settled", {});
  }
}
