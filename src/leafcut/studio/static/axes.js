// Common parts of the teaching charts: scales, axes, a legend, and the switch between iterations and time.

import { draw, words } from "./chart.js";
import { make } from "./icons.js";
import { niceStep } from "./view.js";

const LOG_FROM = 60; // ratio of the last to the first time; shorter searches stay linear
export const LEFT = 58, RIGHT = 16, BOTTOM = 26;
const LEGEND = 17, APART = 14, KEY = 21, EDGE = 4;

/** Horizontal axis: iteration or time; a row is [iteration, seconds, …]. */
const AXES = {
  iteration: { at: (row) => row[0], least: 1 },
  time: { at: (row) => row[1], least: 0.001 },
};

/** A chart with a switchable horizontal axis; subclasses draw their content in `_paint(frame)`. */
export class Switched {
  constructor(host, { words: given = {}, by = "iteration" } = {}) {
    this.words = given;
    this.by = by;
    this.root = make("div", "lc-switched");
    this.bar = make("div", "lc-switch", { role: "group", "aria-label": given.axis ?? "" });
    for (const name of Object.keys(AXES)) {
      const button = make("button", "lc-mode", { type: "button", "data-by": name, "aria-pressed": "false" }, given[name] ?? name);
      button.addEventListener("click", () => this.switchTo(name));
      this.bar.append(button);
    }
    this.svg = draw("svg", { class: "lc-chart", role: "img" });
    this.root.append(this.bar, this.svg);
    host.append(this.root);
    this._observer = new ResizeObserver(() => this.draw());
    this._observer.observe(this.svg);
  }

  /** Set the horizontal axis to iterations or seconds. */
  switchTo(by) {
    this.by = by;
    this.draw();
  }

  destroy() {
    this._observer.disconnect();
    this.root.remove();
  }

  draw() {
    for (const button of this.bar.children) button.setAttribute("aria-pressed", String(button.dataset.by === this.by));
    const { width, height } = this.svg.getBoundingClientRect();
    this.svg.replaceChildren();
    if (!(width > 120 && height > 60) || this.empty) return;
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this._paint({ width, height });
  }

  /** Draw the horizontal axis for `rows`, logarithmic for a long search; return the function row → x. */
  horizontal(rows, { width, height, right = RIGHT }) {
    const { at, least } = AXES[this.by], seen = rows.map(at), last = Math.max(ends(seen)[1], least);
    const first = Math.max(least, Math.min(ends(seen.filter((v) => v > 0))[0], last)), log = last / first > LOG_FROM;
    const span = width - LEFT - right, bottom = height - BOTTOM;
    const scale = log ? (v) => Math.log(Math.max(v, first) / first) / Math.log(last / first) : (v) => v / last;
    const x = (v) => LEFT + scale(v) * span;
    const small = this.by === "time" && last < 1, unit = this.by === "time" ? (small ? " ms" : " s") : "", times = small ? 1000 : 1;
    const step = niceStep((last * times) / Math.max(span / 70, 1));
    const whole = this.by === "iteration" ? Math.max(1, step) : step;
    const ticks = log ? decades(first, last) : multiples(0, last * times, whole).map((v) => v / times);
    for (const v of ticks) {
      this.svg.append(
        draw("line", { class: "lc-tick", x1: x(v), x2: x(v), y1: bottom, y2: bottom + 4 }),
        draw("text", { x: Math.min(x(v), width - 20), y: bottom + 16, "text-anchor": "middle" }, log ? `${plain(v * times)}${unit}` : words(v * times, whole)),
      );
    }
    this.svg.append(
      draw("line", { class: "lc-tick", x1: LEFT, x2: width - right, y1: bottom, y2: bottom }),
      draw("text", { class: "lc-axis", x: LEFT - (this.by === "iteration" ? 7 : 18), y: bottom + 16, "text-anchor": "end" }, this.by === "iteration" ? this.words.iterationAxis : unit.trim()),
    );
    return (row) => x(at(row));
  }

  /** Draw horizontal grid lines; return the function value → y between `top` and the axis. */
  vertical([low, high], { width, height, top, right = RIGHT }) {
    const spare = Math.max((high - low) * 0.06, Math.abs(high) * 1e-4, 1e-9), bottom = height - BOTTOM;
    const least = low - spare, most = high + spare, y = (v) => top + ((most - v) / (most - least)) * (bottom - top);
    const step = niceStep((most - least) / Math.max((bottom - top) / 32, 1));
    for (const v of multiples(least, most, step)) {
      this.svg.append(
        draw("line", { class: "lc-gridline", x1: LEFT, x2: width - right, y1: y(v), y2: y(v) }),
        draw("text", { x: LEFT - 7, y: y(v), dy: "0.34em", "text-anchor": "end" }, words(v, step)),
      );
    }
    return y;
  }

  /** Draw a legend in as many lines as needed: [class of the key, colour or "", text]; return its lower end. */
  legend(entries, width) {
    let x = EDGE, y = 8;
    for (const [classes, colour, said] of entries) {
      const key = draw("line", { class: classes, x1: 0, x2: 16, y1: 0, y2: 0, ...(colour ? { style: `stroke:${colour}` } : {}) });
      const entry = draw("g", {}, key, draw("text", { x: KEY, dy: "0.34em" }, said));
      this.svg.append(entry);
      const long = KEY + entry.lastChild.getComputedTextLength();
      if (x > EDGE && x + long > width) [x, y] = [EDGE, y + LEGEND];
      entry.setAttribute("transform", `translate(${x} ${y})`);
      x += long + APART;
    }
    return y + LEGEND;
  }
}

/** Return the smallest and the largest value; unlike Math.min(...values), it takes any number of values. */
export function ends(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return [low, high];
}

/** Return the multiples of a step from `low` to `high`. */
export function multiples(low, high, step) {
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high * (1 + 1e-9); k++) found.push(k * step || 0); // no -0
  return found;
}

function decades(first, last) {
  const found = [];
  for (let power = Math.ceil(Math.log10(first) - 1e-9); 10 ** power <= last * 1.0001; power++) found.push(10 ** power);
  return found;
}

function plain(value) { return Number(value.toPrecision(6)).toLocaleString("en-US"); }

/** Return the SVG path of a polyline; with `steps`, each segment is horizontal, then vertical. */
export function line(points, steps = false) {
  return points.map(([x, y], k) => (k ? (steps ? `H${x}V${y}` : `L${x} ${y}`) : `M${x} ${y}`)).join("");
}
