// Program view: the list of lines with search, go to line, folding, and the original beside it.
//
//   const view = new ProgramView(host, { words });
//   view.show(scene);        // format: studio/drawing/program_text.py; without it, the drawing's program
//   view.link(drawing);

import { iconButton, make } from "./icons.js";
import { Lines, link } from "./lines.js";
import { foldsOf } from "./program_folds.js";
import { Moves } from "./program_moves.js";

/** Last choices, reused for the next program. */
const kept = { fold: "none", beside: false };

export class ProgramView {
  constructor(host, { words }) {
    this.words = words;
    this.found = [];
    this.wanted = "";
    this.ends = [];
    this.drawing = this.moves = null;
    this.root = make("div", "lc-program");
    this.columns = make("div", "lc-columns");
    host.append(this.root);
    this.root.append(this._bar(), this.columns);
    this.list = this._column("rewritten", this.words.lines);
    this.active = this.list;
    this.root.addEventListener("keydown", (event) => this._key(event));
  }

  _bar() {
    const { words } = this;
    this.search = make("input", "lc-find", { type: "search", placeholder: words.find, "aria-label": words.find, spellcheck: "false" });
    this.search.addEventListener("input", () => this.find(this.search.value));
    this.told = make("span", "lc-found-count", { role: "status" });
    this.go = make("input", "lc-go", { inputmode: "numeric", placeholder: words.goTo, "aria-label": words.goTo });
    this.go.addEventListener("keydown", (event) => { if (event.key === "Enter") this.goTo(Number(this.go.value)); });
    this.fold = make("select", "lc-select lc-folds", { "aria-label": words.fold });
    for (const by of ["none", "tool", "piece"]) {
      this.fold.append(make("option", "", { value: by }, words[`fold${by[0].toUpperCase()}${by.slice(1)}`]));
    }
    this.fold.addEventListener("change", () => {
      kept.fold = this.fold.value;
      this._foldAll();
    });
    this.beside = make("button", "lc-beside", { type: "button", "aria-pressed": "false" }, words.beside);
    this.beside.addEventListener("click", () => this.compare(this.beside.getAttribute("aria-pressed") !== "true"));
    this.fold.hidden = this.beside.hidden = true;
    const step = (name, by) => iconButton(name, words[by > 0 ? "findNext" : "findPrevious"], () => this.step(by));
    return make(
      "div", "lc-program-bar", {}, make("div", "lc-finder", {}, this.search, this.told, step("up", -1), step("down", 1)),
      this.go, this.fold, this.beside,
    );
  }

  _column(name, label) {
    const box = make("div", `lc-column-of lc-${name}`), list = new Lines(box, { words: this.words, label });
    list.head = make("div", "lc-head", {}, this.words[name]);
    list.box = box;
    list.view.contentDOM.addEventListener("focus", () => this._activate(list));
    box.prepend(list.head);
    list.head.hidden = true;
    this.columns.append(box);
    return list;
  }

  /** Show a scene with the text, and optionally the original with the pairs of lines. */
  show(scene) {
    this.scene = scene;
    this.list.setText(scene.text);
    this.beside.hidden = !scene.other.length;
    if (scene.other.length) this.compare(kept.beside || Boolean(scene.header.beside));
    this._again();
  }

  /** Show that the program is not available. */
  refuse() { this.columns.before(make("p", "lc-refused", { role: "alert" }, this.words.refused)); }

  /** Show the original beside the program, or the program alone. */
  compare(beside) {
    if (this.scene.header.beside === undefined) kept.beside = beside;
    this.beside.setAttribute("aria-pressed", beside);
    this.root.classList.toggle("lc-two", beside);
    this.list.head.hidden = !beside;
    if (!beside) {
      this.old?.box.remove();
      this.old?.destroy();
      this.old = this.list.dress = null;
      this._activate(this.list);
    } else if (!this.old) {
      const { scene } = this, old = (this.old = this._column("original", this.words.original));
      this.columns.prepend(old.box);
      old.head.hidden = false;
      old.setText(scene.other);
      this.moves ??= new Moves(scene.pair, old.count, this.list.count);
      old.dress = (line, text) => this._dress(line, text, true);
      this.list.dress = (line, text) => this._dress(line, text, false);
      old.onSelect((line) => this._chosen(line, true));
      if (this.list.selected) this._chosen(this.list.selected, false);
    }
    this._foldAll();
    this._follow();
  }

