// Program as a list of up to a million lines: only visible rows exist as elements; the text stays as bytes.
//
//   const list = new GcodeList(host, { words });
//   list.setText(scene.text);           // Uint8Array of UTF-8
//   list.setFolds(new Folds(starts, list.count));   // foldable blocks (program_folds.js)
//   link(drawing, list);                // selection and playback in both directions
//
// A row is a visible line, or the head of a folded block. Lines count from 1, rows from 0.

import { make } from "./icons.js";
import { WORDS } from "./words.js";

const HEIGHT = 20; // pixels of a line, as in the style sheet
const TALLEST = 8e6; // pixels; browsers position taller elements inexactly
const LONGEST = 2000; // maximum number of characters shown per line
const FOLLOW = 90; // minimum milliseconds between two marked lines during playback

export class GcodeList {
  constructor(host, { words = {}, label = "" } = {}) {
    this.words = { ...WORDS, ...words };
    this.folds = null; // program_folds.js
    this.dress = null; // called with (row element, line) to add marks to a line
    this.bytes = new Uint8Array(0);
    this.starts = new Uint32Array(1);
    this.count = 0;
    this.top = 0; // first visible row, with a fraction
    this.selected = 0; // line, from 1; 0: none
    this.running = this.next = this.ran = 0;
    this.decoder = new TextDecoder();
    this._listeners = [];
    this.id = `lc-gcode-${(GcodeList.made = (GcodeList.made ?? 0) + 1)}`;
    this.spacer = make("div", "lc-spacer");
    this.rows = make("div", "lc-rows");
    this.box = make("div", "lc-gcode", { role: "listbox", tabindex: 0, "aria-label": label || this.words.lines }, this.spacer, this.rows);
    this.note = make("div", "lc-told", { role: "status", hidden: "" });
    host.append(this.note, this.box);
    this.box.addEventListener("scroll", () => this._scrolled());
    this.box.addEventListener("wheel", (event) => this._wheel(event), { passive: false });
    this.box.addEventListener("keydown", (event) => this._key(event));
    this.box.addEventListener("click", (event) => this._click(event));
    this._observer = new ResizeObserver(() => this._draw());
    this._observer.observe(this.box);
  }

  /** Show a permanent note above the program. */
  tell(words) {
    this.note.textContent = words;
    this.note.hidden = !words;
  }

  onSelect(act) { this._listeners.push(act); }

  /** Set a UTF-8 text; the starts of lines are determined once. */
  setText(bytes) {
    let count = bytes.length && bytes[bytes.length - 1] !== 10 ? 1 : 0;
    for (let k = 0; k < bytes.length; k++) if (bytes[k] === 10) count++;
    this.starts = new Uint32Array(count + 1);
    let line = 1;
    for (let k = 0; k < bytes.length; k++) if (bytes[k] === 10) this.starts[line++] = k + 1;
    this.starts[count] = bytes.length;
    this.bytes = bytes;
    this.count = count;
    this.selected = this.running = this.next = this.top = 0;
    this.digits = String(count).length;
    this.setFolds(null);
    this.box.scrollTop = 0;
  }

  /** Set the foldable blocks, or null; the selection stays visible. */
  setFolds(folds) {
    this.folds = folds;
    this.box.setAttribute("role", folds ? "tree" : "listbox");
    this._measure(this.selected || this.lineAt(Math.floor(this.top)));
  }

  /** Fold or unfold a block. */
  fold(head, closed) {
    this.folds.set(head, closed);
    this._measure(head);
  }

  /** Fold or unfold all blocks. */
  foldAll(closed) {
    this.folds.setAll(closed);
    this._measure(this.selected);
  }

  /** Number of rows. */
  get length() { return this.folds ? this.folds.length : this.count; }

  rowOf(line) { return this.folds ? this.folds.rowOf(line) : line - 1; }

  lineAt(row) { return this.folds ? this.folds.lineAt(row) : row + 1; }

  _measure(line) {
    this.spacer.style.height = `${Math.min(this.length * HEIGHT, TALLEST)}px`;
    this._go(line ? Math.min(this.top, this.rowOf(line)) : this.top);
    if (line) this.show(line, false);
  }

