// Descriptions of the object under the pointer or of the selection.

import { ARC_CCW, ARC_CW, CUT, DARK, RAPID } from "./scene.js";

/** Return a length in mm as text. */
export function mm(value) { return (Math.abs(value) < 5e-4 ? 0 : value).toFixed(3); }

/** Return seconds as text: 4.20 s, 1:02.5, 1:05:09. */
export function clockWords(seconds) {
  if (seconds < 60) return `${seconds.toFixed(seconds < 10 ? 2 : 1)} s`;
  const whole = Math.floor(seconds / 60), rest = seconds - 60 * whole;
  if (seconds < 3600) return `${whole}:${rest.toFixed(1).padStart(4, "0")}`;
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}:${String(Math.floor(rest)).padStart(2, "0")}`;
}

/** Return the description of a picked object as parts of a line, the name first. */
export function describe(what, pane, words) {
  if (what.issue !== undefined) {
    const [code, , message, place] = pane.part.header.issues[what.issue];
    return [code, message, place].filter(Boolean);
  }
  if (what.mark !== undefined) return pane.differences.header.differences[what.difference].slice(0, 2);
  if (what.stop && what.hole === undefined) return describeStop(what, pane, words);
  return what.hole !== undefined ? describeHole(what, pane, words) : describeMove(what.row, pane.main.scene, words);
}

/** Return the position of a stop in the edited order; empty if the search chooses it. */
function describeOrder(stop, { edited }, words) {
  const k = edited?.indexOf(stop) ?? -1;
  return k >= 0 && edited.held[k] ? [`${words.ordered} ${edited.label(k)}`] : [];
}

function describeStop({ stop }, pane, words) {
  const { edited } = pane, k = edited?.indexOf(stop) ?? -1;
  if (k < 0) return [];
  const x = edited.x1(k) + edited.origin[0], y = edited.y1(k) + edited.origin[1];
  return [words.cut, `X ${mm(x)}  Y ${mm(y)}`, ...describeOrder(stop, pane, words)];
}

function describeHole({ hole, row, stop }, pane, words) {
  const { part, main } = pane;
  const x = part.hole[3 * hole] + part.origin[0], y = part.hole[3 * hole + 1] + part.origin[1];
  const diameter = part.hole[3 * hole + 2], tool = part.holeTool[hole], said = [`${part.header.unitless ? words.point : words.hole} ${hole + 1}`];
  if (diameter > 0) said.push(`Ø ${mm(diameter)}`);
  said.push(`X ${mm(x)}  Y ${mm(y)}`);
  if (tool) said.push(main?.scene.toolWords(tool) || `T${tool}`);
  if (pane.edited) said.push(...describeOrder(stop, pane, words));
  else if (row !== undefined) {
    said.push(`${words.ordered} ${main.scene.stop.indexOf(row) + 1}`);
    if (main.scene.line[row]) said.push(`${words.line} ${main.scene.line[row]}`);
  }
  return said;
}

function describeMove(row, scene, words) {
  const what = scene.doing[row], { unitless } = scene.header, tool = scene.tool[row];
  const names = { [RAPID]: words.move, [CUT]: words.cut, [ARC_CW]: words.arc, [ARC_CCW]: words.arc, [DARK]: words.dark };
  const said = [names[what] ?? words.stand];
  const [ox, oy] = scene.origin, arc = scene.arcAt(row);
  if (scene.moves(row)) {
    said.push(`${mm(scene.lengthOf(row))}${unitless ? "" : " mm"}`);
    if (arc) said.push(`R ${mm(arc[2])}`);
    said.push(`X ${mm(scene.x0(row) + ox)}  Y ${mm(scene.y0(row) + oy)} → X ${mm(scene.x1(row) + ox)}  Y ${mm(scene.y1(row) + oy)}`);
  }
  if (unitless) return said;
  if (scene.feed[row] > 0) said.push(`${(scene.feed[row] * 60).toFixed(0)} mm/min`);
  if (tool) said.push(scene.toolWords(tool));
  if (scene.line[row]) said.push(`${words.line} ${scene.line[row]}`);
  said.push(`${words.at} ${clockWords(scene.startOf(row))}`);
  return said;
}
