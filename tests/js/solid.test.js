import assert from "node:assert/strict";
import test from "node:test";

import { SolidCamera, meet, sectioned } from "../../src/leafcut/studio/static/solid_camera.js";
import { COLOURINGS, FIXTURE, SCALE_END, paletteOf, toneCss } from "../../src/leafcut/studio/static/solid_colours.js";
import { SolidStock } from "../../src/leafcut/studio/static/solid_stock.js";
import { surface } from "../../src/leafcut/studio/static/sweep.js";
import { random } from "./scenes.js";

const GRID = { x: 0.5, y: 0.5, cell: 1, rows: 20, columns: 30 };
/** Radius, flat, corner, reach, rise, slope: an end mill and a ball nose of 3 mm. */
const END_MILL = [3, 3, 0, 3, 0, 0], BALL = [3, 0, 3, 3, 3, 0];

function stockOf(ends, shape) {
  const count = ends.length, seconds = [...Array(count + 1).keys()];
  return new SolidStock({ grid: GRID, top: 0, floor: -10, tools: { 1: { shape } } }, {
    move: Float32Array.from(ends.flat()), since: Float64Array.from(seconds.slice(0, -1)), until: Float64Array.from(seconds.slice(1)),
    row: Uint32Array.from(seconds.slice(0, -1)), cutter: new Uint32Array(count).fill(1), rapid: new Uint8Array(count),
  });
}

test("a ray through a pixel meets the point that is drawn there", () => {
  const camera = new SolidCamera(), next = random();
  camera.resize(600, 400);
  camera.fit([0, 0, -10, 30, 20, 0]);
  for (const from of ["iso", "top", "front"]) {
    camera.look(from);
    for (let turn = 0; turn < 20; turn++) {
      const [x, y, z] = [next() * 30, next() * 20, -next() * 10], [px, py, depth] = camera.project(x, y, z);
      const ray = camera.ray(px, py), [rx, ry, rz] = ray.from.map((value, k) => value + depth * ray.way[k]);
      assert.ok(Math.hypot(rx - x, ry - y, rz - z) < 1e-9);
    }
  }
});

test("from above, a pixel shows the height of its cell, and a section hides the nearer half", () => {
  const camera = new SolidCamera(), heights = new Float32Array(600), stock = { grid: GRID, heights, floor: -10, top: 0 };
  heights[5 * 30 + 7] = -4;
  camera.resize(600, 400);
  camera.fit([0, 0, -10, 30, 20, 0]);
  camera.look("top");
  const [px, py] = camera.project(7.5, 5.5, 0), box = sectioned(GRID, { axis: "", share: 0.5 }, camera);
  const { z, row, column } = meet(camera, stock, box, px, py);
  assert.deepEqual([Math.round(1e3 * z) / 1e3, row, column], [-4, 5, 7]);
  const half = sectioned(GRID, { axis: "y", share: 0.5 }, camera);
  assert.deepEqual([half.cut, half.y0, half.y1], ["y0", 10, 20]);
  assert.equal(meet(camera, stock, half, px, py), null);
});

test("a tool leaves its own shape where it plunges", () => {
  for (const shape of [END_MILL, BALL]) {
    const stock = stockOf([[15.5, 10.5, 5, 15.5, 10.5, -2]], shape);
    assert.equal(stock.seek(1), true);
    for (let row = 0; row < 20; row++) {
      for (let column = 0; column < 30; column++) {
        const r = Math.hypot(column - 15, row - 10), expected = r <= 3 ? Math.min(0, -2 + surface(shape, r)) : 0;
        assert.ok(Math.abs(stock.heights[row * 30 + column] - expected) < 1e-5);
      }
    }
  }
});

test("going back shows the same stock as going there", () => {
  const next = random(), ends = Array.from({ length: 40 }, () => [next() * 30, next() * 20, -next() * 3, next() * 30, next() * 20, -next() * 3]);
  const there = stockOf(ends, BALL), back = stockOf(ends, BALL);
  back.seek(40);
  for (const time of [31.5, 7.25, 0]) {
    const fresh = stockOf(ends, BALL);
    fresh.seek(time);
    back.seek(time);
    assert.deepEqual(back.heights, fresh.heights);
    assert.deepEqual(back.by, fresh.by);
  }
  there.seek(12);
  assert.ok(there.changes().rect.every((value, k) => value >= 0 && value <= [30, 20, 30, 20][k]));
  assert.equal(there.changes(), null);
});

test("scales get darker from one end to the other", () => {
  const lightness = (colour) => 0.3 * (colour >> 16) + 0.59 * ((colour >> 8) & 255) + 0.11 * (colour & 255);
  for (const colouring of COLOURINGS.filter((name) => name !== "metal")) {
    const scale = paletteOf(colouring, false).slice(1, SCALE_END + 1).map(lightness);
    assert.ok(scale.every((value, k) => !k || value <= scale[k - 1] + 1.5));
  }
  assert.equal(`#${paletteOf("depth", true)[FIXTURE].toString(16)}`, toneCss(FIXTURE));
});
