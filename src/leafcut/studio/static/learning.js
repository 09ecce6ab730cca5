// Learning curves of a search: best, mean and worst of each iteration, the best so far, and the λ-branching factor.

import { BOTTOM, LEFT, RIGHT, Switched, ends, line } from "./axes.js";
import { draw, words } from "./chart.js";

const SECOND = 34; // width of the axis of the branching factor

/** `set({ rows, bound, unit })`; a row is [iteration, seconds, shortest so far, best, mean, worst, branching]. */
export class Learning extends Switched {
  constructor(host, options = {}) {
    super(host, options);
    this.rows = [];
  }

  get empty() { return !this.rows.length; }

  set({ rows = [], bound = null, unit = "" } = {}) {
    Object.assign(this, { rows, bound, unit });
    this.draw();
  }

  _paint({ width, height }) {
    const { rows } = this, told = rows.filter((row) => row[3] !== null), branching = rows.filter((row) => row[6] !== null);
    const top = this._told(rows.at(-1), told.length > 0, branching.length > 0, width);
    const right = branching.length ? SECOND : RIGHT, frame = { width, height, right, top };
    const all = [...rows.map((row) => row[2]), ...told.map((row) => row[5]), ...(this.bound === null ? [] : [this.bound])];
    const y = this.vertical(ends(all), frame), x = this.horizontal(rows, frame);
    const curve = (which, from) => from.map((row) => [x(row), y(row[which])]);
    if (told.length > 1) {
      const edge = [...curve(3, told), ...curve(5, told).reverse()];
      this.svg.append(draw("path", { class: "lc-band", d: `${line(edge)}Z` }));
    }
    if (branching.length) this._branching(branching, x, frame);
    if (this.bound !== null) this.svg.append(draw("line", { class: "lc-bound", x1: LEFT, x2: width - right, y1: y(this.bound), y2: y(this.bound) }));
    for (const [which, name] of [[5, "lc-worst"], [4, "lc-mean"], [3, "lc-round"]]) {
      if (told.length) this.svg.append(draw("path", { class: `lc-line ${name}`, d: line(curve(which, told)) }));
    }
    const last = rows.at(-1);
    this.svg.append(
      draw("path", { class: "lc-curve", d: line(curve(2, rows), true) }),
      draw("circle", { class: "lc-point", cx: x(last), cy: y(last[2]), r: 3.5 }),
    );
  }

  /** Draw the branching factor with its own axis at the right. */
  _branching(rows, x, { width, height, top }) {
    const most = Math.max(...rows.map((row) => row[6]), 3), bottom = height - BOTTOM, edge = width - SECOND;
    const y = (v) => bottom - (v / most) * (bottom - top);
    this.svg.append(draw("path", { class: "lc-line lc-branching", d: line(rows.map((row) => [x(row), y(row[6])])) }));
    for (const v of new Set([2, Math.floor(most)])) {
      this.svg.append(draw("text", { class: "lc-second", x: edge + 6, y: y(v), dy: "0.34em" }, String(v)));
    }
  }

  /** Draw the legend and set the text for screen readers; return the lower end of the legend. */
  _told(last, rounds, branching, width) {
    const w = this.words, said = (value) => words(value, Math.abs(value) < 10 ? 0.01 : 0.1);
    const figures = rounds ? `, ${w.round} ${said(last[3] ?? last[2])}, ${w.mean} ${said(last[4] ?? last[2])}, ${w.worst} ${said(last[5] ?? last[2])}` : "";
    const factor = branching && last[6] !== null ? `, ${w.branching} ${last[6].toFixed(2)}` : "";
    this.svg.setAttribute("aria-label", `${w.shortest} ${said(last[2])} ${this.unit}${figures}${factor}`);
    return this.legend(
      [
        ["lc-curve", "", `${w.shortest} ${said(last[2])}`],
        ...(rounds ? [["lc-line lc-round", "", w.round], ["lc-line lc-mean", "", w.mean], ["lc-line lc-worst", "", w.worst]] : []),
        ...(branching ? [["lc-line lc-branching", "", w.branching]] : []),
        ...(this.bound === null ? [] : [["lc-bound", "", w.bound]]),
      ],
      width,
    );
  }
}
