// Lines of a program in CodeMirror, read-only: the selected and the running line, folds, matches, and marks of lines.

import * as CM from "nicegui-codemirror";
import { make, styleNonce } from "./icons.js";

/** @import { Drawing } from "./canvas.js" */
/** @import { Block } from "./program_folds.js" */
/** A foldable block. @typedef {Block & { closed: boolean }} FoldBlock */
/** Marks of a line: class, style, and words with a title to show beside the line.
 * @typedef {{ class?: string, style?: string, where?: [string, string] | null }} Dress */

const { Decoration, EditorState, EditorView } = CM;
const FOLLOW = 90; // minimum milliseconds between two marked lines during playback
const LONGEST = 2000; // maximum number of characters coloured per line
const TOKEN = /(\([^)]*\)?|;.*|^%.*)|([GM]\s*\d+(?:\.\d+)?)|([XYZABCIJKR]\s*[-+]?[\d.]+)|([A-Z]\s*[-+]?[\d.]+)/gi;
const CLASSES = ["lc-comment", "lc-word", "lc-place", "lc-value"];
/** @type {CM.StateEffectType<null>} */
const marked = CM.StateEffect.define(); // the marks of lines have changed
/** @type {CM.StateEffectType<CM.DecorationSet>} */
const folded = CM.StateEffect.define();

/** Folded blocks, all in one set: there may be a hundred thousand.
 * @type {CM.StateField<CM.DecorationSet>} */
const FOLDS = CM.StateField.define({
  create: () => Decoration.none,
  update: (set, { effects }) => effects.findLast((effect) => effect.is(folded))?.value ?? set,
  provide: (field) => EditorView.decorations.from(field),
});

/** Text beside a line. */
class Note extends CM.WidgetType {
  /** @param {string} words @param {string} title */
  constructor(words, title) {
    super();
    this.words = words;
    this.title = title;
  }

  /** @param {Note} other */
  eq(other) { return other.words === this.words && other.title === this.title; }

  toDOM() { return make("span", "lc-where", { title: this.title }, this.words); }

  /** A click on the text selects its line. Ignored by the editor, it would do so only if the browser is quick. */
  ignoreEvent() { return false; }
}

/** Button that folds or unfolds a block, behind its first line. */
class Fold extends CM.WidgetType {
  /** @param {Lines} list @param {FoldBlock} block */
  constructor(list, block) {
    super();
    this.list = list;
    this.block = block;
    this.closed = block.closed;
  }

  /** @param {Fold} other */
  eq(other) { return other.block === this.block && other.closed === this.closed; }

  toDOM() {
    const { list, closed, block: { first, last, name } } = this;
    const words = closed ? list.words.folded.replace("{name}", name).replace("{number}", (last - first + 1).toLocaleString()) : name;
    const button = make("button", "lc-held", { type: "button", "aria-expanded": !closed }, `${closed ? "▸" : "▾"} ${words}`);
    button.addEventListener("click", () => list.fold(this.block, !closed));
    return button;
  }
}

export class Lines {
  /** @param {HTMLElement} host @param {{ words: Words, label: string }} texts */
  constructor(host, { words, label }) {
    this.words = words;
    /** Returns the marks of a line. @type {((line: number, text: string) => Dress) | null} */
    this.dress = null;
    /** @type {Map<number, FoldBlock> | null} */
    this.folds = null;
    this.selected = this.running = this.next = this.ran = this.count = this._timer = 0;
    /** @type {RegExp | null} */
    this.pattern = null;
    /** @type {((line: number) => void)[]} */
    this._listeners = [];
    const list = this;
    const marks = CM.ViewPlugin.define((view) => ({
      decorations: list._marks(view),
      update(/** @type {CM.ViewUpdate} */ change) {
        const told = change.transactions.some(({ effects }) => effects.some((effect) => effect.is(marked)));
        if (told || change.docChanged || change.viewportChanged) this.decorations = list._marks(change.view);
      },
    }), { decorations: (plugin) => plugin.decorations });
    this._extensions = [
      CM.lineNumbers(), FOLDS, marks, CM.keymap.of([this._foldKey("[", true), this._foldKey("]", false), ...CM.defaultKeymap]),
      EditorState.readOnly.of(true), EditorState.lineSeparator.of("\n"),
      EditorView.contentAttributes.of({ "aria-label": label, tabindex: "0", inputmode: "none" }), // no keyboard on a phone
      EditorView.cspNonce.of(styleNonce()),
      EditorView.updateListener.of((change) => this._follow(change)),
    ];
    this.note = make("div", "lc-told", { role: "status", hidden: "" });
    host.append(this.note);
    this.view = new EditorView({ parent: host, extensions: this._extensions });
  }

  /** Show a permanent note above the program.
   * @param {string} words */
  tell(words) {
    this.note.textContent = words;
    this.note.hidden = !words;
  }

  /** @param {(line: number) => void} act */
  onSelect(act) { this._listeners.push(act); }

  get doc() { return this.view.state.doc; }

  /** Set a UTF-8 text.
   * @param {Uint8Array} bytes */
  setText(bytes) {
    const doc = new TextDecoder().decode(bytes).replace(/\n$/, "");
    this.folds = null;
    this.selected = this.running = this.next = 0;
    this.view.setState(EditorState.create({ doc, extensions: this._extensions }));
    this.count = bytes.length ? this.doc.lines : 0;
  }

  /** Fold all blocks, [{first, last, name}] in lines; null removes the folds.
   * @param {Block[] | null} blocks */
  setFolds(blocks) {
    this.folds = blocks && new Map(blocks.map((block) => [block.first, { ...block, closed: block.last > block.first }]));
    this.view.dispatch({ effects: this._foldEffects() });
    if (this.selected) this.show(this.selected);
  }

