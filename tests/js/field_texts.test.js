import assert from "node:assert/strict";
import test from "node:test";

import { FieldTexts } from "../../src/leafcut/studio/static/field_texts.js";

test("a redraw between a change and its answer keeps the change; afterwards the field has the server's value", () => {
  const texts = new FieldTexts(7);
  texts.type("depth", "3");
  assert.deepEqual([texts.content("depth", "", 7), texts.content("speed", "900", 7)], ["3", "900"]);
  const number = texts.send("depth", "3");
  texts.leave();
  assert.equal(number, 8);
  assert.equal(texts.content("depth", "", 7), "3");
  const later = texts.send("speed", "1000");
  assert.deepEqual([texts.content("depth", "3mm", number), texts.content("speed", "900", number)], ["3mm", "1000"]);
  assert.equal(texts.content("speed", "900", later), "900"); // refused
});

test("of two changes of one field, the answer to the first does not undo the second", () => {
  const texts = new FieldTexts(0), first = texts.send("depth", "3"), second = texts.send("depth", "4");
  assert.equal(texts.content("depth", "3", first), "4");
  assert.equal(texts.content("depth", "4", second), "4");
  assert.equal(texts.content("depth", "", second), ""); // undone by the server
});
