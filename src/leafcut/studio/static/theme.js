// Colours of the drawing from the current style sheet.

const NAMES = [
  "page", "card", "ink", "ink-2", "line", "line-2", "accent", "accent-soft", "warn", "bad", "rapid", "cut", "change", "hole",
  "hole-rim", "idle", "t0", "t1", "t2", "t3", "t4", "t5", "t6", "t7",
];

/** Return the values of the custom properties used by the drawing. */
export function coloursOf(element) {
  const style = getComputedStyle(element), colours = {};
  for (const name of NAMES) colours[name] = style.getPropertyValue(`--${name}`).trim() || "#888888";
  // Further colours are mixtures of the report's.
  colours.grid = mixed(colours.line, colours.card, 0.38);
  colours["grid-2"] = mixed(colours.line, colours.card, 0.8);
  colours.before = mixed(colours.idle, colours.card, 0.68);
  return colours;
}

/** Return the mixture of a share of one colour with another, all as #rrggbb. */
function mixed(one, other, share) {
  const parts = (colour) => [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16));
  const [a, b] = [parts(one), parts(other)];
  return `#${a.map((v, k) => Math.round(share * v + (1 - share) * b[k]).toString(16).padStart(2, "0")).join("")}`;
}

/** Call `changed` when the page may have switched between light and dark; return a function that unsubscribes. */
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

/** Return the colour of a layer by its index; neutral if there is only one layer. */
export function layerColour(colours, layers, name) {
  const index = layers.indexOf(name);
  return layers.length < 2 || index < 0 ? colours.idle : colours[`t${index % 8}`];
}

/** Return the colour of a tool; neutral if there is only one, as in the report. */
export function toolColour(colours, tools, tool) {
  if (tools.length < 2) return colours["hole-rim"];
  const index = tools.indexOf(tool);
  return index < 0 ? colours.idle : colours[`t${index % 8}`];
}
