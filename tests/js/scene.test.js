import assert from "node:assert/strict";
import test from "node:test";

import { describe } from "../../src/leafcut/studio/static/describe.js";
import { foldsOf } from "../../src/leafcut/studio/static/program_folds.js";
import { numberOrder, readScene } from "../../src/leafcut/studio/static/scene.js";
import { packed, part, toolpath } from "./scenes.js";

const WORDS = {
  hole: "Hole", point: "Point", move: "Rapid", cut: "Cut", arc: "Arc", dark: "Beam off", stand: "Standstill", ordered: "No.", line: "line", at: "at",
  piece: "Piece {number}",
};
const RAPID = 0, CUT = 1, CCW = 3, REST = 4;
/** Drills two holes; the second one in a canned cycle of two rows. */
const DRILLED = toolpath([
  { to: [0, 0, 5], doing: REST, seconds: 0 }, { to: [10, 0, 5], doing: RAPID, seconds: 2 }, { to: [10, 0, -1], doing: CUT, seconds: 3 },
  { to: [10, 30, 5], doing: RAPID, seconds: 4 }, { to: [10, 30, -1], doing: CUT, source: 4, line: 5 }, { to: [10, 30, 5], doing: CUT, source: 4, line: 5 },
], { stop: [2, 4] });

test("other bytes are refused with one line", () => {
  assert.throws(() => readScene(new ArrayBuffer(3)), /^Error: this is no scene of leafcut's$/);
  assert.equal(readScene(packed({ kind: "other" }, { a: Uint8Array.of(7) })).a[0], 7);
});

test("the position at a time is on the row being run", () => {
  assert.equal(DRILLED.duration, 11);
  assert.deepEqual(DRILLED.at(1), { row: 1, share: 0.5, x: 5, y: 0, z: 5 });
  assert.deepEqual(DRILLED.at(3.5), { row: 2, share: 0.5, x: 10, y: 0, z: 2 });
  assert.equal(DRILLED.at(11).row, 5);
  for (let time = 0; time < 11; time += 0.25) {
    assert.equal(DRILLED.rowAt(time), [...DRILLED.ends].findIndex((end) => end > time));
  }
});

test("half of a quarter circle is at 45 degrees", () => {
  const scene = toolpath([{ to: [1, 0, 0], doing: RAPID }, { to: [0, 1, 0], doing: CCW, arc: [0, 0, 1, 0, Math.PI / 2] }]);
  const [x, y] = scene.along(1, 0.5);
  assert.ok(Math.hypot(x - Math.SQRT1_2, y - Math.SQRT1_2) < 1e-6);
  assert.ok(Math.abs(scene.lengthOf(1) - Math.PI / 2) < 1e-6);
});

test("a row belongs to the stop at which it works or to which it moves", () => {
  assert.deepEqual([...Array(6).keys()].map((row) => DRILLED.stopOf(row)), [1, 1, 1, 2, 2, 2]);
  assert.deepEqual(DRILLED.together(5), [4, 5]);
  assert.equal(DRILLED.rowOfLine(5), 4);
  assert.equal(DRILLED.rowOfLine(99), -1);
});

test("every stop is numbered once, the ends first", () => {
  for (const count of [0, 1, 2, 250]) {
    assert.deepEqual(numberOrder(count).sort((a, b) => a - b), [...Array(count).keys()]);
  }
  assert.deepEqual(numberOrder(120).slice(0, 4), [0, 119, 99, 9]);
});

test("an edited order finds its nearest stop and keeps its signs", () => {
  const scene = readScene(packed({ kind: "path", origin: [5, 5], signs: { 1: "*" } }, {
    point: Float32Array.of(0, 0, 10, 0, 10, 0), visit: Uint32Array.of(3, 1, 2), held: Uint8Array.of(1, 1, 0), moved: new Uint8Array(3),
  }));
  assert.deepEqual(scene.near(15, 6, 2), { number: 1, from: [15, 5] });
  assert.equal(scene.near(15, 9, 2), null);
  assert.deepEqual([0, 1, 2].map((k) => scene.idle(k)), [false, true, false]);
  assert.deepEqual([scene.label(1), scene.label(2), scene.indexOf(2)], ["2*", "3", 2]);
});

test("a pierce is found by its number, the last of several at one position", () => {
  const scene = toolpath([{ to: [0, 0, 0] }], { pierce: [[0, 0, 1], [5, 0, 2], [5, 0, 3]] });
  assert.deepEqual(scene.pierceNear(5.5, 0, 1), { number: 3, from: [5, 0] });
  assert.equal(scene.pierceNear(5.5, 9, 1), null);
});

test("moves and holes are described in millimetres", () => {
  const main = { scene: DRILLED }, shown = { part: part({ holes: [[10, 30, 6]] }), main, differences: null, edited: null };
  assert.deepEqual(describe({ row: 3, which: "after" }, shown, WORDS), [
    "Rapid", "30.594 mm", "X 10.000  Y 0.000 → X 10.000  Y 30.000", "600 mm/min", "T1", "line 4", "at 5.00 s",
  ]);
  assert.deepEqual(describe({ hole: 0, row: 4 }, shown, WORDS), ["Hole 1", "Ø 6.000", "X 10.000  Y 30.000", "No. 2", "line 5"]);
  const issues = { issues: [["L1", "warning", "too small", ""]] };
  assert.deepEqual(describe({ issue: 0 }, { ...shown, part: part({ header: issues }) }, WORDS), ["L1", "too small"]);
});

test("blocks of a program start at each tool, or at the move to each task", () => {
  assert.deepEqual(foldsOf(DRILLED, "piece", 7, WORDS), [{ first: 2, last: 3, name: "Piece 1" }, { first: 4, last: 7, name: "Piece 2" }]);
  assert.equal(foldsOf(DRILLED, "tool", 7, WORDS), null);
  const two = toolpath([{ to: [0, 0, 0] }, { to: [1, 0, 0], tool: 2 }], { header: { tools: { 1: "Drill", 2: "Mill" } } });
  assert.deepEqual(foldsOf(two, "tool", 2, WORDS).map(({ name }) => name), ["Drill", "Mill"]);
});
