// Foldable blocks of a program.

/** @import { ToolpathScene } from "./scene.js" */
/** @typedef {{ first: number, last: number, name: string }} Block */

/** Return the blocks of a program from its toolpath, {first, last, name}: one for each tool (`by` is "tool"), or one
 * for each task with the move to it. Null if there are fewer than two. Lines count from 1.
 * @param {ToolpathScene} scene @param {string} by @param {number} count @param {Record<string, string>} words */
export function foldsOf(scene, by, count, words) {
  const blocks = /** @type {Block[]} */ ([]);
  for (const [first, found] of by === "tool" ? tools(scene) : pieces(scene)) {
    // Repeated lines, as in a subprogram, do not start another block.
    if (first < 1 || first > count || first <= (blocks.at(-1)?.first ?? 0)) continue;
    const name = by === "tool" ? scene.toolWords(found) : words.piece.replace("{number}", found.toLocaleString());
    const before = blocks.at(-1);
    if (before) before.last = first - 1;
    blocks.push({ first, last: count, name });
  }
  return blocks.length < 2 ? null : blocks;
}

/** @param {ToolpathScene} scene */
function* tools(scene) {
  let tool = 0;
  for (let row = 0; row < scene.rows; row++) {
    if (scene.tool[row] === tool || !scene.line[row]) continue;
    tool = scene.tool[row];
    yield [scene.line[row], tool];
  }
}

/** Yield the tasks; each starts with the first travel move after the previous task.
 * @param {ToolpathScene} scene */
function* pieces(scene) {
  const { stop } = scene;
  for (let k = 0; k < stop.length; k++) {
    const from = k ? stop[k - 1] : -1;
    let row = stop[k];
    while (row - 1 > from && scene.source[row - 1] === scene.source[stop[k]]) row--;
    while (row - 1 > from && scene.idle(row - 1) && scene.source[row - 1] !== scene.source[from]) row--;
    yield [scene.line[row], k + 1];
  }
}
