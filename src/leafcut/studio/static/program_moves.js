// Positions of the lines of a program in its reordered version. Lines count from 1; 0 is no line.

import { firstWhere } from "./search.js";

/** Blocks of lines, of which as few as possible count as moved. */
export class Moves {
  /** `pairs` contains old and new number of each common line, ascending by the old number.
   * @param {ArrayLike<number>} pairs @param {number} oldCount @param {number} newCount */
  constructor(pairs, oldCount, newCount) {
    this.oldCount = oldCount;
    this.newOf = new Uint32Array(oldCount + 1);
    this.oldOf = new Uint32Array(newCount + 1);
    for (let k = 0; k < pairs.length; k += 2) {
      this.newOf[pairs[k]] = pairs[k + 1];
      this.oldOf[pairs[k + 1]] = pairs[k];
    }
    /** Block of each line of the original, first lines of the blocks, and the blocks that moved. */
    this.block = new Uint32Array(oldCount + 1);
    this.first = this._divide();
    this.moved = new Set(this.first.keys());
    for (const block of longestRising(this.first.map((line) => this.newOf[line]))) this.moved.delete(block);
  }

  /** Return the block of a line of the original (`old`) or of the new program: whether it starts with this line, its
   * start in the other program, whether it moved, and its relative position in the original (0 … 1). Null for a line
   * that only one of the programs has.
   * @param {number} line @param {boolean} old */
  of(line, old) {
    const own = old ? line : this.oldOf[line];
    if (!own || !this.newOf[own]) return null;
    const block = this.block[own], first = this.first[block];
    const here = old ? first : this.newOf[first], there = old ? this.newOf[first] : first;
    return { begins: line === here, there, moved: this.moved.has(block), part: first / this.oldCount };
  }

  /** Return the matching line of the other program, or else that of the nearest earlier line with a match.
   * @param {number} line @param {boolean} old */
  other(line, old) {
    const of = old ? this.newOf : this.oldOf;
    for (let at = line; at > 0; at--) if (of[at]) return of[at];
    return 0;
  }

  /** Divide the original into blocks of lines that are also consecutive in the new program; return their first lines. */
  _divide() {
    const { newOf } = this, first = [];
    let before = 0;
    for (let line = 1; line < newOf.length; line++) {
      if (!newOf[line]) continue;
      if (!before || newOf[line] !== newOf[before] + (line - before)) first.push(line);
      this.block[line] = first.length - 1;
      before = line;
    }
    return first;
  }
}

/** Return the indices of a longest increasing subsequence of different numbers.
 * @param {number[]} numbers */
export function longestRising(numbers) {
  const ends = /** @type {number[]} */ ([]), before = new Int32Array(numbers.length).fill(-1);
  for (let k = 0; k < numbers.length; k++) {
    const rank = firstWhere(ends.length, (end) => numbers[ends[end]] >= numbers[k]);
    if (rank) before[k] = ends[rank - 1];
    ends[rank] = k;
  }
  const chosen = [];
  for (let at = ends.at(-1) ?? -1; at >= 0; at = before[at]) chosen.push(at);
  return chosen.reverse();
}
