// The program as a list that takes a million lines: only what is seen exists; the text stays bytes.
//
//   const list = new GcodeList(host, { words });
//   list.setText(scene.text);           // Uint8Array of UTF-8
//   link(drawing, list);                // selection and playback, both ways

import { make } from "./icons.js";
import { WORDS } from "./words.js";

const HEIGHT = 20; // pixels of a line, as in the style sheet
const TALLEST = 8e6; // pixels: browsers draw no taller element exactly
const LONGEST = 2000; // characters shown of a line
const FOLLOW = 90; // milliseconds between two lines that are marked as run

export class GcodeList {
  constructor(host, { words = {} } = {}) {
    this.words = { ...WORDS, ...words };
    this.bytes = new Uint8Array(0);
    this.starts = new Uint32Array(1);
    this.count = 0;
    this.top = 0; // first line seen, counted from 0, with a fraction
    this.selected = 0; // line, from 1; 0: none
    this.running = this.next = this.ran = 0;
    this.decoder = new TextDecoder();
    this._listeners = [];
    this.id = `lc-gcode-${(GcodeList.made = (GcodeList.made ?? 0) + 1)}`;
    this.spacer = make("div", "lc-spacer");
    this.rows = make("div", "lc-rows");
    this.box = make("div", "lc-gcode", { role: "listbox", tabindex: 0, "aria-label": this.words.lines }, this.spacer, this.rows);
    this.note = make("div", "lc-told", { role: "status", hidden: "" });
    host.append(this.note, this.box);
    this.box.addEventListener("scroll", () => this._scrolled());
    this.box.addEventListener("wheel", (event) => this._wheel(event), { passive: false });
    this.box.addEventListener("keydown", (event) => this._key(event));
    this.box.addEventListener("click", (event) => this._click(event));
    this._observer = new ResizeObserver(() => this._draw());
    this._observer.observe(this.box);
  }

  /** Say what the program is, above it; nothing takes that away. */
  tell(words) {
    this.note.textContent = words;
    this.note.hidden = !words;
  }

  onSelect(act) { this._listeners.push(act); }

  /** Take a text as UTF-8; where lines begin is found once. */
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
    this.spacer.style.height = `${Math.min(count * HEIGHT, TALLEST)}px`;
    this.box.scrollTop = 0;
    this.digits = String(count).length;
    this._draw();
  }

  /** Return the text of a line, counted from 1. */
  line(number) {
    const first = this.starts[number - 1], end = Math.min(this.starts[number], first + 4 * LONGEST);
    return this.decoder.decode(this.bytes.subarray(first, end)).replace(/[\r\n]+$/, "").slice(0, LONGEST);
  }

  /** Select a line and move to it; nobody is told. 0 selects nothing. */
  select(line) {
    this.selected = line;
    if (line) this.show(line);
    this._draw();
  }

  /** Mark the line that is being run; no more often than eyes can follow. */
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

  show(line) {
    const seen = this._seen();
    if (line - 1 >= this.top + 1 && line - 1 <= this.top + seen - 3) return;
    this._go(line - 1 - seen / 2);
  }

  destroy() {
    this._observer.disconnect();
    clearTimeout(this._timer);
    this.box.remove();
    this.note.remove();
  }

  _seen() { return Math.max(this.box.clientHeight / HEIGHT, 1); }

  _furthest() { return Math.max(this.count - this._seen(), 0); }

  _go(top) {
    this.top = Math.min(Math.max(top, 0), this._furthest());
    const room = this.spacer.clientHeight - this.box.clientHeight;
    this.expected = this._furthest() ? Math.round((this.top / this._furthest()) * room) : 0;
    this.box.scrollTop = this.expected;
    this._draw();
  }

  /** The bar was moved: of a text taller than any element, a pixel is several lines. */
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
    const at = this.selected || this.running || Math.floor(this.top) + 1, page = Math.floor(this._seen()) - 1;
    const to = { ArrowDown: at + 1, ArrowUp: at - 1, PageDown: at + page, PageUp: at - page, Home: 1, End: this.count }[event.key];
    if (to === undefined || !this.count) return;
    event.preventDefault();
    this._choose(Math.min(Math.max(to, 1), this.count));
  }

  _click(event) {
    const row = event.target.closest("[data-line]");
    if (row) this._choose(Number(row.dataset.line));
  }

  _choose(line) {
    this.select(line);
    this._listeners.forEach((act) => act(line));
  }

  _draw() {
    const first = Math.floor(this.top), last = Math.min(first + Math.ceil(this._seen()) + 1, this.count);
    this.rows.style.transform = `translateY(${this.box.scrollTop - (this.top - first) * HEIGHT}px)`;
    const rows = [];
    for (let line = first + 1; line <= last; line++) rows.push(this._row(line));
    this.rows.replaceChildren(...rows);
    const active = this.selected > first && this.selected <= last;
    if (active) this.box.setAttribute("aria-activedescendant", `${this.id}-${this.selected}`);
    else this.box.removeAttribute("aria-activedescendant");
  }

  _row(line) {
    const chosen = line === this.selected, names = `lc-line${chosen ? " lc-selected" : ""}${line === this.running ? " lc-running" : ""}`;
    const row = make("div", names, {
      role: "option", id: `${this.id}-${line}`, "data-line": line, "aria-selected": chosen, "aria-posinset": line, "aria-setsize": this.count,
    });
    const number = make("span", "lc-number", { "aria-hidden": "true" }, String(line));
    number.style.minWidth = `${this.digits + 1}ch`;
    row.append(number, ...coloured(this.line(line)));
    return row;
  }
}

const TOKEN = /(\([^)]*\)?|;.*|^%.*)|([GM]\s*\d+(?:\.\d+)?)|([XYZABCIJKR]\s*[-+]?[\d.]+)|([A-Z]\s*[-+]?[\d.]+)/gi;
const CLASSES = ["lc-comment", "lc-word", "lc-place", "lc-value"];

/** Return a line as pieces: comments, G and M words, places, other values. */
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

/** Link a drawing and a list: the list has the drawing's program, what is selected in one is selected in both, and
 * playing moves both. Return a function that ends this: a drawing outlives its lists. */
export function link(drawing, list) {
  // The toolpath before has no text: the new program is shown, and told as that; nothing of it is linked then.
  let own = true;
  const take = () => {
    const text = drawing.main?.scene.text, other = drawing.tracks.after?.scene.text;
    own = Boolean(text?.length) || !other?.length;
    list.setText((own ? text : other) ?? new Uint8Array(0));
    list.tell(own ? "" : list.words.newProgram);
  };
  const ends = [drawing.on("main", take)];
  take();
  let chosen = 0; // the line that the list asks for: it stays chosen where nothing is drawn of it, as of a comment
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
