// Descriptions of the object under the pointer or of the selection.

import { ARC_CCW, ARC_CW, CUT, DARK, RAPID } from "./scene.js";

/** @import { DifferenceScene, PartScene, PathScene, ToolpathScene } from "./scene.js" */

/**
 * A picked object, with its toolpath ("before" or "after"), and the number of its stop in an edited order, from 1.
 * @typedef {{
 *   issue?: number, mark?: number, difference?: number, hole?: number, row?: number, which?: string, line?: number,
 *   stop?: number, layer?: string,
 * }} Picked
 * @typedef {Record<string, string>} Words
 */

/**
 * Scenes of a pane.
 * @typedef {{
 *   part: PartScene | null, differences: DifferenceScene | null, edited: PathScene | null,
 *   main: { scene: ToolpathScene } | null,
 * }} Shown
 */

/** Return a length in mm as text.
 * @param {number} value */
export function mm(value) { return (Math.abs(value) < 5e-4 ? 0 : value).toFixed(3); }

/** Return x and y in mm as text.
 * @param {number} x @param {number} y */
export function xy(x, y) { return `X ${mm(x)}  Y ${mm(y)}`; }

/** Return seconds as text: 4.20 s, 1:02.5, 1:05:09.
 * @param {number} seconds */
export function clockWords(seconds) {
  const tenths = Math.round(10 * seconds), minutes = Math.floor(tenths / 600), rest = (tenths % 600) / 10;
  if (minutes < 1) return `${seconds.toFixed(seconds < 10 ? 2 : 1)} s`;
  if (minutes < 60) return `${minutes}:${rest.toFixed(1).padStart(4, "0")}`;
  return [Math.floor(minutes / 60), ...[minutes % 60, Math.floor(rest)].map((part) => String(part).padStart(2, "0"))].join(":");
}

/** Return the description of a picked object as parts of a line, the name first.
 * @param {Picked} what @param {Shown} shown @param {Words} words @returns {string[]} */
export function describe(what, shown, words) {
  const { part, differences, main } = shown;
  if (what.issue !== undefined) {
    const [code, , message, place] = part?.header.issues[what.issue] ?? [];
    return [code, message, place].filter(Boolean);
  }
  if (what.difference !== undefined) return differences?.header.differences[what.difference].slice(0, 2) ?? [];
  if (what.hole !== undefined) return part ? describeHole(what.hole, what, part, shown, words) : [];
  if (what.layer !== undefined) return [what.layer].filter(Boolean);
  if (what.stop) return describeStop(what.stop, shown, words);
  return main && what.row !== undefined ? describeMove(what.row, main.scene, words) : [];
}

/** Return the position of a stop in the edited order; empty if the search chooses it.
 * @param {number | undefined} stop @param {PathScene} edited @param {Words} words */
function describeOrder(stop, edited, words) {
  const k = stop ? edited.indexOf(stop) : -1;
  return k >= 0 && edited.held[k] ? [`${words.ordered} ${edited.label(k)}`] : [];
}

/** @param {number} stop @param {Shown} shown @param {Words} words */
function describeStop(stop, { edited }, words) {
  const k = edited ? edited.indexOf(stop) : -1;
  if (!edited || k < 0) return [];
  const [ox, oy] = edited.origin;
  return [words.cut, xy(edited.x1(k) + ox, edited.y1(k) + oy), ...describeOrder(stop, edited, words)];
}

/** @param {number} hole @param {Picked} what @param {PartScene} part @param {Shown} shown @param {Words} words */
function describeHole(hole, { row, stop }, part, { main, edited }, words) {
  const diameter = 2 * part.holeRadius(hole), tool = part.holeTool[hole], scene = main?.scene;
  const parts = [`${part.header.unitless ? words.point : words.hole} ${hole + 1}`];
  if (diameter > 0) parts.push(`Ø ${mm(diameter)}`);
  parts.push(xy(...part.holePlace(hole)));
  if (tool) parts.push(scene?.toolWords(tool) || `T${tool}`);
  if (edited) parts.push(...describeOrder(stop, edited, words));
  else if (scene && row !== undefined) {
    parts.push(`${words.ordered} ${scene.stop.indexOf(row) + 1}`);
    if (scene.line[row]) parts.push(`${words.line} ${scene.line[row]}`);
  }
  return parts;
}

/** @param {number} row @param {ToolpathScene} scene @param {Words} words */
function describeMove(row, scene, words) {
  const { unitless } = scene.header, tool = scene.tool[row], arc = scene.arcAt(row), [ox, oy] = scene.origin;
  /** @type {Record<number, string>} */
  const names = { [RAPID]: words.move, [CUT]: words.cut, [ARC_CW]: words.arc, [ARC_CCW]: words.arc, [DARK]: words.dark };
  const parts = [names[scene.doing[row]] ?? words.stand];
  if (scene.moves(row)) {
    parts.push(`${mm(scene.lengthOf(row))}${unitless ? "" : " mm"}`);
    if (arc) parts.push(`R ${mm(arc[2])}`);
    parts.push(`${xy(scene.x0(row) + ox, scene.y0(row) + oy)} → ${xy(scene.x1(row) + ox, scene.y1(row) + oy)}`);
  }
  if (unitless) return parts;
  if (scene.feed[row] > 0) parts.push(`${(scene.feed[row] * 60).toFixed(0)} mm/min`);
  if (tool) parts.push(scene.toolWords(tool));
  if (scene.line[row]) parts.push(`${words.line} ${scene.line[row]}`);
  parts.push(`${words.at} ${clockWords(scene.startOf(row))}`);
  return parts;
}