  /** Return the marks of a line: its position in the other program if it moved, or that only this program has it. */
  _dress(line, text, old) {
    const found = this.moves.of(line, old), differs = this.scene[old ? "missing" : "added"].includes(line) ? " lc-differs" : "";
    if (!found) return { class: (text ? (old ? "lc-missing" : "lc-added") : "") + differs };
    if (!found.moved) return { class: differs };
    const half = 2 * found.part, [from, to] = half < 1 ? ["--change", "--rapid"] : ["--rapid", "--accent"];
    const style = `--lc-ramp: color-mix(in oklab, var(${to}) ${((half % 1) * 100).toFixed(0)}%, var(${from}))`;
    const words = this.words[old ? "movedTo" : "movedFrom"].replace("{line}", found.there.toLocaleString());
    return { class: `lc-moved${differs}`, style, where: found.begins ? [`${old ? "→" : "←"} ${found.there}`, words] : null };
  }

  /** Link this view with a drawing: common selection and playback. */
  link(drawing) {
    this.drawing = drawing;
    if (!this.scene) this.ends.push(link(drawing, this.list));
    else {
      this.list.onSelect((line) => this._chosen(line, false));
      this.ends.push(drawing.on("select", (what) => this._pointed(what)));
      this.ends.push(drawing.on("time", ({ line }) => this._running(line)));
    }
    this.ends.push(drawing.on("main", () => this._again()));
    this._again();
  }

  /** Handle the selection of a line in one of the lists: select it in the other list and in the drawing. */
  _chosen(line, old) {
    const other = old ? this.list : this.old;
    if (other && this.moves) other.select(this.moves.other(line, old));
    if (!this.drawing) return;
    const main = this.drawing.main?.scene.header.which === "before";
    const own = main === old ? line : this.moves ? this.moves.other(line, old) : 0;
    this.asking = true;
    this.drawing.selectLine(own);
    this.asking = false;
  }

  _pointed(what) {
    if (this.asking) return;
    const old = what?.which === "before", list = old ? this.old : this.list, other = old ? this.list : this.old;
    list?.select(what?.line ?? 0);
    if (what?.line && this.moves) other?.select(this.moves.other(what.line, old));
  }

  _running(line) {
    const old = this.drawing.main?.scene.header.which === "before";
    (old ? this.old : this.list)?.run(line);
  }

  /** Update the folds after a change of program or toolpath. */
  _again() {
    this.fold.hidden = !this._path(this.list);
    this._foldAll();
    if (this.wanted) this.find(this.wanted);
  }

  _path(list) {
    const { tracks, main } = this.drawing ?? { tracks: {} };
    if (list === this.old) return tracks.before?.scene ?? null;
    if (this.scene) return tracks.after?.scene ?? null;
    return main?.scene.text?.length ? main.scene : tracks.after?.scene ?? null;
  }

  _foldAll() {
    this.fold.value = kept.fold;
    for (const list of [this.list, this.old]) {
      const scene = list && this._path(list);
      const folds = scene && kept.fold !== "none" ? foldsOf(scene, kept.fold, list.count, this.words) : null;
      if (list && (folds || list.folds)) list.setFolds(folds);
      else list?.show(0);
    }
  }

  /** Scroll the passive list to the counterpart of the other list's selection. */
  _follow() { if (this.old && this.list.selected) this.old.show(this.moves.other(this.list.selected, false)); }

  _activate(list) {
    if (this.active === list) return;
    this.active = list;
    if (this.wanted) this.find(this.wanted);
  }

  /** Find a text, and go to the first match at or after the selected line. */
  find(words) {
    const { active } = this, found = (this.found = active.find(words));
    this.wanted = words;
    this.at = Math.max(found.findIndex((line) => line >= active.selected), 0);
    if (found.length) active.select(found[this.at]);
    this._tell();
  }

  /** Go to the next or previous match. */
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

  goTo(line) {
    if (!(line >= 1)) return;
    this.active.choose(Math.min(Math.floor(line), this.active.count));
    this.active.view.focus();
  }

  _key(event) {
    const held = event.ctrlKey || event.metaKey, at = event.target;
    if (held && event.key.toLowerCase() === "f") {
      event.preventDefault();
      this.search.focus();
      this.search.select();
    } else if (held && event.key.toLowerCase() === "g") {
      event.preventDefault();
      this.go.focus();
      this.go.select();
    } else if (at === this.search && event.key === "Enter") this.step(event.shiftKey ? -1 : 1);
    else if (event.key === "F3") {
      event.preventDefault();
      this.step(event.shiftKey ? -1 : 1);
    } else if (at === this.search && event.key === "Escape") {
      event.stopPropagation();
      this.search.value = "";
      this.find("");
      this.active.view.focus();
    }
  }

  destroy() {
    this.ends.forEach((end) => end());
    for (const list of [this.list, this.old]) list?.destroy();
    this.root.remove();
  }
}
