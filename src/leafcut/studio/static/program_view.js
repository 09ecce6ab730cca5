// Program view: the list of lines with search, go to line, folding, and the original beside it.
//
//   const view = new ProgramView(host, { words });
//   view.show(scene);        // format: studio/drawing/program_text.py; without it, the drawing's program
//   view.link(drawing);

import { iconButton, make, selection } from "./icons.js";
import { Lines, link } from "./lines.js";
import { foldsOf } from "./program_folds.js";
import { Moves } from "./program_moves.js";

/** @import { Drawing } from "./canvas.js" */
/** @import { Picked } from "./describe.js" */
/** A list of lines with its element and heading. @typedef {Lines & { box: HTMLElement, head: HTMLElement }} Column */
/** Program with its original and the pairs of their lines (studio/drawing/program_text.py).
 * @typedef {{
 *   header: { beside?: boolean }, text: Uint8Array, other: Uint8Array, pair: Uint32Array, missing: Uint32Array,
 *   added: Uint32Array,
 * }} ProgramScene */

/** Last choices, reused for the next program. */
const kept = { fold: "none", beside: false };

export class ProgramView {
  /** @param {HTMLElement} host @param {{ words: Words }} texts */
  constructor(host, { words }) {
    this.words = words;
    this.wanted = ""; // searched text
    this.found = /** @type {number[]} */ ([]); // lines that contain it
    this.at = 0; // index of the current one
    this.ends = /** @type {(() => void)[]} */ ([]); // unsubscribe from the drawing
    this.asking = false; // the drawing is selecting a line for this view
    /** @type {ProgramScene | null} */
    this.scene = null;
    /** @type {Drawing | null} */
    this.drawing = null;
    /** @type {Moves | null} */
    this.moves = null;
    this.root = make("div", "lc-program");
    this.columns = make("div", "lc-columns");
    this.search = make("input", "lc-find", { type: "search", placeholder: words.find, "aria-label": words.find, spellcheck: "false" });
    this.search.addEventListener("input", () => this.find(this.search.value));
    this.told = make("span", "lc-found-count", { role: "status" });
    this.go = make("input", "lc-go", { inputmode: "numeric", placeholder: words.goTo, "aria-label": words.goTo });
    this.go.addEventListener("keydown", (event) => { if (event.key === "Enter") this.goTo(Number(this.go.value)); });
    this.fold = selection("lc-folds", words.fold, [["none", words.foldNone], ["tool", words.foldTool], ["piece", words.foldPiece]], (by) => {
      kept.fold = by;
      this._foldAll();
    });
    this.beside = make("button", "lc-beside", { type: "button", "aria-pressed": "false" }, words.beside);
    this.beside.addEventListener("click", () => this.compare(this.beside.getAttribute("aria-pressed") !== "true"));
    this.fold.hidden = this.beside.hidden = true;
    host.append(this.root);
    this.root.append(make(
      "div", "lc-program-bar", {},
      make(
        "div", "lc-finder", {}, this.search, this.told, iconButton("up", words.findPrevious, () => this.step(-1)),
        iconButton("down", words.findNext, () => this.step(1)),
      ),
      this.go, this.fold, this.beside,
    ), this.columns);
    this.list = this._column("rewritten", words.lines);
    /** The original beside the program. @type {Column | null} */
    this.old = null;
    this.active = this.list;
    this.root.addEventListener("keydown", (event) => this._key(event));
  }

  /** @param {string} name @param {string} label @returns {Column} */
  _column(name, label) {
    const box = make("div", `lc-column-of lc-${name}`), head = make("div", "lc-head", { hidden: "" }, this.words[name]);
    const list = Object.assign(new Lines(box, { words: this.words, label }), { box, head });
    list.view.contentDOM.addEventListener("focus", () => this._activate(list));
    box.prepend(head);
    this.columns.append(box);
    return list;
  }

  /** Show a scene with the text, and optionally the original with the pairs of lines.
   * @param {ProgramScene} scene */
  show(scene) {
    this.scene = scene;
    this.list.setText(scene.text);
    this.beside.hidden = !scene.other.length;
    if (scene.other.length) this.compare(kept.beside || Boolean(scene.header.beside));
    this._again();
  }

  /** Show that the program is not available. */
  refuse() { this.columns.before(make("p", "lc-refused", { role: "alert" }, this.words.refused)); }

  /** Show the original beside the program, or the program alone.
   * @param {boolean} beside */
  compare(beside) {
    const { scene } = this;
    if (!scene) return;
    if (scene.header.beside === undefined) kept.beside = beside;
    this.beside.setAttribute("aria-pressed", String(beside));
    this.root.classList.toggle("lc-two", beside);
    this.list.head.hidden = !beside;
    if (!beside) {
      this.old?.box.remove();
      this.old?.destroy();
      this.old = this.list.dress = null;
      this._activate(this.list);
    } else if (!this.old) {
      const old = (this.old = this._column("original", this.words.original));
      this.columns.prepend(old.box);
      old.head.hidden = false;
      old.setText(scene.other);
      const moves = (this.moves ??= new Moves(scene.pair, old.count, this.list.count));
      old.dress = (line, text) => this._dress(scene, moves, line, text, true);
      this.list.dress = (line, text) => this._dress(scene, moves, line, text, false);
      old.onSelect((line) => this._chosen(line, true));
      if (this.list.selected) this._chosen(this.list.selected, false);
    }
    this._foldAll();
    this._follow();
  }

