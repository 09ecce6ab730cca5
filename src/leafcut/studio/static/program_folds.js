// Foldable blocks of a program, each with a visible head. Lines count from 1, rows from 0.

import { DARK, RAPID } from "./scene.js";

export class Folds {
  /** `starts`: first line of every block, ascending; `names`: index of a block → its name. */
  constructor(starts, count, names = () => "") {
    this.starts = starts;
    this.count = count;
    this.names = names;
    this.closed = new Uint8Array(starts.length).fill(1);
    this._number();
  }

  set(head, closed) {
    const block = this._blockOf(head);
    if (block < 0) return;
    this.closed[block] = closed ? 1 : 0;
    this._number();
  }

  setAll(closed) {
    this.closed.fill(closed ? 1 : 0);
    this._number();
  }

  isHead(line) {
    const block = this._blockOf(line);
    return block >= 0 && this.starts[block] === line;
  }

  isClosed(head) { return Boolean(this.closed[this._blockOf(head)]); }

  /** Return the head of a line's block; 0 before the first block. */
  headOf(line) {
    const block = this._blockOf(line);
    return block < 0 ? 0 : this.starts[block];
  }

  /** Whether a line is hidden. */
  hides(line) {
    const block = this._blockOf(line);
    return block >= 0 && Boolean(this.closed[block]) && this.starts[block] !== line;
  }

  /** Return the number of lines of a block. */
  sizeOf(head) {
    const block = this._blockOf(head);
    return (this.starts[block + 1] ?? this.count + 1) - this.starts[block];
  }

  nameOf(head) { return this.names(this._blockOf(head)); }

  /** Return the row of a line; for a hidden line the row of its head. */
  rowOf(line) {
    const block = this._blockOf(line);
    if (block < 0) return line - 1;
    return this.rows[block] + (this.closed[block] ? 0 : line - this.starts[block]);
  }

  lineAt(row) {
    const block = last(this.rows, row);
    return block < 0 ? row + 1 : this.starts[block] + (row - this.rows[block]);
  }

  _blockOf(line) { return last(this.starts, line); }

  /** Compute the row of every head, and the number of rows. */
  _number() {
    const { starts, closed, count } = this;
    this.rows ??= new Uint32Array(starts.length);
    let row = starts.length ? starts[0] - 1 : count;
    for (let k = 0; k < starts.length; k++) {
      this.rows[k] = row;
      row += closed[k] ? 1 : (starts[k + 1] ?? count + 1) - starts[k];
    }
    this.length = row;
  }
}

/** Return the index of the last ascending number that is at most `value`, or -1. */
function last(rising, value) {
  let low = 0, high = rising.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rising[middle] <= value) low = middle + 1; else high = middle;
  }
  return low - 1;
}

/** Return the blocks of a program from its toolpath: one per `tool`, or one per `piece` of work including the move to
 * it; null if there are fewer than two. */
export function foldsOf(scene, by, count, words) {
  const found = by === "tool" ? tools(scene) : pieces(scene);
  const lines = [], names = [];
  for (const [line, name] of found) {
    // Repeated lines, as in a subprogram, do not start another block.
    if (line < 1 || line > count || (lines.length && line <= lines.at(-1))) continue;
    lines.push(line);
    names.push(name);
  }
  if (lines.length < 2) return null;
  const named = by === "tool" ? (k) => scene.toolWords(names[k]) : (k) => words.piece.replace("{number}", names[k].toLocaleString());
  return new Folds(Uint32Array.from(lines), count, named);
}

function* tools(scene) {
  let tool = 0;
  for (let row = 0; row < scene.rows; row++) {
    if (scene.tool[row] === tool || !scene.line[row]) continue;
    tool = scene.tool[row];
    yield [scene.line[row], tool];
  }
}

/** Yield the tasks; each starts with the first travel move after the previous task. */
function* pieces(scene) {
  const { stop } = scene;
  for (let k = 0; k < stop.length; k++) {
    const from = k ? stop[k - 1] : -1;
    let row = stop[k];
    while (row - 1 > from && scene.source[row - 1] === scene.source[stop[k]]) row--;
    while (row - 1 > from && isWay(scene, row - 1) && scene.source[row - 1] !== scene.source[from]) row--;
    yield [scene.line[row], k + 1];
  }
}

function isWay(scene, row) { return scene.doing[row] === RAPID || scene.doing[row] === DARK; }
