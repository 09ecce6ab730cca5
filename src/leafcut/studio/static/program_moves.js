// Positions of the lines of a program in its reordered version. Lines count from 1; 0 is no line.

export class Moves {
  /** `pairs` contains old and new number of each common line, ascending by the old number. */
  constructor(pairs, oldCount, newCount) {
    this.oldCount = oldCount;
    this.newOf = new Uint32Array(oldCount + 1);
    this.oldOf = new Uint32Array(newCount + 1);
    for (let k = 0; k < pairs.length; k += 2) {
      this.newOf[pairs[k]] = pairs[k + 1];
      this.oldOf[pairs[k + 1]] = pairs[k];
    }
    this._divide();
  }

  /** Return the block of a line of the original (`old`) or of the new program: whether it starts with this line, its
   * start in the other program, whether it moved, and its relative position in the original (0 … 1). Null for a line
   * that only one of the programs has. */
  of(line, old) {
    const own = old ? line : this.oldOf[line];
    if (!own || !this.newOf[own]) return null;
    const block = this.block[own], first = this.first[block];
    const here = old ? first : this.newOf[first], there = old ? this.newOf[first] : first;
    return { begins: line === here, there, moved: Boolean(this.moved[block]), part: first / this.oldCount };
  }

  /** Return the matching line of the other program, or else that of the nearest earlier line with a match. */
  other(line, old) {
    const of = old ? this.newOf : this.oldOf;
    for (let at = line; at > 0; at--) if (of[at]) return of[at];
    return 0;
  }

  /** Divide the original into blocks of lines that are also consecutive in the new program. As few blocks as possible
   * count as moved. */
  _divide() {
    const { newOf } = this, first = [];
    this.block = new Uint32Array(newOf.length);
    let before = 0;
    for (let line = 1; line < newOf.length; line++) {
      if (!newOf[line]) continue;
      if (!before || newOf[line] !== newOf[before] + (line - before)) first.push(line);
      this.block[line] = first.length - 1;
      before = line;
    }
    this.first = Uint32Array.from(first);
    this.moved = new Uint8Array(first.length).fill(1);
    for (const block of longestRising(first.map((line) => newOf[line]))) this.moved[block] = 0;
  }
}

/** Return the indices of a longest increasing subsequence of different numbers. */
export function longestRising(numbers) {
  const ends = [], before = new Int32Array(numbers.length).fill(-1);
  for (let k = 0; k < numbers.length; k++) {
    let low = 0, high = ends.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (numbers[ends[middle]] < numbers[k]) low = middle + 1; else high = middle;
    }
    if (low) before[k] = ends[low - 1];
    ends[low] = k;
  }
  const chosen = [];
  for (let at = ends.at(-1) ?? -1; at >= 0; at = before[at]) chosen.push(at);
  return chosen.reverse();
}
