// Pointer, wheel, touch and keys of the solid view.

const CLICK = 4; // maximum movement of a click, pixels
const TURN = 14, STEP = 30, ZOOM = 1.25; // per key press: pixels of rotation and of panning; zoom factor

export class SolidInput {
  constructor(solid) {
    this.solid = solid;
    this.pointers = new Map();
    this.moved = 0;
    const on = (name, act, options) => solid.over.addEventListener(name, act, options);
    on("pointerdown", (event) => this._down(event));
    on("pointermove", (event) => this._move(event));
    on("pointerup", (event) => this._up(event));
    on("pointercancel", (event) => this._up(event, true));
    on("pointerleave", () => { if (!solid.marks.on) solid.drawing._say([]); });
    on("contextmenu", (event) => event.preventDefault());
    on("wheel", (event) => this._wheel(event), { passive: false });
    on("keydown", (event) => this._key(event));
  }

  _place(event) {
    const box = this.solid.over.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  _down(event) {
    this.solid.over.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, this._place(event));
    this.moved = this.pointers.size > 1 ? CLICK + 1 : 0;
    this.pans = event.button > 0 || event.shiftKey;
    if (event.button > 0) event.preventDefault();
  }

  _move(event) {
    const { solid } = this, place = this._place(event), before = this.pointers.get(event.pointerId);
    if (!before) {
      solid.marks.move(...place);
      return;
    }
    const dx = place[0] - before[0], dy = place[1] - before[1];
    if (this.pointers.size === 2) this._pinch(event.pointerId, place);
    this.pointers.set(event.pointerId, place);
    this.moved += Math.hypot(dx, dy);
    if (this.pointers.size !== 1 || this.moved <= CLICK) return;
    if (this.pans) solid.camera.pan(dx, dy); else solid.camera.orbit(dx, dy);
    solid.over.classList.add("lc-moving");
    solid.wake();
  }

  /** Two fingers: the point between them stays between them. */
  _pinch(id, place) {
    const { camera } = this.solid, [other] = [...this.pointers].filter(([key]) => key !== id).map(([, at]) => at), before = this.pointers.get(id);
    const was = Math.hypot(before[0] - other[0], before[1] - other[1]), is = Math.hypot(place[0] - other[0], place[1] - other[1]);
    camera.pan((place[0] - before[0]) / 2, (place[1] - before[1]) / 2);
    if (was > 0 && is > 0) camera.zoom(is / was, (place[0] + other[0]) / 2, (place[1] + other[1]) / 2);
    this.solid.wake();
  }

  _up(event, cancelled = false) {
    const place = this.pointers.get(event.pointerId), { solid } = this;
    this.pointers.delete(event.pointerId);
    solid.over.classList.remove("lc-moving");
    if (!place || cancelled || this.moved > CLICK || event.button !== 0) return;
    solid.over.focus({ preventScroll: true });
    solid.marks.press(...place);
  }

  _wheel(event) {
    event.preventDefault();
    const { camera } = this.solid, unit = [1, 16, camera.height_px][event.deltaMode] ?? 1;
    camera.zoom(Math.exp(-event.deltaY * unit * (event.ctrlKey ? 0.01 : 0.0016)), ...this._place(event));
    this.solid.wake();
  }

  _key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { solid } = this, { camera, drawing, marks } = solid, arrows = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const along = arrows[event.key], actions = {
      "+": () => camera.zoom(ZOOM), "=": () => camera.zoom(ZOOM), "-": () => camera.zoom(1 / ZOOM),
      0: () => solid.fit(), f: () => solid.fit(), Home: () => solid.fit(),
      " ": () => drawing.player.toggle(), ".": () => drawing.player.step(1), ",": () => drawing.player.step(-1),
      m: () => drawing.nextMode(), d: () => marks.measure(undefined, true),
      Enter: () => marks.press(camera.width / 2, camera.height_px / 2),
      PageDown: () => marks.go(1), PageUp: () => marks.go(-1),
    };
    const move = along && (() => (event.shiftKey ? camera.pan(along[0] * STEP, along[1] * STEP) : camera.orbit(along[0] * TURN, along[1] * TURN)));
    const act = move ?? (event.shiftKey && /^[a-z]$/i.test(event.key) ? null : actions[event.key.length === 1 ? event.key.toLowerCase() : event.key]);
    if (event.key === "Escape" ? !marks.escape() && !drawing.escape() : !act) return;
    event.preventDefault();
    act?.();
    if (marks.on && marks.byKey && act) marks.aim();
    solid.wake();
  }
}
