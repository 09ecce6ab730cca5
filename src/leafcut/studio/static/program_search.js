// Text search in a program: in its bytes, a slice at a time, so that the page stays responsive with millions of lines.

const SLICE = 4e6; // bytes searched between two pauses
const LOWER = 32; // difference between A and a

/** Return the lines (from 1, ascending) that contain a text, ignoring case; null if `given` reports a cancellation. */
export async function findLines(bytes, starts, words, given = () => false) {
  const needle = new TextEncoder().encode(words.toLowerCase()), found = [];
  if (!needle.length) return found;
  const upper = needle.map((byte) => (isLetter(byte) ? byte - LOWER : byte));
  let line = 0, at = 0;
  while (at < bytes.length) {
    if (at) await new Promise((go) => setTimeout(go));
    if (given()) return null;
    const end = Math.min(at + SLICE, bytes.length);
    for (let hit = next(bytes, needle, upper, at, end); hit >= 0; hit = next(bytes, needle, upper, starts[line], end)) {
      line = lineOf(starts, hit, line);
      found.push(line);
    }
    at = Math.max(end, starts[line]);
  }
  return found;
}

/** Return the next position of the needle before `end`, or -1. */
function next(bytes, needle, upper, from, end) {
  const last = Math.min(end, bytes.length - needle.length + 1), low = needle[0], high = upper[0];
  for (let k = from; k < last; k++) {
    if (bytes[k] !== low && bytes[k] !== high) continue;
    let same = 1;
    while (same < needle.length && (bytes[k + same] === needle[same] || bytes[k + same] === upper[same])) same++;
    if (same === needle.length) return k;
  }
  return -1;
}

function isLetter(byte) { return byte >= 97 && byte <= 122; }

/** Return the line (from 1) of a byte, not before `from`. */
function lineOf(starts, byte, from) {
  let low = from, high = starts.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (starts[middle] <= byte) low = middle + 1; else high = middle;
  }
  return low;
}

/** Highlights matches in visible rows with the browser's highlights, without changing the text. */
export class Marked {
  constructor() {
    if (!window.Highlight) return;
    this.all = CSS.highlights.get("lc-found") ?? new Highlight();
    CSS.highlights.set("lc-found", this.all);
    this.mine = [];
  }

  show(rows, words) {
    if (!this.all) return;
    this.mine.forEach((range) => this.all.delete(range));
    this.mine = [];
    const wanted = words.toLowerCase();
    if (!wanted) return;
    for (const row of rows.querySelectorAll(".lc-line")) this._row(row, wanted);
  }

  _row(row, wanted) {
    const parts = [...row.childNodes].filter((node) => !node.matches?.(".lc-number, .lc-fold, .lc-unfolded, .lc-held, .lc-where"));
    const nodes = parts.map((node) => (node.nodeType === Node.TEXT_NODE ? node : node.firstChild)).filter(Boolean);
    const text = nodes.map((node) => node.data).join("").toLowerCase();
    for (let at = text.indexOf(wanted); at >= 0; at = text.indexOf(wanted, at + wanted.length)) {
      const range = new Range();
      range.setStart(...placeIn(nodes, at));
      range.setEnd(...placeIn(nodes, at + wanted.length));
      this.all.add(range);
      this.mine.push(range);
    }
  }
}

function placeIn(nodes, at) {
  let left = at;
  for (const node of nodes) {
    if (left <= node.data.length) return [node, left];
    left -= node.data.length;
  }
  return [nodes.at(-1), nodes.at(-1).data.length];
}
