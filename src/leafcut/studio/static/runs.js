// Runs of several algorithms and seeds: overlaid curves, and a box plot of the lengths of each algorithm.

import { LEFT, RIGHT, Switched, ends, line, multiples } from "./axes.js";
import { draw, words } from "./chart.js";
import { make } from "./icons.js";
import { niceStep } from "./view.js";

const COLOURS = 8, BOX_ROW = 34, NAMES = 66, FOOT = 24;

/** Return the colour of an algorithm by its index. */
export function colourOf(number) { return `var(--t${number % COLOURS})`; }

/** `set({ curves: [{ algorithm, points: [[iteration, seconds, length], …] }], bound })`: runs thin, their mean thick. */
export class Runs extends Switched {
  constructor(host, options = {}) {
    super(host, options);
    this.curves = [];
  }

  get empty() { return !this.curves.length; }

  set({ curves = [], bound = null } = {}) {
    Object.assign(this, { curves, bound });
    this.draw();
  }

  _paint({ width, height }) {
    const names = [...new Set(this.curves.map((one) => one.algorithm))], rows = this.curves.flatMap((one) => one.points);
    const lengths = rows.map((row) => row[2]).concat(this.bound ?? []), said = names.map((name, number) => ["lc-run lc-thick", colourOf(number), name]);
    const top = this.legend([...said, ...(this.bound === null ? [] : [["lc-bound", "", this.words.bound]])], width), frame = { width, height, top };
    const y = this.vertical(ends(lengths), frame), x = this.horizontal(rows, frame);
    if (this.bound !== null) this.svg.append(draw("line", { class: "lc-bound", x1: LEFT, x2: width - RIGHT, y1: y(this.bound), y2: y(this.bound) }));
    const end = width - RIGHT;
    for (const { algorithm, points } of this.curves) {
      const path = `${line(points.map((row) => [x(row), y(row[2])]), true)}H${end}`;
      this.svg.append(draw("path", { class: "lc-run", d: path, style: `stroke:${colourOf(names.indexOf(algorithm))}` }));
    }
    names.forEach((name, number) => {
      const mean = meanOf(this.curves.filter((one) => one.algorithm === name).map((one) => one.points), x);
      const path = `${line(mean.map(([at, length]) => [at, y(length)]), true)}H${end}`;
      this.svg.append(draw("path", { class: "lc-run lc-thick", d: path, style: `stroke:${colourOf(number)}` }));
    });
    this.svg.setAttribute("aria-label", `${this.words.runs}: ${names.join(", ")}`);
  }
}

/** Return [x, mean length] at every improvement of a run, starting where all runs have begun. */
function meanOf(runs, x) {
  const places = [...new Set(runs.flatMap((points) => points.map(x)))].sort((a, b) => a - b);
  const begun = Math.max(...runs.map((points) => x(points[0]))), next = runs.map(() => 0);
  return places.filter((at) => at >= begun).map((at) => {
    const sum = runs.reduce((total, points, k) => {
      while (next[k] + 1 < points.length && x(points[next[k] + 1]) <= at) next[k]++;
      return total + points[next[k]][2];
    }, 0);
    return [at, sum / runs.length];
  });
}

/** `set({ algorithms: [{ algorithm, lower, median, upper, low, high, mean, outliers }], bound })`: Tukey box plots. */
export class Boxes {
  constructor(host, { words: given = {} } = {}) {
    this.words = given;
    this.algorithms = [];
    this.root = make("div", "lc-boxes");
    this.svg = draw("svg", { class: "lc-chart", role: "img" });
    this.root.append(this.svg);
    host.append(this.root);
    this._observer = new ResizeObserver(() => this.draw());
    this._observer.observe(this.root);
  }

  set({ algorithms = [], bound = null } = {}) {
    Object.assign(this, { algorithms, bound });
    this.svg.style.height = `${algorithms.length * BOX_ROW + FOOT}px`;
    this.draw();
  }

  destroy() {
    this._observer.disconnect();
    this.root.remove();
  }

  draw() {
    const { algorithms } = this, { width } = this.root.getBoundingClientRect(), height = algorithms.length * BOX_ROW + FOOT;
    this.svg.replaceChildren();
    if (!(width > 160) || !algorithms.length) return;
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const all = algorithms.flatMap((one) => [one.low, one.high, ...one.outliers]).concat(this.bound ?? []);
    const [low, high] = ends(all), spare = Math.max((high - low) * 0.04, Math.abs(high) * 1e-4, 1e-9);
    const least = low - spare, most = high + spare, span = width - NAMES - RIGHT, x = (v) => NAMES + ((v - least) / (most - least)) * span;
    const step = niceStep((most - least) / Math.max(span / 64, 1)), bottom = height - FOOT;
    for (const v of multiples(least, most, step)) {
      this.svg.append(
        draw("line", { class: "lc-gridline", x1: x(v), x2: x(v), y1: 2, y2: bottom }),
        draw("text", { x: Math.min(x(v), width - 22), y: bottom + 16, "text-anchor": "middle" }, words(v, step)),
      );
    }
    if (this.bound !== null) this.svg.append(draw("line", { class: "lc-bound", x1: x(this.bound), x2: x(this.bound), y1: 2, y2: bottom }));
    algorithms.forEach((one, number) => this._box(one, x, (number + 0.5) * BOX_ROW, colourOf(number)));
    this.svg.setAttribute("aria-label", `${this.words.boxes}: ${algorithms.map((one) => `${one.algorithm} ${words(one.median, step / 10)}`).join(", ")}`);
  }

  _box(one, x, y, colour) {
    const style = `stroke:${colour}`, tall = 9;
    const mark = (v, half) => draw("line", { class: "lc-whisker", style, x1: x(v), x2: x(v), y1: y - half, y2: y + half });
    this.svg.append(
      draw("text", { class: "lc-name", x: NAMES - 8, y, dy: "0.34em", "text-anchor": "end" }, one.algorithm),
      draw("line", { class: "lc-whisker", style, x1: x(one.low), x2: x(one.lower), y1: y, y2: y }),
      draw("line", { class: "lc-whisker", style, x1: x(one.upper), x2: x(one.high), y1: y, y2: y }),
      mark(one.low, 5),
      mark(one.high, 5),
      draw("rect", { class: "lc-quartiles", style: `${style};fill:${colour}`, x: x(one.lower), width: Math.max(x(one.upper) - x(one.lower), 1), y: y - tall, height: 2 * tall, rx: 2 }),
      draw("line", { class: "lc-median", style, x1: x(one.median), x2: x(one.median), y1: y - tall, y2: y + tall }),
      draw("circle", { class: "lc-average", style, cx: x(one.mean), cy: y, r: 3 }),
      ...one.outliers.map((v) => draw("circle", { class: "lc-outlier", style, cx: x(v), cy: y, r: 2.5 })),
    );
  }
}
