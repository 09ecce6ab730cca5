// Input of the view of the stock.

import { listen } from "./gestures.js";

/** @import { Solid } from "./solid.js" */

const TURN = 14, STEP = 30; // pixels of rotation and of panning per key press

/** Handle the input of a view of the stock.
 * @param {Solid} solid */
export function listenToSolid(solid) {
  const { camera, drawing, marks, over } = solid, fit = () => solid.fit();
  let pans = false;
  over.addEventListener("contextmenu", (event) => event.preventDefault());
  listen(over, drawing, camera, {
    hover: (px, py) => marks.move(px, py),
    leave: () => { if (!marks.on) drawing.say([]); },
    press: (event) => {
      pans = event.button > 0 || event.shiftKey;
      return true;
    },
    drag: (dx, dy, _, moved) => {
      if (!moved) return;
      if (pans) camera.pan(dx, dy); else camera.orbit(dx, dy);
    },
    click: (px, py) => {
      over.focus({ preventScroll: true });
      marks.press(px, py);
    },
    keys: ({ shiftKey }) => {
      const move = (/** @type {number} */ x, /** @type {number} */ y) => () => (shiftKey ? camera.pan(x * STEP, y * STEP) : camera.orbit(x * TURN, y * TURN));
      return {
        ArrowLeft: move(1, 0), ArrowRight: move(-1, 0), ArrowUp: move(0, 1), ArrowDown: move(0, -1), 0: fit, f: fit, Home: fit,
        d: () => marks.measure(undefined, true), Enter: () => marks.press(camera.width / 2, camera.height_px / 2),
        PageDown: () => marks.go(1), PageUp: () => marks.go(-1),
      };
    },
    escape: () => marks.escape() || drawing.escape(),
    changed: () => {
      if (marks.on && marks.byKey) marks.aim();
      solid.wake();
    },
  });
}
