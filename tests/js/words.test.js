import assert from "node:assert/strict";
import test from "node:test";

import { clockWords, mm } from "../../src/leafcut/studio/static/describe.js";
import { matchingGroups, matchingOffers } from "../../src/leafcut/studio/static/option_filter.js";
import { keep, readKept } from "../../src/leafcut/studio/static/solid_kept.js";
import { colourOf, isDark } from "../../src/leafcut/studio/static/theme.js";
import { niceStep, tickWords, View } from "../../src/leafcut/studio/static/view.js";

test("times are rounded before they are split into minutes and hours", () => {
  const words = { 0: "0.00 s", 4.2: "4.20 s", 59.94: "59.9 s", 59.96: "1:00.0", 62.5: "1:02.5", 119.97: "2:00.0", 3599.97: "1:00:00", 3909: "1:05:09" };
  for (const [seconds, text] of Object.entries(words)) assert.equal(clockWords(Number(seconds)), text);
});

test("a length that rounds to zero has no sign", () => {
  assert.deepEqual([mm(-1e-4), mm(-1.2346), mm(2)], ["0.000", "-1.235", "2.000"]);
});

test("steps of rulers are 1, 2 or 5 times a power of ten", () => {
  for (let least = 1e-3; least < 1e3; least *= 1.3) {
    const step = niceStep(least), digit = Math.round(step / 10 ** Math.floor(Math.log10(step) + 1e-9));
    assert.ok([1, 2, 5].includes(digit) && step >= least * (1 - 1e-9) && step < 2.5 * least * (1 + 1e-9));
  }
  assert.deepEqual([tickWords(0.05, 0.01), tickWords(-1e-9, 1), tickWords(20, 10)], ["0.05", "0", "20"]);
});

test("zooming keeps the point under the pointer, and a fitted box is visible", () => {
  const view = new View();
  view.resize(800, 400);
  view.fit([-10, 5, 90, 25], [46, 30, 18, 22]);
  assert.ok(view.toX(-10) >= 46 && view.toX(90) <= 782 && view.toY(25) >= 30 && view.toY(5) <= 378);
  const before = [view.mmX(100), view.mmY(50)];
  view.zoom(3, 100, 50);
  assert.ok(Math.hypot(view.mmX(100) - before[0], view.mmY(50) - before[1]) < 1e-9);
});

test("options are found by words without accents, capitals and hyphens", () => {
  const field = (name, label, help = "") => ({ name, label, help });
  const groups = [{ key: "a", fields: [field("step_over", "Paso lateral"), field("depth", "Profundidad", "Tool-length")] }, { key: "b", fields: [field("x", "Ángulo")] }];
  const names = (wanted) => matchingGroups(groups, wanted).flatMap(({ fields }) => fields.map(({ name }) => name));
  assert.equal(matchingGroups(groups, "  "), groups);
  assert.deepEqual([names("step over"), names("tool length PROF"), names("angulo"), names("none")], [["step_over"], ["depth"], ["x"], []]);
});

test("suggestions are found by value and text", () => {
  const offers = [["6", "6 mm"], ["0.25in", "1/4 inch"]];
  assert.deepEqual([matchingOffers(offers, ""), matchingOffers(offers, " INCH"), matchingOffers(offers, "x")], [offers, [offers[1]], []]);
});

test("a kept view comes back, and invalid values become defaults", () => {
  const values = {}, storage = { getItem: (key) => values[key] ?? null, setItem: (key, value) => { values[key] = value; } };
  assert.equal(readKept(storage), null);
  keep(storage, { space: "both", solid: { colouring: "feed", section: { axis: "y", share: 0.25 }, shows: { tool: false, path: true } } });
  assert.deepEqual(readKept(storage), { space: "both", colouring: "feed", axis: "y", share: 0.25, tool: false, path: true });
  const kept = (text) => readKept({ getItem: () => text });
  assert.deepEqual([kept("{"), kept("7"), readKept(null)], [null, null, null]);
  const usual = { space: "plan", colouring: "metal", axis: "", share: 0.5, tool: true, path: false };
  assert.deepEqual(kept('{"space": "up", "colouring": 3, "axis": "z", "share": 9}'), usual);
});

test("a single layer or tool has a neutral colour", () => {
  const colours = { idle: "#888888", t0: "#000001", t1: "#000002" };
  assert.deepEqual([colourOf(colours, ["a"], "a"), colourOf(colours, ["a"], "a", "#ffffff")], ["#888888", "#ffffff"]);
  assert.deepEqual(["a", "b", "c"].map((name) => colourOf(colours, ["a", "b"], name)), ["#000001", "#000002", "#888888"]);
  assert.deepEqual([isDark("#202020"), isDark("#fafafa")], [true, false]);
});
