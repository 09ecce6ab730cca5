// Pointer, wheel, touch and keys of a pane.

import { KEYS, LAYERS } from "./toolbar.js";

const CLICK = 4; // maximum movement of a click, pixels
const PAN_STEP = 0.12; // fraction of the pane per key press
const ZOOM_STEP = 1.25;

/** Handles the input of a pane, and reports hover, selection and dragging to `drawing`. */
export class Input {
  constructor(pane, drawing) {
    this.pane = pane;
    this.view = pane.view;
    this.drawing = drawing;
    this.pointers = new Map();
    this.moved = 0;
    const { canvas } = pane, on = (name, act, options) => canvas.addEventListener(name, act, options);
    on("pointerdown", (event) => this._down(event));
    on("pointermove", (event) => this._move(event));
    on("pointerup", (event) => this._up(event));
    on("pointercancel", (event) => this._up(event, true));
    on("pointerleave", () => this.pointers.size || drawing.hover(pane, null));
    on("wheel", (event) => this._wheel(event), { passive: false });
    on("dblclick", (event) => this.view.zoom(2, ...this._place(event)));
    on("keydown", (event) => this._key(event));
  }

  _place(event) {
    const box = this.pane.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  _down(event) {
    if (event.button > 1) return;
    this.pane.canvas.setPointerCapture(event.pointerId);
    const place = this._place(event);
    this.pointers.set(event.pointerId, place);
    this.moved = this.pointers.size > 1 ? CLICK + 1 : 0;
    if (this.pointers.size === 1 && event.button === 0) this.drawing.grab(this.pane, ...place);
    if (event.button === 1) event.preventDefault();
  }

  _move(event) {
    const place = this._place(event), before = this.pointers.get(event.pointerId);
    if (!before) {
      this.drawing.point(this.pane, ...place);
      return;
    }
    const dx = place[0] - before[0], dy = place[1] - before[1];
    if (this.pointers.size === 2) this._pinch(event.pointerId, place);
    this.pointers.set(event.pointerId, place);
    this.moved += Math.hypot(dx, dy);
    if (this.pane.drag) this.drawing.dragTo(this.pane, ...place);
    else if (this.pointers.size === 1 && this.moved > CLICK) this.view.pan(dx, dy);
    this.pane.canvas.classList.toggle("lc-moving", this.moved > CLICK);
  }

  /** Two fingers: the point between them stays between them. */
  _pinch(id, place) {
    const [other] = [...this.pointers].filter(([key]) => key !== id).map(([, at]) => at), before = this.pointers.get(id);
    const was = Math.hypot(before[0] - other[0], before[1] - other[1]), is = Math.hypot(place[0] - other[0], place[1] - other[1]);
    this.view.pan((place[0] - before[0]) / 2, (place[1] - before[1]) / 2);
    if (was > 0 && is > 0) this.view.zoom(is / was, (place[0] + other[0]) / 2, (place[1] + other[1]) / 2);
  }

  _up(event, cancelled = false) {
    const place = this.pointers.get(event.pointerId);
    this.pointers.delete(event.pointerId);
    this.pane.canvas.classList.remove("lc-moving");
    if (!place) return;
    if (this.pane.drag) this.drawing.drop(this.pane, cancelled || this.moved <= CLICK);
    if (!cancelled && this.moved <= CLICK && event.button === 0) this.drawing.choose(this.pane, ...place);
  }

  _wheel(event) {
    event.preventDefault();
    const unit = [1, 16, this.view.height][event.deltaMode] ?? 1;
    if (event.shiftKey) this.view.pan(-(event.deltaX || event.deltaY) * unit, 0);
    else this.view.zoom(Math.exp(-event.deltaY * unit * (event.ctrlKey ? 0.01 : 0.0016)), ...this._place(event));
    this.drawing.point(this.pane, ...this._place(event));
  }

  _key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { view, drawing } = this, dx = PAN_STEP * view.width, dy = PAN_STEP * view.height;
    const actions = {
      ArrowLeft: () => view.pan(dx, 0),
      ArrowRight: () => view.pan(-dx, 0),
      ArrowUp: () => view.pan(0, dy),
      ArrowDown: () => view.pan(0, -dy),
      "+": () => view.zoom(ZOOM_STEP),
      "=": () => view.zoom(ZOOM_STEP),
      "-": () => view.zoom(1 / ZOOM_STEP),
      0: () => drawing.fit(),
      f: () => drawing.fit(),
      Home: () => drawing.fit(),
      " ": () => drawing.player.toggle(),
      ".": () => drawing.player.step(1),
      ",": () => drawing.player.step(-1),
      m: () => drawing.nextMode(),
      d: () => drawing.measure.toggle(undefined, true),
      ...(drawing.measure.on ? { Enter: () => drawing.measure.take() } : {}),
    };
    // Plain letters and digits keep the meaning of the page; layers use Shift.
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key, letter = /^[a-z]$/.test(key);
    const layer = letter && event.shiftKey ? LAYERS.find((name) => KEYS[name].toLowerCase() === key) : null;
    const act = layer ? () => drawing.setLayers({ [layer]: !drawing.layers[layer] }) : letter && event.shiftKey ? null : actions[key];
    if (event.key === "Escape" ? !drawing.escape() : !act) return;
    event.preventDefault();
    act?.();
  }
}
