// Charts of a search: cost over time with the lower bound, bars by worker, and the brightness of fireflies.

import { make } from "./icons.js";
import { niceStep } from "./view.js";
import { WORDS } from "./words.js";

const SVG = "http://www.w3.org/2000/svg";
const LEFT = 58, RIGHT = 14, TOP = 12, BOTTOM = 26;
const FIGURE = 64, CLOSE = 26; // width of the value at the end of a curve, and minimum height for it between two steps
const LOG_FROM = 60; // ratio of the last to the first time; shorter searches stay linear

export function draw(tag, attributes, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Return a number with thousands separators and the decimals that a step needs. */
export function words(value, step) {
  const decimals = Math.min(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), 6);
  return value.toLocaleString("en-US", { minimumFractionDigits: decimals, maximumFractionDigits: decimals });
}

/** Cost over milliseconds, as steps, with the lower bound as a line; the time axis is logarithmic for a long search. */
export class Convergence {
  constructor(host, { words: given = {} } = {}) {
    this.words = { ...WORDS, ...given };
    this.history = [];
    this.bound = null;
    this.unit = "s";
    this.svg = draw("svg", { class: "lc-chart", role: "img" });
    host.append(this.svg);
    this._observer = new ResizeObserver(() => this.draw());
    this._observer.observe(this.svg);
  }

  /** Set the whole search: history as [[seconds, cost], …], the lower bound or null, and the time so far. */
  set({ history = [], bound = null, unit = "s", now = 0 } = {}) {
    Object.assign(this, { history: history.map(([s, c]) => [s * 1000, c]), bound, unit, now: now * 1000 });
    this.draw();
  }

  /** Add an improvement. */
  add(seconds, cost) {
    this.history.push([seconds * 1000, cost]);
    this.draw();
  }

  destroy() {
    this._observer.disconnect();
    this.svg.remove();
  }

  draw() {
    const box = this.svg.getBoundingClientRect(), width = box.width, height = box.height;
    this.svg.replaceChildren();
    if (!(width > 80 && height > 50) || !this.history.length) return;
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const costs = this.history.map(([, cost]) => cost).concat(this.bound ?? []);
    let low = Math.min(...costs), high = Math.max(...costs);
    const spare = Math.max((high - low) * 0.08, Math.abs(high) * 1e-4, 1e-9);
    low -= spare;
    high += spare;
    const last = Math.max(this.now ?? 0, this.history.at(-1)[0], 1), first = Math.max(Math.min(...this.history.map(([t]) => t || Infinity), last), 1);
    const log = last / first > LOG_FROM, start = log ? first : 0;
    const scale = log ? (t) => Math.log(Math.max(t, first) / first) / Math.log(last / first) : (t) => t / last;
    this.x = (t) => LEFT + scale(t) * (width - LEFT - RIGHT);
    this.y = (cost) => TOP + ((high - cost) / (high - low)) * (height - TOP - BOTTOM);
    this._axes({ low, high, start, last, log, width, height });
    this._curve({ last, height, width });
    const best = this.history.at(-1)[1];
    this.svg.setAttribute("aria-label", `${this.words.best} ${words(best, 0.01)} ${this.unit}`);
  }

  _axes({ low, high, start, last, log, width, height }) {
    const bottom = height - BOTTOM, step = niceStep((high - low) / Math.max((height - TOP - BOTTOM) / 34, 1));
    for (let k = Math.ceil(low / step); k * step <= high; k++) {
      const y = this.y(k * step);
      this.svg.append(
        draw("line", { class: "lc-gridline", x1: LEFT, x2: width - RIGHT, y1: y, y2: y }),
        draw("text", { x: LEFT - 7, y, dy: "0.34em", "text-anchor": "end" }, words(k * step, step)),
      );
    }
    const apart = linearStep(last, width);
    for (const t of log ? decades(start, last) : linear(last, apart)) {
      const x = this.x(t);
      this.svg.append(
        draw("line", { class: "lc-tick", x1: x, x2: x, y1: bottom, y2: bottom + 4 }),
        draw("text", { x: Math.min(x, width - 24), y: bottom + 16, "text-anchor": "middle" }, t >= 1000 && log ? `${t / 1000} s` : log ? `${t} ms` : words(t, apart)),
      );
    }
    this.svg.append(draw("line", { class: "lc-tick", x1: LEFT, x2: width - RIGHT, y1: bottom, y2: bottom }));
    if (!log) this.svg.append(draw("text", { x: LEFT - 18, y: bottom + 16, "text-anchor": "end" }, "ms"));
  }

