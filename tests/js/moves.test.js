import assert from "node:assert/strict";
import test from "node:test";

import { Moves, longestRising } from "../../src/leafcut/studio/static/program_moves.js";
import { random } from "./scenes.js";

test("a longest increasing subsequence is as long as the best of all", () => {
  const next = random();
  for (let turn = 0; turn < 100; turn++) {
    const numbers = [...Array(9).keys()].sort(() => next() - 0.5), found = longestRising(numbers).map((k) => numbers[k]);
    assert.deepEqual(found, [...found].sort((a, b) => a - b));
    let best = 0;
    for (let set = 0; set < 512; set++) {
      const chosen = numbers.filter((_, k) => set & (1 << k));
      if (chosen.every((value, k) => !k || chosen[k - 1] < value)) best = Math.max(best, chosen.length);
    }
    assert.equal(found.length, best);
  }
});

test("as few blocks as possible have moved", () => {
  const order = [1, 2, 3, 8, 9, 4, 5, 6, 7, 10], pairs = order.map((old, k) => [old, k + 1]).sort((a, b) => a[0] - b[0]);
  const moves = new Moves(pairs.flat(), 10, 10), moved = order.filter((old) => moves.of(old, true).moved);
  assert.ok([[8, 9], [4, 5, 6, 7]].some((block) => block.every((old) => moved.includes(old)) && moved.length === block.length));
  assert.deepEqual([moves.other(8, true), moves.other(4, false), moves.of(9, true).there], [4, 8, 4]);
});

test("a line of only one program leads to the match before it", () => {
  const moves = new Moves([1, 1, 3, 2], 3, 3);
  assert.equal(moves.of(2, true), null);
  assert.deepEqual([moves.other(2, true), moves.other(3, false)], [1, 3]);
});