  /** Return the marks of a line: its position in the other program if it moved, or that only this program has it.
   * @param {ProgramScene} scene @param {Moves} moves @param {number} line @param {string} text @param {boolean} old
   * @returns {import("./lines.js").Dress} */
  _dress(scene, moves, line, text, old) {
    const found = moves.of(line, old), differs = scene[old ? "missing" : "added"].includes(line) ? " lc-differs" : "";
    if (!found) return { class: (text ? (old ? "lc-missing" : "lc-added") : "") + differs };
    if (!found.moved) return { class: differs };
    const half = 2 * found.part, [from, to] = half < 1 ? ["--change", "--rapid"] : ["--rapid", "--accent"];
    const style = `--lc-ramp: color-mix(in oklab, var(${to}) ${((half % 1) * 100).toFixed(0)}%, var(${from}))`;
    const words = this.words[old ? "movedTo" : "movedFrom"].replace("{line}", found.there.toLocaleString());
    return { class: `lc-moved${differs}`, style, where: found.begins ? [`${old ? "→" : "←"} ${found.there}`, words] : null };
  }

  /** Link this view with a drawing: common selection and playback.
   * @param {Drawing} drawing */
  link(drawing) {
    this.drawing = drawing;
    if (!this.scene) this.ends.push(link(drawing, this.list));
    else {
      this.list.onSelect((line) => this._chosen(line, false));
      this.ends.push(drawing.on("select", (what) => this._pointed(what)));
      this.ends.push(drawing.on("time", ({ line }) => (this._showsOriginal ? this.old : this.list)?.run(line)));
    }
    this.ends.push(drawing.on("main", () => this._again()));
    this._again();
  }

  /** Handle the selection of a line in one of the lists: select it in the other list and in the drawing.
   * @param {number} line @param {boolean} old */
  _chosen(line, old) {
    const other = old ? this.list : this.old;
    if (other && this.moves) other.select(this.moves.other(line, old));
    if (!this.drawing) return;
    const own = this._showsOriginal === old ? line : this.moves ? this.moves.other(line, old) : 0;
    this.asking = true;
    this.drawing.selectLine(own);
    this.asking = false;
  }

  /** Whether the drawing shows the original. */
  get _showsOriginal() { return this.drawing?.main?.scene.header.which === "before"; }

  /** Select the line of an object that was selected in the drawing, in both lists.
   * @param {(Picked & { line: number }) | null} what */
  _pointed(what) {
    if (this.asking) return;
    const old = what?.which === "before", list = old ? this.old : this.list, other = old ? this.list : this.old;
    list?.select(what?.line ?? 0);
    if (what?.line && this.moves) other?.select(this.moves.other(what.line, old));
  }

  /** Update the folds after a change of program or toolpath. */
  _again() {
    this.fold.hidden = !this._path(this.list);
    this._foldAll();
    if (this.wanted) this.find(this.wanted);
  }

  /** Return the toolpath of a list, or null.
   * @param {Lines} list */
  _path(list) {
    if (!this.drawing) return null;
    const { tracks, main } = this.drawing;
    if (list === this.old) return tracks.before?.scene ?? null;
    if (this.scene) return tracks.after?.scene ?? null;
    return main?.scene.text?.length ? main.scene : tracks.after?.scene ?? null;
  }

  _foldAll() {
    this.fold.value = kept.fold;
    for (const list of this._lists) {
      const scene = this._path(list), folds = scene && kept.fold !== "none" ? foldsOf(scene, kept.fold, list.count, this.words) : null;
      if (folds || list.folds) list.setFolds(folds);
      else list.show(0);
    }
  }

  get _lists() { return this.old ? [this.list, this.old] : [this.list]; }

  /** Scroll the passive list to the counterpart of the other list's selection. */
  _follow() { if (this.old && this.moves && this.list.selected) this.old.show(this.moves.other(this.list.selected, false)); }

  /** @param {Column} list */
  _activate(list) {
    if (this.active === list) return;
    this.active = list;
    if (this.wanted) this.find(this.wanted);
  }

  /** Find a text, and go to the first match at or after the selected line.
   * @param {string} words */
  find(words) {
    const { active } = this, found = (this.found = active.find(words));
    this.wanted = words;
    this.at = Math.max(found.findIndex((line) => line >= active.selected), 0);
    if (found.length) active.select(found[this.at]);
    this._tell();
  }

  /** Go to the next or previous match.
   * @param {number} by */
  step(by) {
    const { found, active } = this;
    if (!found.length) return;
    this.at = (this.at + by + found.length) % found.length;
    active.choose(found[this.at]);
    this._tell();
  }

  _tell() {
    const { found, words } = this, number = found.length ? this.at + 1 : 0;
    const told = words.found.replace("{number}", number.toLocaleString()).replace("{count}", found.length.toLocaleString());
    this.told.textContent = !this.wanted ? "" : found.length ? told : words.foundNone;
  }

  /** @param {number} line */
  goTo(line) {
    if (!(line >= 1)) return;
    this.active.choose(Math.min(Math.floor(line), this.active.count));
    this.active.view.focus();
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    const held = event.ctrlKey || event.metaKey, key = event.key.toLowerCase(), searching = event.target === this.search;
    const field = held ? { f: this.search, g: this.go }[key] : null;
    if (field) {
      event.preventDefault();
      field.focus();
      field.select();
    } else if (key === "f3" || (searching && key === "enter")) {
      event.preventDefault();
      this.step(event.shiftKey ? -1 : 1);
    } else if (searching && key === "escape") {
      event.stopPropagation();
      this.search.value = "";
      this.find("");
      this.active.view.focus();
    }
  }

  destroy() {
    for (const end of this.ends) end();
    for (const list of this._lists) list.destroy();
    this.root.remove();
  }
}