  _curve({ last, width }) {
    let d = "";
    this.history.forEach(([t, cost], k) => { d += k ? `H${this.x(t)}V${this.y(cost)}` : `M${this.x(t)} ${this.y(cost)}`; });
    d += `H${this.x(last)}`;
    if (this.bound !== null) {
      const y = this.y(this.bound);
      this.svg.append(
        draw("line", { class: "lc-bound", x1: LEFT, x2: width - RIGHT, y1: y, y2: y }),
        draw("text", { class: "lc-note", x: LEFT + 8, y: y - 6 }, `${this.words.bound} ${words(this.bound, 0.01)}`),
      );
    }
    const best = this.history.at(-1)[1], x = this.x(last), y = this.y(best);
    // Place the value above the curve, even if an earlier step is just above the last.
    let over = y;
    for (let k = this.history.length - 2; k >= 0 && this.x(this.history[k + 1][0]) > x - FIGURE; k--) {
      if (this.y(this.history[k][1]) > over - CLOSE) over = this.y(this.history[k][1]);
    }
    this.svg.append(
      draw("path", { class: "lc-curve", d }),
      draw("circle", { class: "lc-point", cx: x, cy: y, r: 4 }),
      draw("text", { class: "lc-note lc-best", x: x - 2, y: over - 9, "text-anchor": "end" }, `${words(best, 0.01)} ${this.unit}`),
    );
  }
}

function linearStep(last, width) { return niceStep(last / Math.max((width - LEFT - RIGHT) / 70, 1)); }

function linear(last, step) {
  const ticks = [];
  for (let k = 0; k * step <= last; k++) ticks.push(k * step);
  return ticks;
}

function decades(first, last) {
  const ticks = [];
  for (let power = Math.ceil(Math.log10(first) - 1e-9); 10 ** power <= last * 1.0001; power++) ticks.push(10 ** power);
  return ticks;
}

/** A bar per worker: `set([{ name, value, note, best }])`, scaled to the largest value. */
export class Bars {
  constructor(host) {
    this.list = make("ul", "lc-bars");
    host.append(this.list);
  }

  set(rows) {
    const most = Math.max(...rows.map((row) => row.value), 1e-12);
    this.list.replaceChildren(...rows.map((row) => {
      const fill = make("i", row.best ? "lc-fill lc-won" : "lc-fill");
      fill.style.width = `${(100 * Math.max(row.value, 0)) / most}%`;
      return make("li", "", {}, make("span", "lc-who", {}, row.name), make("span", "lc-track", {}, fill), make("span", "lc-note", {}, row.note ?? ""));
    }));
  }

  destroy() { this.list.remove(); }
}

/** Fireflies by brightness: `set(values)`, 0 … 1, in order of their number, the brightest marked. */
export class Brightness {
  constructor(host, { words: given = {} } = {}) {
    this.words = { ...WORDS, ...given };
    this.svg = draw("svg", { class: "lc-chart lc-brightness", role: "img", preserveAspectRatio: "none" });
    host.append(this.svg);
  }

  set(values) {
    const box = this.svg.getBoundingClientRect(), width = Math.max(box.width, 1), height = Math.max(box.height, 1);
    const room = width / Math.max(values.length, 1), most = Math.max(...values, 1e-12);
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.svg.setAttribute("aria-label", `${this.words.best} ${most.toFixed(3)}`);
    this.svg.replaceChildren(...Array.from(values, (value, k) => {
      const tall = Math.max((value / most) * (height - 4), 1);
      const fill = value === most ? "lc-column lc-won" : "lc-column";
      return draw("rect", { class: fill, x: k * room + room * 0.1, y: height - tall, width: room * 0.8, height: tall, rx: Math.min(2, room / 4) });
    }));
  }

  destroy() { this.svg.remove(); }
}
