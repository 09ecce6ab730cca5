// Drawings of a page by the id of their element, for other elements.

/** @import { Drawing } from "./canvas.js" */

/** @type {Map<number, Drawing>} */
const drawings = new Map();
/** @type {Map<number, ((drawing: Drawing) => void)[]>} */
const waiting = new Map();

/** Register a drawing; null unregisters it.
 * @param {number} id @param {Drawing | null} drawing */
export function register(id, drawing) {
  if (!drawing) {
    drawings.delete(id);
    return;
  }
  drawings.set(id, drawing);
  (waiting.get(id) ?? []).forEach((act) => act(drawing));
  waiting.delete(id);
}

/** Call `act` with a drawing, now or when it is registered.
 * @param {number} id @param {(drawing: Drawing) => void} act */
export function whenThere(id, act) {
  const drawing = drawings.get(id);
  if (drawing) act(drawing);
  else waiting.set(id, [...(waiting.get(id) ?? []), act]);
}

/** Fetch the bytes of a scene; null if the server has removed it meanwhile.
 * @param {string} address */
export async function fetchScene(address) {
  const answer = await fetch((window.path_prefix ?? "") + address, { cache: "no-store" });
  return answer.status === 200 ? answer.arrayBuffer() : null;
}