  /** Return the text of a line, counted from 1. */
  line(number) {
    const first = this.starts[number - 1], end = Math.min(this.starts[number], first + 4 * LONGEST);
    return this.decoder.decode(this.bytes.subarray(first, end)).replace(/[\r\n]+$/, "").slice(0, LONGEST);
  }

  /** Select a line and scroll to it, without an event. 0 clears the selection. */
  select(line) {
    this.selected = line;
    if (line) this.show(line);
    this._draw();
  }

  /** Mark the line being run, at a limited rate. */
  run(line) {
    if (line === this.next) return;
    this.next = line;
    const wait = FOLLOW - (performance.now() - this.ran);
    clearTimeout(this._timer);
    if (wait <= 0) this._run();
    else this._timer = setTimeout(() => this._run(), wait);
  }

  _run() {
    this.ran = performance.now();
    this.running = this.next;
    if (this.running) this.show(this.running);
    this._draw();
  }

  /** Scroll to a line, after unfolding its block. */
  show(line, unfold = true) {
    if (unfold && this.folds?.hides(line)) {
      this.folds.set(this.folds.headOf(line), false);
      this.spacer.style.height = `${Math.min(this.length * HEIGHT, TALLEST)}px`;
    }
    const seen = this._seen(), row = this.rowOf(line);
    if (row >= this.top + 1 && row <= this.top + seen - 3) return;
    this._go(row - seen / 2);
  }

  destroy() {
    this._observer.disconnect();
    clearTimeout(this._timer);
    this.box.remove();
    this.note.remove();
  }

  _seen() { return Math.max(this.box.clientHeight / HEIGHT, 1); }

  _furthest() { return Math.max(this.length - this._seen(), 0); }

  _go(top) {
    this.top = Math.min(Math.max(top, 0), this._furthest());
    const room = this.spacer.clientHeight - this.box.clientHeight;
    this.expected = this._furthest() ? Math.round((this.top / this._furthest()) * room) : 0;
    this.box.scrollTop = this.expected;
    this._draw();
  }

  /** Handle scrolling; in a text taller than any element, one pixel is several lines. */
  _scrolled() {
    const at = this.box.scrollTop;
    if (Math.abs(at - (this.expected ?? -1)) <= 1) {
      this._draw();
      return;
    }
    this.expected = undefined;
    const room = this.spacer.clientHeight - this.box.clientHeight;
    this.top = room > 0 ? (at / room) * this._furthest() : 0;
    this._draw();
  }

  _wheel(event) {
    if (event.ctrlKey || !event.deltaY) return;
    event.preventDefault();
    const lines = event.deltaMode === 1 ? event.deltaY : event.deltaMode === 2 ? event.deltaY * this._seen() : event.deltaY / HEIGHT;
    this._go(this.top + lines);
  }

