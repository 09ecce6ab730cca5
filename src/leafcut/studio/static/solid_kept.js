// Saved view of the stock for the next page: plan or solid, section, colour, tool and path.

import { COLOURINGS } from "./solid_colours.js";

/** @typedef {Pick<Storage, "getItem" | "setItem"> | null} Store */

/** Views: the plan, the stock in 3D, or both side by side. */
export const SPACES = ["plan", "solid", "both"];

const KEY = "leafcut-solid", AXES = ["", "x", "y"];

/** Return the saved view, or null; invalid values are replaced by defaults.
 * @param {Store} storage */
export function readKept(storage) {
  let found = null;
  try {
    found = JSON.parse(storage?.getItem(KEY) ?? "null");
  } catch {
    return null; // from another version, or without storage
  }
  if (!found || typeof found !== "object") return null;
  const one = (/** @type {string} */ value, /** @type {string[]} */ known) => (known.includes(value) ? value : known[0]), share = Number(found.share);
  return {
    space: one(found.space, SPACES), colouring: one(found.colouring, COLOURINGS), axis: one(found.axis, AXES),
    share: share >= 0 && share <= 1 ? share : 0.5, tool: found.tool !== false, path: found.path === true,
  };
}

/** Save the view of the stock.
 * @param {Store} storage
 * @param {{ space: string, solid: { colouring: string, section: { axis: string, share: number }, shows: Record<string, boolean> } }} view */
export function keep(storage, { space, solid }) {
  const { colouring, section: { axis, share }, shows: { tool, path } } = solid;
  try {
    storage?.setItem(KEY, JSON.stringify({ space, colouring, axis, share, tool, path }));
  } catch {
    // The view works without storage.
  }
}
