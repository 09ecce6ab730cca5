// Playback of a toolpath: the bar with the slider, and the clock.

import { clockWords } from "./describe.js";
import { icon, iconButton, make, selection } from "./icons.js";

/** @import { ToolpathScene } from "./scene.js" */
/** Machine time, s (null: the whole path), with the row and the program line being run.
 * @typedef {{ time: number | null, row: number | null, line: number }} PlayedTime */

const RATES = [0.5, 1, 2, 5, 10, 20, 50, 100, 500];
const SLIDER = 10000;

/** Plays one or two scenes in machine time. */
export class Player {
  /** @param {HTMLElement} host @param {Words} words @param {(at: PlayedTime) => void} onTime @param {() => void} onPlay */
  constructor(host, words, onTime, onPlay) {
    this.words = words;
    this.onTime = onTime;
    this.onPlay = onPlay;
    /** @type {ToolpathScene | null} */
    this.scene = null;
    this.duration = 0;
    /** @type {number | null} */
    this.time = null;
    this.rate = 1;
    this.playing = false;
    this.last = 0; // time of the last frame, ms
    this.button = iconButton("play", words.play, () => this.toggle());
    this.slider = make("input", "lc-slider", { type: "range", min: 0, max: SLIDER, step: 1, "aria-label": words.time });
    this.slider.addEventListener("input", () => this.seek((Number(this.slider.value) / SLIDER) * this.duration));
    this.clock = make("span", "lc-clock");
    this.rates = selection("", words.rate, RATES.map((rate) => [rate, `${rate}×`]), (rate) => { this.rate = Number(rate); });
    this.rates.value = "1";
    this.bar = make(
      "div", "lc-player", { role: "group", "aria-label": words.time },
      iconButton("stepBack", words.stepBack, () => this.step(-1)), this.button,
      iconButton("stepOn", words.stepOn, () => this.step(1)), this.slider, this.clock, this.rates,
      iconButton("stop", words.stop, () => this.showAll()),
    );
    host.append(this.bar);
  }

  /** Set the scene for stepping through blocks, and the duration of the longest visible scene.
   * @param {ToolpathScene | null} scene @param {number} duration */
  setScene(scene, duration) {
    this.scene = scene;
    this.duration = duration;
    this.bar.hidden = !scene || !(duration > 0);
    this.playing = false;
    this.showAll();
  }

  showAll() {
    this.pause();
    this._set(null);
  }

  toggle() { if (this.playing) this.pause(); else this.play(); }

  /** Continue playback, or start at the beginning if at the end; `rate` is machine seconds per second. */
  play(rate = this.rate) {
    if (!this.scene || !(this.duration > 0)) return;
    this.setRate(rate);
    if (this.time === null || this.time >= this.duration) this._set(0);
    this.playing = true;
    this.last = performance.now();
    this._icon();
    this.onPlay();
  }

  pause() {
    this.playing = false;
    this._icon();
  }

  /** @param {number} rate */
  setRate(rate) {
    this.rate = rate;
    if (![...this.rates.options].some((option) => Number(option.value) === rate)) {
      this.rates.append(make("option", "", { value: rate }, `${rate}×`));
    }
    this.rates.value = String(rate);
  }

  /** @param {number} seconds */
  seek(seconds) {
    if (this.scene) this._set(Math.min(Math.max(seconds, 0), this.duration));
  }

  /** Advance by the time since the last frame; return whether playback is running.
   * @param {number} now */
  tick(now) {
    if (!this.playing) return false;
    const time = (this.time ?? 0) + (Math.max(now - this.last, 0) / 1000) * this.rate;
    this.last = now;
    this._set(Math.min(time, this.duration));
    if (time >= this.duration) this.pause();
    return this.playing;
  }

  /** Go to the end of the next block of the program, or to the start of the previous one.
   * @param {number} direction */
  step(direction) {
    const { scene } = this;
    if (!scene) return;
    this.pause();
    const time = this.time ?? (direction > 0 ? 0 : this.duration);
    const [first, last] = scene.together(scene.rowAt(time + (direction > 0 ? 1e-6 : -1e-6)));
    this.seek(direction > 0 ? scene.ends[last] : scene.startOf(first));
  }

  /** @param {number | null} time */
  _set(time) {
    const { scene, duration } = this, shown = time ?? duration, percent = duration > 0 ? (100 * shown) / duration : 0;
    this.time = time;
    this.slider.value = String((percent / 100) * SLIDER);
    this.slider.style.setProperty("--done", `${percent}%`);
    // Neither a map without millimetres nor one level of a pocket has a machine time.
    const share = scene?.header.untimed && duration > 0 ? `${percent.toFixed(0)} %` : "";
    this.slider.setAttribute("aria-valuetext", share || clockWords(shown));
    this.clock.textContent = share || `${clockWords(shown)} / ${clockWords(duration)}`;
    const row = time === null || !scene ? null : scene.rowAt(Math.min(time, scene.duration));
    this.onTime({ time, row, line: row === null || !scene ? 0 : scene.line[row] });
  }

  _icon() {
    const name = this.playing ? "pause" : "play";
    if (this.button.dataset.icon === name) return;
    this.button.dataset.icon = name;
    this.button.replaceChildren(icon(name));
    this.button.title = this.words[name];
    this.button.setAttribute("aria-label", this.words[name]);
  }
}