  _key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.count) return;
    const line = this.selected || this.running || this.lineAt(Math.floor(this.top));
    if (this.folds && ["ArrowLeft", "ArrowRight"].includes(event.key)) {
      event.preventDefault();
      this._foldByKey(line, event.key === "ArrowLeft");
      return;
    }
    const at = this.rowOf(line), page = Math.floor(this._seen()) - 1;
    const to = { ArrowDown: at + 1, ArrowUp: at - 1, PageDown: at + page, PageUp: at - page, Home: 0, End: this.length - 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    this._choose(this.lineAt(Math.min(Math.max(to, 0), this.length - 1)));
  }

  /** Left folds the block of a line and selects its head; right unfolds it. */
  _foldByKey(line, closed) {
    const head = this.folds.headOf(line);
    if (!head) return;
    if (closed && line !== head) this._choose(head);
    else this.fold(head, closed);
  }

  _click(event) {
    const row = event.target.closest("[data-line]");
    if (!row) return;
    const line = Number(row.dataset.line);
    if (event.target.closest(".lc-fold")) this.fold(line, !this.folds.isClosed(line));
    else this._choose(line);
  }

  _choose(line) {
    this.select(line);
    this._listeners.forEach((act) => act(line));
  }

  _draw() {
    const first = Math.floor(this.top), last = Math.min(first + Math.ceil(this._seen()) + 1, this.length);
    this.rows.style.transform = `translateY(${this.box.scrollTop - (this.top - first) * HEIGHT}px)`;
    const rows = [];
    for (let row = first; row < last; row++) rows.push(this._row(this.lineAt(row), row));
    this.rows.replaceChildren(...rows);
    const at = this.selected ? this.rowOf(this.selected) : -1;
    if (at >= first && at < last) this.box.setAttribute("aria-activedescendant", `${this.id}-${this.lineAt(at)}`);
    else this.box.removeAttribute("aria-activedescendant");
    this.onDraw?.(this);
  }

  _row(line, place) {
    const { folds } = this, within = (one) => one && this.rowOf(one) === place;
    const chosen = within(this.selected), names = `lc-line${chosen ? " lc-selected" : ""}${within(this.running) ? " lc-running" : ""}`;
    const row = make("div", names, {
      role: folds ? "treeitem" : "option", id: `${this.id}-${line}`, "data-line": line, "aria-selected": Boolean(chosen),
      "aria-posinset": place + 1, "aria-setsize": this.length,
    });
    const number = make("span", "lc-number", { "aria-hidden": "true" }, String(line));
    number.style.minWidth = `${this.digits + 1}ch`;
    row.append(number);
    if (folds) row.append(...this._foldOf(row, line));
    row.append(...coloured(this.line(line)));
    this.dress?.(row, line);
    return row;
  }

  /** Return the fold sign of a block's head, and a summary of a folded block. */
  _foldOf(row, line) {
    const { folds } = this;
    row.setAttribute("aria-level", folds.isHead(line) || !folds.headOf(line) ? 1 : 2);
    if (!folds.isHead(line)) return [make("span", "lc-unfolded")];
    const closed = folds.isClosed(line), size = folds.sizeOf(line), name = folds.nameOf(line);
    if (size < 2) return [make("span", "lc-unfolded"), make("span", "lc-held", {}, name)];
    row.setAttribute("aria-expanded", !closed);
    const sign = make("span", "lc-fold", { "aria-hidden": "true" }, closed ? "▸" : "▾");
    const held = this.words.folded.replace("{name}", name).replace("{number}", size.toLocaleString());
    return [sign, make("span", "lc-held", {}, closed ? held : name)];
  }
}

const TOKEN = /(\([^)]*\)?|;.*|^%.*)|([GM]\s*\d+(?:\.\d+)?)|([XYZABCIJKR]\s*[-+]?[\d.]+)|([A-Z]\s*[-+]?[\d.]+)/gi;
const CLASSES = ["lc-comment", "lc-word", "lc-place", "lc-value"];

/** Return a line split into comments, G and M words, coordinates, and other values. */
export function coloured(text) {
  const pieces = [];
  let at = 0;
  for (const match of text.matchAll(TOKEN)) {
    if (match.index > at) pieces.push(text.slice(at, match.index));
    const kind = match.slice(1).findIndex((group) => group !== undefined);
    pieces.push(make("span", CLASSES[kind], {}, match[0]));
    at = match.index + match[0].length;
  }
  if (at < text.length) pieces.push(text.slice(at));
  return pieces;
}

/** Link a drawing and a list: the list shows the drawing's program, with common selection and playback. Return a
 * function that unlinks them, as a drawing outlives its lists. */
export function link(drawing, list) {
  // The toolpath before has no text. The new program is shown with a note and without links then.
  let own = true;
  const take = () => {
    const text = drawing.main?.scene.text, other = drawing.tracks.after?.scene.text;
    own = Boolean(text?.length) || !other?.length;
    list.setText((own ? text : other) ?? new Uint8Array(0));
    list.tell(own ? "" : list.words.newProgram);
  };
  const ends = [drawing.on("main", take)];
  take();
  let chosen = 0; // line selected in the list; it stays selected even if nothing is drawn for it, as for a comment
  list.onSelect((line) => {
    if (!own) return;
    chosen = line;
    drawing.selectLine(line);
    chosen = 0;
  });
  ends.push(drawing.on("select", (what) => {
    const line = chosen || (what?.line ?? 0);
    if (own && line !== list.selected) list.select(line);
  }));
  ends.push(drawing.on("time", ({ line }) => list.run(own ? line : 0)));
  return () => ends.forEach((end) => end());
}