  /** @param {FoldBlock} block @param {boolean} closed */
  fold(block, closed) {
    block.closed = closed;
    this.view.dispatch({ effects: this._foldEffects() });
  }

  _foldEffects() {
    const closed = [...(this.folds?.values() ?? [])].filter((block) => block.closed);
    const ranges = closed.map(({ first, last }) => Decoration.replace({}).range(this.doc.line(first).to, this.doc.line(last).to));
    return [folded.of(Decoration.set(ranges)), marked.of(null)];
  }

  /** Return a key that folds or unfolds the block of the selected line.
   * @param {string} key @param {boolean} closed */
  _foldKey(key, closed) {
    const run = () => {
      const block = [...(this.folds?.values() ?? [])].findLast(({ first }) => first <= this.selected);
      if (!block || block.last === block.first) return false;
      if (closed) this.choose(block.first);
      this.fold(block, closed);
      return true;
    };
    return { key: `Ctrl-Shift-${key}`, mac: `Cmd-Alt-${key}`, run };
  }

  /** Select a line and scroll to it, without an event. 0 clears the selection.
   * @param {number} line */
  select(line) {
    this.selected = Math.min(line, this.count);
    if (this.selected) this.view.dispatch({ selection: { anchor: this.doc.line(this.selected).from } });
    this.show(this.selected);
  }

  /** Select a line with an event.
   * @param {number} line */
  choose(line) {
    this.select(line);
    this._listeners.forEach((act) => act(this.selected));
  }

  /** Mark the line being run, at a limited rate.
   * @param {number} line */
  run(line) {
    if (line === this.next) return;
    this.next = line;
    clearTimeout(this._timer);
    this._timer = setTimeout(() => {
      this.ran = performance.now();
      this.running = this.next;
      this.show(this.running);
    }, Math.max(FOLLOW - (performance.now() - this.ran), 0));
  }

  /** Draw the marks again, then unfold the block of a line and scroll to it; 0 scrolls to no line.
   * @param {number} line */
  show(line) {
    const effects = /** @type {CM.StateEffect<any>[]} */ ([marked.of(null)]);
    if (line > 0 && line <= this.count) {
      const { from } = this.doc.line(line);
      this.view.state.field(FOLDS).between(from, from, (start) => {
        if (start >= from) return;
        const block = this.folds?.get(this.doc.lineAt(start).number);
        if (block) block.closed = false;
        effects.push(...this._foldEffects());
      });
      effects.push(EditorView.scrollIntoView(from, { yMargin: 80 }));
    }
    this.view.dispatch({ effects });
  }

  /** Highlight a text, ignoring case; return the lines that contain it.
   * @param {string} words */
  find(words) {
    this.pattern = words ? new RegExp(words.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"), "gi") : null;
    const found = /** @type {number[]} */ ([]);
    for (const match of this.pattern ? this.doc.toString().matchAll(this.pattern) : []) {
      const line = this.doc.lineAt(match.index).number;
      if (line !== found.at(-1)) found.push(line);
    }
    this.show(0);
    return found;
  }

  destroy() {
    clearTimeout(this._timer);
    this.view.destroy();
    this.note.remove();
  }

  /** Select the line that the user chooses by pointer or key, with an event.
   * @param {CM.ViewUpdate} update */
  _follow({ transactions, state }) {
    if (!this.count || !transactions.some((one) => one.isUserEvent("select"))) return;
    const line = state.doc.lineAt(state.selection.main.head).number;
    if (line !== this.selected) this.choose(line);
  }

  /** Return the decorations of the visible lines.
   * @param {CM.EditorView} view */
  _marks(view) {
    const { doc } = view.state, marks = /** @type {CM.Range<any>[]} */ ([]);
    for (const { from, to } of view.visibleRanges) {
      for (let at = from; at <= to;) {
        const line = doc.lineAt(at), { number } = line, text = line.text.slice(0, LONGEST), block = this.folds?.get(number);
        const { class: name, style = "", where } = this.dress?.(number, text) ?? {};
        const names = ["lc-line", name, number === this.selected && "lc-selected", number === this.running && "lc-running"].filter(Boolean);
        marks.push(Decoration.line({ class: names.join(" "), attributes: { "data-line": String(number), ...(style && { style }) } }).range(line.from));
        const mark = (/** @type {string} */ name, /** @type {RegExpExecArray} */ { index, 0: part }) => {
          const start = line.from + index;
          if (part) marks.push(Decoration.mark({ class: name }).range(start, start + part.length));
        };
        for (const match of text.matchAll(TOKEN)) mark(CLASSES[match.slice(1).findIndex((group) => group !== undefined)], match);
        for (const match of this.pattern ? text.matchAll(this.pattern) : []) mark("lc-match", match);
        const long = block && block.last > block.first, note = where ?? (block && !long ? [block.name, ""] : null);
        if (long) marks.push(Decoration.widget({ widget: new Fold(this, block), side: -1 }).range(line.to));
        if (note) marks.push(Decoration.widget({ widget: new Note(note[0], note[1]), side: -1 }).range(line.to));
        at = line.to + 1;
      }
    }
    return Decoration.set(marks, true);
  }
}

/** Link a drawing and a list: the list shows the drawing's program, with common selection and playback. Return a
 * function that unlinks them, as a drawing outlives its lists.
 * @param {Drawing} drawing @param {Lines} list */
export function link(drawing, list) {
  // The toolpath "before" has no text: show the new program, with a note and without links.
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
