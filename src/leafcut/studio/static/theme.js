// Colours of the drawing from the current style sheet.

const NAMES = [
  "page", "card", "ink", "ink-2", "line", "line-2", "accent", "accent-soft", "warn", "bad", "rapid", "cut", "change", "hole",
  "hole-rim", "idle", "t0", "t1", "t2", "t3", "t4", "t5", "t6", "t7",
];

/** @typedef {Record<string, string>} Colours */

/** Return the values of the custom properties used by the drawing.
 * @param {Element} element */
export function coloursOf(element) {
  const style = getComputedStyle(element), colours = /** @type {Colours} */ ({});
  for (const name of NAMES) colours[name] = style.getPropertyValue(`--${name}`).trim() || "#888888";
  // Further colours are mixtures of the report's.
  colours.grid = mixed(colours.line, colours.card, 0.38);
  colours["grid-2"] = mixed(colours.line, colours.card, 0.8);
  colours.before = mixed(colours.idle, colours.card, 0.68);
  return colours;
}

/** Return red, green and blue of #rrggbb, 0 to 255.
 * @param {string} colour */
export function rgbOf(colour) { return [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16)); }

/** Return whether a colour, #rrggbb, is dark.
 * @param {string} colour */
export function isDark(colour) {
  const [r, g, b] = rgbOf(colour);
  return 0.3 * r + 0.59 * g + 0.11 * b < 128;
}

/** Return the mixture of a share of one colour with another, all as #rrggbb.
 * @param {string} one @param {string} other @param {number} share */
function mixed(one, other, share) {
  const a = rgbOf(one), b = rgbOf(other);
  return `#${a.map((v, k) => Math.round(share * v + (1 - share) * b[k]).toString(16).padStart(2, "0")).join("")}`;
}

/** Call `changed` when the page may have switched between light and dark; return a function that unsubscribes.
 * @param {() => void} changed */
export function watchTheme(changed) {
  const media = matchMedia("(prefers-color-scheme: dark)");
  media.addEventListener("change", changed);
  const observer = new MutationObserver(changed);
  for (const element of [document.documentElement, document.body]) {
    observer.observe(element, { attributes: true, attributeFilter: ["class", "data-theme"] });
  }
  return () => {
    media.removeEventListener("change", changed);
    observer.disconnect();
  };
}

/** Return the colour of a layer or a tool by its index; `only` if there is only one, as in the report.
 * @template T @param {Colours} colours @param {T[]} all @param {T} one */
export function colourOf(colours, all, one, only = colours.idle) {
  const index = all.indexOf(one);
  return all.length < 2 ? only : index < 0 ? colours.idle : colours[`t${index % 8}`];
}
