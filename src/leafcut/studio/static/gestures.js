// Pointer, wheel, touch and keys of a drawing.

/** @import { Point } from "./boxes.js" */
/** @import { Drawing } from "./canvas.js" */
/**
 * What a canvas does. `hover`: a pointer without a button moved. `press`: a pointer went down, the `first` or one more;
 * false ignores it. `drag`: the only pressed pointer moved, further than in a click or not. `release`: all was undone
 * if `cancelled`. `keys`: actions of further keys. `layer`: action of a letter with Shift. `escape`: Escape; return
 * whether it cancelled anything. `changed`: after each change.
 * @typedef {{
 *   hover(...place: Point): void, leave?(): void, press?(event: PointerEvent, place: Point, first: boolean): boolean,
 *   drag(dx: number, dy: number, place: Point, moved: boolean): void, release?(cancelled: boolean): void,
 *   click(...place: Point): void, keys(event: KeyboardEvent): Record<string, () => void>,
 *   layer?(letter: string): (() => void) | null, escape(): boolean, changed?(): void,
 * }} Actions
 */

const CLICK = 4; // maximum movement of a click, pixels
const ZOOM_STEP = 1.25;

/** Listen to the input of a canvas: a click, a drag with one pointer, a pinch with two, the wheel, and keys.
 * @param {HTMLCanvasElement} canvas @param {Drawing} drawing
 * @param {{ pan(dx: number, dy: number): void, zoom(factor: number, px?: number, py?: number): void }} view
 * @param {Actions} actions */
export function listen(canvas, drawing, view, actions) {
  /** @type {Map<number, Point>} */
  const pointers = new Map();
  let travelled = 0; // since a pointer went down, pixels

  /** @param {MouseEvent} event @returns {Point} */
  function placeOf(event) {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /** Pan and zoom by two fingers: the point between them stays between them.
   * @param {number} id @param {Point} before @param {Point} place */
  function pinch(id, before, place) {
    const [[, other]] = [...pointers].filter(([key]) => key !== id);
    const was = Math.hypot(before[0] - other[0], before[1] - other[1]), is = Math.hypot(place[0] - other[0], place[1] - other[1]);
    view.pan((place[0] - before[0]) / 2, (place[1] - before[1]) / 2);
    if (was > 0 && is > 0) view.zoom(is / was, (place[0] + other[0]) / 2, (place[1] + other[1]) / 2);
  }

  /** @param {PointerEvent} event */
  function up(event, cancelled = false) {
    const place = pointers.get(event.pointerId), moved = travelled > CLICK;
    pointers.delete(event.pointerId);
    canvas.classList.remove("lc-moving");
    if (!place) return;
    actions.release?.(cancelled || !moved);
    if (!cancelled && !moved && event.button === 0) actions.click(...place);
  }

  canvas.addEventListener("pointerdown", (event) => {
    const place = placeOf(event);
    if (actions.press?.(event, place, !pointers.size) === false) return;
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, place);
    travelled = pointers.size > 1 ? CLICK + 1 : 0;
    if (event.button > 0) event.preventDefault();
  });
  canvas.addEventListener("pointermove", (event) => {
    const place = placeOf(event), before = pointers.get(event.pointerId);
    if (!before) {
      actions.hover(...place);
      return;
    }
    const dx = place[0] - before[0], dy = place[1] - before[1];
    if (pointers.size === 2) pinch(event.pointerId, before, place);
    pointers.set(event.pointerId, place);
    travelled += Math.hypot(dx, dy);
    if (pointers.size === 1) actions.drag(dx, dy, place, travelled > CLICK);
    canvas.classList.toggle("lc-moving", travelled > CLICK);
    actions.changed?.();
  });
  canvas.addEventListener("pointerup", (event) => up(event));
  canvas.addEventListener("pointercancel", (event) => up(event, true));
  canvas.addEventListener("pointerleave", () => { if (!pointers.size) actions.leave?.(); });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const unit = [1, 16, canvas.clientHeight][event.deltaMode] ?? 1, place = placeOf(event);
    if (event.shiftKey) view.pan(-(event.deltaX || event.deltaY) * unit, 0);
    else view.zoom(Math.exp(-event.deltaY * unit * (event.ctrlKey ? 0.01 : 0.0016)), ...place);
    actions.hover(...place);
    actions.changed?.();
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    /** @type {Record<string, () => void>} */
    const keys = {
      "+": () => view.zoom(ZOOM_STEP), "=": () => view.zoom(ZOOM_STEP), "-": () => view.zoom(1 / ZOOM_STEP),
      " ": () => drawing.player.toggle(), ".": () => drawing.player.step(1), ",": () => drawing.player.step(-1),
      m: () => drawing.nextMode(), ...actions.keys(event),
    };
    // Plain letters keep the meaning of the page; layers use Shift.
    const act = event.shiftKey && /^[a-z]$/.test(key) ? actions.layer?.(key) : keys[key];
    if (key === "Escape" ? !actions.escape() : !act) return;
    event.preventDefault();
    act?.();
    actions.changed?.();
  });
}
