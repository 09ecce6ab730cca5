// Keeps the focus when parts of the page are redrawn; arrow keys move within tabs and toolbars.

/** Last focused element, with properties that identify its replacement.
 * @typedef {{ at: HTMLElement, id: string, key?: string, name: string, place: number, after?: string }} Focused */

const CONTROLS = "button, a, input, select, textarea, summary, label, [tabindex]";
const STEPS = /** @type {Record<string, number>} */ ({ ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 });

let last = /** @type {Focused | null} */ (null);

/** @param {HTMLElement} at */
function isShown(at) { return at.isConnected && at.getClientRects().length > 0 && !("disabled" in at && at.disabled); }

/** Return the name of an element; the temporary text "sure?" is not its name.
 * @param {HTMLElement} at */
function nameOf(at) {
  const label = /** @type {HTMLInputElement} */ (at).labels?.[0]; // only fields have labels
  return at.getAttribute("aria-label") ?? at.dataset.words ?? label?.textContent ?? at.textContent.trim();
}

/** Return the elements with the same tag and role.
 * @param {HTMLElement} at */
function alike(at) {
  const all = /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(at.tagName));
  return [...all].filter((other) => other.getAttribute("role") === at.getAttribute("role"));
}

/** Return the element with a data attribute around another one.
 * @param {HTMLElement} at @param {string} attribute */
function around(at, attribute) { return /** @type {HTMLElement | null} */ (at.closest(`[data-${attribute}]`)); }

/** @param {HTMLElement} at */
function remember(at) {
  if (last?.at === at) return;
  const name = nameOf(at);
  last = {
    at,
    id: /^c\d+$/.test(at.id) ? "" : at.id, // NiceGUI numbers its elements and renumbers redrawn ones
    key: around(at, "focus")?.dataset.focus,
    name,
    place: alike(at).filter((other) => nameOf(other) === name).indexOf(at),
    after: around(at, "focus-after")?.dataset.focusAfter,
  };
}

/** @param {Focused} from */
function successor({ at, id, key, name, place }) {
  if (isShown(at)) return at;
  const same = id ? document.getElementById(id) : null;
  if (same && isShown(same)) return same;
  const within = key ? document.querySelector(`[data-focus="${CSS.escape(key)}"]`) : null;
  const others = alike(at).filter((other) => nameOf(other) === name && isShown(other) && (!within || within.contains(other)));
  return others[Math.min(within ? 0 : place, others.length - 1)];
}

function restore() {
  if (!last || document.querySelector("dialog[open]")) return;
  const now = /** @type {HTMLElement | null} */ (document.activeElement);
  if (now && now !== document.body && isShown(now)) return; // a hidden element loses the focus slightly later
  const away = last.after && !isShown(last.at) ? /** @type {HTMLElement | null} */ (document.querySelector(last.after)) : null;
  const to = successor(last) ?? (away && isShown(away) ? away : null);
  to?.focus({ preventScroll: true });
}

document.addEventListener("focusin", ({ target }) => remember(/** @type {HTMLElement} */ (target)));
// An element that loses the focus but stays on the page was not redrawn.
document.addEventListener("focusout", ({ target, relatedTarget }) => {
  if (relatedTarget) return;
  // A removed element is still connected during this event, but no longer afterwards.
  queueMicrotask(() => { if (last && last.at === target && isShown(last.at) && document.activeElement === document.body) last = null; });
});
// After a click outside all controls, or a Tab that leaves the page, no element needs the focus.
document.addEventListener("pointerdown", ({ target }) => { if (!(target instanceof Element && target.closest(CONTROLS))) last = null; }, true);
document.addEventListener("keydown", (event) => { if (event.key === "Tab" && document.activeElement === document.body) last = null; }, true);

// A table that overflows is a tab stop, so that keys can scroll it.
const widths = new ResizeObserver((all) => { for (const { target } of all) setTabStop(target.closest(".scroll")); });
/** @param {Element | null} table */
function setTabStop(table) {
  if (!table) return; // the element was removed
  const larger = table.scrollWidth > table.clientWidth || table.scrollHeight > table.clientHeight;
  for (const [key, value] of [["tabindex", "0"], ["role", "group"], ["aria-label", table.firstElementChild?.getAttribute("aria-label") ?? ""]]) {
    if (larger) table.setAttribute(key, value);
    else table.removeAttribute(key);
  }
}

function watchTables() {
  for (const table of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(".scroll:not([data-watched])"))) {
    table.dataset.watched = "";
    for (const element of [table, ...table.children]) widths.observe(element);
  }
}

document.addEventListener("DOMContentLoaded", () => {
  new MutationObserver(() => {
    restore();
    watchTables();
  }).observe(document.body, { childList: true, subtree: true, attributes: true, attributeFilter: ["class", "disabled", "hidden", "open"] });
});

// Tabs, radio buttons and toolbars are one tab stop each; arrows, Home and End move within them.
document.addEventListener("keydown", (event) => {
  if (event.altKey || event.ctrlKey || event.metaKey || event.shiftKey || !(event.target instanceof Element)) return;
  const list = event.target.closest("[role=tablist], [role=radiogroup], [data-roving]");
  if (!list || event.target.matches("input, select, textarea")) return;
  const found = /** @type {NodeListOf<HTMLElement>} */ (list.querySelectorAll("button, a[href]")), all = [...found].filter(isShown);
  const from = all.findIndex((item) => item === /** @type {Element} */ (event.target).closest("button, a"));
  const step = STEPS[event.key], to = step ? (from + step + all.length) % all.length : { Home: 0, End: all.length - 1 }[event.key] ?? -1;
  if (from < 0 || to < 0) return;
  event.preventDefault();
  for (const item of all) item.tabIndex = item === all[to] ? 0 : -1;
  all[to].focus();
  if (list.matches("[role=tablist], [role=radiogroup]")) all[to].click();
});
