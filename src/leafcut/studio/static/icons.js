// Icons as SVG strokes, and functions that create elements.

/** @type {Record<string, string>} */
const PATHS = {
  fit: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  zoomIn: "M12 5v14M5 12h14",
  zoomOut: "M5 12h14",
  measure: "M3 16 16 3l5 5L8 21l-5-5ZM7 12l2 2M10 9l3 3M13 6l2 2",
  layers: "M12 3 3 8l9 5 9-5-9-5ZM3.5 12.5 12 17l8.5-4.5M3.5 16.5 12 21l8.5-4.5",
  play: "M7 4.5v15l12-7.5-12-7.5Z",
  pause: "M8 5v14M16 5v14",
  stepBack: "M18 5v14L8 12l10-7ZM6 5v14",
  stepOn: "M6 5v14l10-7L6 5ZM18 5v14",
  stop: "M6 6h12v12H6z",
  up: "M5 15l7-7 7 7",
  down: "M5 9l7 7 7-7",
};

/** Return an element with a class, attributes and children.
 * @template {keyof HTMLElementTagNameMap} T @param {T} tag @param {Record<string, any>} attributes
 * @param {(Node | string)[]} children */
export function make(tag, className = "", attributes = {}, ...children) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Return an icon without a name; its button or the adjacent element is named.
 * @param {string} name */
export function icon(name) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", PATHS[name]);
  svg.append(path);
  return svg;
}

/** Return a button with an icon; its name is read by screen readers and shown as a tooltip.
 * @param {string} name @param {string} words @param {() => void} action */
export function iconButton(name, words, action) {
  const button = make("button", "lc-button", { type: "button", "aria-label": words, title: words }, icon(name));
  button.addEventListener("click", action);
  return button;
}

/** Return a selection list of [value, text].
 * @param {string} className @param {string} label @param {[string | number, string][]} choices
 * @param {(value: string) => void} action */
export function selection(className, label, choices, action) {
  const select = make("select", `lc-select ${className}`, { "aria-label": label, title: label });
  select.append(...choices.map(([value, text]) => make("option", "", { value }, text)));
  select.addEventListener("change", () => action(select.value));
  return select;
}

/** Return the context of a canvas.
 * @param {HTMLCanvasElement} canvas */
export function contextOf(canvas) { return /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d")); }

/** Return the nonce with which the page allows style elements. */
export function styleNonce() { return document.querySelector("script")?.nonce ?? ""; }
