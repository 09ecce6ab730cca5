import assert from "node:assert/strict";
import test from "node:test";

import { boxAround, emptyBox, isVisible, widen } from "../../src/leafcut/studio/static/boxes.js";
import { Grid, distanceToMove, gridOfMoves } from "../../src/leafcut/studio/static/hit_test.js";
import { Places, placesOfPart } from "../../src/leafcut/studio/static/measure.js";
import { boxOf } from "../../src/leafcut/studio/static/outline_paths.js";
import { firstWhere, nearest } from "../../src/leafcut/studio/static/search.js";
import { part, random, toolpath } from "./scenes.js";

const next = random();

test("the first index that holds is found, or the count", () => {
  for (let count = 0; count < 8; count++) {
    for (let from = 0; from <= count; from++) assert.equal(firstWhere(count, (k) => k >= from), from);
  }
});

test("of equally near items the last or the first is taken, and none beyond the reach", () => {
  const away = [2, 1, 3, 1];
  assert.equal(nearest(away.keys(), 5, (k) => away[k]), 3);
  assert.equal(nearest(away.keys(), 5, (k) => away[k], "first"), 1);
  assert.equal(nearest(away.keys(), 1, (k) => away[k]), 3);
  assert.equal(nearest(away.keys(), 0.5, (k) => away[k]), -1);
});

test("a grid yields every segment within reach", () => {
  const segments = Array.from({ length: 60 }, () => [next() * 100, next() * 50, next() * 100, next() * 50]);
  const grid = new Grid([0, 0, 100, 50], segments.length, (k, put) => put(...segments[k]));
  for (let turn = 0; turn < 200; turn++) {
    const [x, y, reach] = [next() * 140 - 20, next() * 90 - 20, next() * 10], found = new Set(grid.around(x, y, reach));
    for (const [k, [x0, y0, x1, y1]] of segments.entries()) {
      const near = Array.from({ length: 101 }, (_, n) => Math.hypot(x0 + (n / 100) * (x1 - x0) - x, y0 + (n / 100) * (y1 - y0) - y)).some((d) => d <= reach);
      if (near) assert.ok(found.has(k));
    }
  }
});

test("a snap point is the nearest of all", () => {
  const all = Array.from({ length: 80 }, () => [next() * 100, next() * 10]), places = new Places(all);
  for (let turn = 0; turn < 200; turn++) {
    const [x, y, reach] = [next() * 120 - 10, next() * 30 - 10, next() * 20];
    const least = Math.min(...all.map(([px, py]) => Math.hypot(px - x, py - y))), found = places.near(x, y, reach);
    assert.equal(found ? Math.hypot(found[0] - x, found[1] - y) : null, least <= reach ? least : null);
  }
});

test("the centre of a circle is a snap point", () => {
  const circle = { vertices: [[10, 20, 1], [30, 20, 1]] };
  assert.deepEqual([...placesOfPart(part({ outlines: [circle] }), new Set())], [[10, 20], [30, 20], [20, 20]]);
});

test("the distance from an arc is that of its nearest point", () => {
  for (const sweep of [1.5, -4, 2 * Math.PI]) {
    const [cx, cy, radius, start] = [3, 4, 5, 0.5], end = [cx + radius * Math.cos(start + sweep), cy + radius * Math.sin(start + sweep), 0];
    const from = [cx + radius * Math.cos(start), cy + radius * Math.sin(start), 0];
    const scene = toolpath([{ to: from, doing: 0 }, { to: end, doing: sweep < 0 ? 2 : 3, arc: [cx, cy, radius, start, sweep] }]);
    for (let turn = 0; turn < 50; turn++) {
      const [x, y] = [next() * 20 - 7, next() * 20 - 6];
      const least = Math.min(...Array.from({ length: 2001 }, (_, n) => {
        const angle = start + (n / 2000) * sweep;
        return Math.hypot(cx + radius * Math.cos(angle) - x, cy + radius * Math.sin(angle) - y);
      }));
      assert.ok(Math.abs(distanceToMove(scene, 1, x, y) - least) < 1e-2);
      assert.ok([...gridOfMoves(scene).around(x, y, least + 0.1)].includes(1));
    }
  }
});

test("the box of an outline contains its arcs", () => {
  for (let turn = 0; turn < 50; turn++) {
    const [x0, y0, x1, y1, bulge] = [next() * 10, next() * 10, next() * 10, next() * 10, next() * 4 - 2];
    const box = boxOf(part({ outlines: [{ vertices: [[x0, y0, bulge], [x1, y1, 0]], closed: false }] }), 0);
    // The middle of an arc is half a chord times the bulge away from the middle of the chord.
    const middle = [(x0 + x1) / 2 + (bulge / 2) * (y1 - y0), (y0 + y1) / 2 - (bulge / 2) * (x1 - x0)];
    for (const [x, y] of [[x0, y0], [x1, y1], middle]) {
      assert.ok(x >= box[0] - 1e-5 && x <= box[2] + 1e-5 && y >= box[1] - 1e-5 && y <= box[3] + 1e-5);
    }
  }
});

test("boxes are joined, and seen if they touch the visible range", () => {
  const box = emptyBox();
  widen(box, 1, 2);
  widen(box, -1, 3, 4, 5);
  assert.deepEqual(box, [-1, 2, 4, 5]);
  assert.deepEqual(boxAround([null, box, [9, 9, 10, 10], undefined]), [-1, 2, 10, 10]);
  assert.equal(boxAround([null]), null);
  assert.equal(isVisible(box, [10, 0], [14, 0, 20, 9]), true);
  assert.equal(isVisible(box, [10, 0], [14.5, 0, 20, 9]), false);
  assert.equal(isVisible(box, [10, 0], [14.5, 0, 20, 9], 1), true);
});
