// Playback of a toolpath: the bar with the slider, and the clock.

import { clockWords } from "./describe.js";
import { icon, iconButton, make } from "./icons.js";

const RATES = [0.5, 1, 2, 5, 10, 20, 50, 100, 500];
const SLIDER = 10000;

/** Plays one or two scenes in machine time; dispatches `time` with { time, row }, where time null is the whole path. */
export class Player extends EventTarget {
  constructor(host, words) {
    super();
    this.words = words;
    this.scene = null;
    this.duration = 0;
    this.time = null;
    this.rate = 1;
    this.playing = false;
    this._build(host);
    this.setScene(null, 0);
  }

  _build(host) {
    const { words } = this;
    this.button = iconButton("play", words.play, () => this.toggle());
    this.slider = make("input", "lc-slider", { type: "range", min: 0, max: SLIDER, step: 1, "aria-label": words.time });
    this.slider.addEventListener("input", () => this.seek((this.slider.value / SLIDER) * this.duration));
    this.clock = make("span", "lc-clock");
    this.rates = make("select", "lc-select", { "aria-label": words.rate, title: words.rate });
    for (const rate of RATES) this.rates.append(make("option", "", { value: rate }, `${rate}×`));
    this.rates.value = "1";
    this.rates.addEventListener("change", () => { this.rate = Number(this.rates.value); });
    this.bar = make(
      "div", "lc-player", { role: "group", "aria-label": words.time },
      iconButton("stepBack", words.stepBack, () => this.step(-1)), this.button,
      iconButton("stepOn", words.stepOn, () => this.step(1)), this.slider, this.clock, this.rates,
      iconButton("stop", words.stop, () => this.showAll()),
    );
    host.append(this.bar);
  }

  /** Set the scene for stepping through blocks, and the duration of the longest visible scene. */
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
    this.dispatchEvent(new CustomEvent("play"));
  }

  pause() {
    this.playing = false;
    this._icon();
  }

  setRate(rate) {
    this.rate = rate;
    if (!RATES.includes(rate) && ![...this.rates.options].some((o) => Number(o.value) === rate)) {
      this.rates.append(make("option", "", { value: rate }, `${rate}×`));
    }
    this.rates.value = String(rate);
  }

  seek(seconds) {
    if (this.scene) this._set(Math.min(Math.max(seconds, 0), this.duration));
  }

  /** Advance by the time since the last frame; return whether playback is running. */
  tick(now) {
    if (!this.playing) return false;
    const time = this.time + (Math.max(now - this.last, 0) / 1000) * this.rate;
    this.last = now;
    this._set(Math.min(time, this.duration));
    if (time >= this.duration) this.pause();
    return this.playing;
  }

  /** Go to the end of the next block of the program, or to the start of the previous one. */
  step(direction) {
    const { scene } = this;
    if (!scene) return;
    this.pause();
    const time = this.time ?? (direction > 0 ? 0 : this.duration), row = scene.rowAt(time + (direction > 0 ? 1e-6 : -1e-6));
    if (direction > 0) {
      const [, last] = scene.together(row);
      this.seek(scene.ends[last]);
      return;
    }
    const [first] = scene.together(row);
    this.seek(scene.startOf(first));
  }

  _set(time) {
    this.time = time;
    const shown = time ?? this.duration;
    this.slider.value = this.duration > 0 ? (shown / this.duration) * SLIDER : 0;
    this.slider.style.setProperty("--done", `${this.duration > 0 ? (100 * shown) / this.duration : 0}%`);
    // Neither a map without millimetres nor one level of a pocket has a machine time.
    const share = this.scene?.header.untimed && this.duration > 0 ? `${((100 * shown) / this.duration).toFixed(0)} %` : "";
    this.slider.setAttribute("aria-valuetext", share || clockWords(shown));
    this.clock.textContent = share || `${clockWords(shown)} / ${clockWords(this.duration)}`;
    const row = time === null || !this.scene ? null : this.scene.rowAt(Math.min(time, this.scene.duration));
    this.dispatchEvent(new CustomEvent("time", { detail: { time, row, line: row === null ? 0 : this.scene.line[row] } }));
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
