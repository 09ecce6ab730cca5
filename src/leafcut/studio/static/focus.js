// Keeps the focus when parts of the page are redrawn; arrow keys move within tabs and toolbars.
(() => {
  /** Last focused element, with properties that identify its replacement. */
  let last = null;

  const shown = (at) => at.isConnected && at.getClientRects().length > 0 && !at.disabled;
  /** Return the name of an element; the temporary text "sure?" is not its name. */
  const name = (at) => at.getAttribute("aria-label") ?? at.dataset.words ?? at.labels?.[0]?.textContent ?? at.textContent.trim();
  /** NiceGUI numbers its elements and renumbers redrawn ones, so these ids do not identify them. */
  const named = (at) => (at.id && !/^c\d+$/.test(at.id) ? at.id : "");
  const alike = (at) =>
    [...document.querySelectorAll(at.tagName)].filter((one) => one.getAttribute("role") === at.getAttribute("role"));

  function remember(at) {
    if (last?.at === at) return;
    const same = alike(at).filter((one) => name(one) === name(at));
    last = {
      at,
      id: named(at),
      key: at.closest("[data-focus]")?.dataset.focus,
      name: name(at),
      place: same.indexOf(at),
      after: at.closest("[data-focus-after]")?.dataset.focusAfter,
    };
  }

  function successor() {
    if (shown(last.at)) return last.at;
    if (last.id) {
      const at = document.getElementById(last.id);
      if (at && shown(at)) return at;
    }
    const within = last.key ? document.querySelector(`[data-focus="${CSS.escape(last.key)}"]`) : null;
    const same = alike(last.at).filter((one) => name(one) === last.name && shown(one) && (!within || within.contains(one)));
    return same[Math.min(within ? 0 : last.place, same.length - 1)];
  }

  function restore() {
    if (!last || document.querySelector("dialog[open]")) return;
    const now = document.activeElement;
    if (now && now !== document.body && shown(now)) return; // a hidden element loses the focus slightly later
    const away = last.after && !shown(last.at) ? document.querySelector(last.after) : null;
    const at = successor() ?? (away && shown(away) ? away : null);
    if (at) at.focus({ preventScroll: true });
  }

  document.addEventListener("focusin", (event) => remember(event.target));
  // An element that loses the focus but stays on the page was not redrawn.
  document.addEventListener("focusout", ({ target, relatedTarget }) => {
    if (relatedTarget) return;
    // A removed element is still connected during this event, but no longer afterwards.
    queueMicrotask(() => { if (last?.at === target && shown(target) && document.activeElement === document.body) last = null; });
  });
  // After a click outside all controls, or a Tab that leaves the page, no element needs the focus.
  document.addEventListener("pointerdown", (event) => {
    if (!event.target.closest?.("button, a, input, select, textarea, summary, label, [tabindex]")) last = null;
  }, true);
  document.addEventListener("keydown", (event) => { if (event.key === "Tab" && document.activeElement === document.body) last = null; }, true);
  // A table that overflows is a tab stop, so that keys can scroll it.
  const widths = new ResizeObserver((all) => all.forEach(({ target }) => reach(target.closest(".scroll"))));
  function reach(at) {
    if (!at) return; // the element was removed
    const larger = at.scrollWidth > at.clientWidth || at.scrollHeight > at.clientHeight;
    for (const [key, value] of [["tabindex", "0"], ["role", "group"], ["aria-label", at.firstElementChild?.getAttribute("aria-label") ?? ""]]) {
      if (larger) at.setAttribute(key, value);
      else at.removeAttribute(key);
    }
  }
  function watchWidths() {
    for (const at of document.querySelectorAll(".scroll:not([data-watched])")) {
      at.dataset.watched = "";
      for (const one of [at, ...at.children]) widths.observe(one);
    }
  }

  document.addEventListener("DOMContentLoaded", () => {
    new MutationObserver(() => { restore(); watchWidths(); }).observe(document.body, {
      childList: true, subtree: true, attributes: true, attributeFilter: ["class", "disabled", "hidden", "open"],
    });
  });

  // Tabs and toolbars are one tab stop each; arrows, Home and End move within them.
  const STEPS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };
  document.addEventListener("keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
    const list = event.target.closest?.("[role=tablist], [data-roving]");
    if (!list || event.target.matches("input, select, textarea")) return;
    const tabs = list.getAttribute("role") === "tablist";
    const all = [...list.querySelectorAll(tabs ? "[role=tab]" : "button, a[href]")].filter(shown);
    const from = all.indexOf(event.target.closest("[role=tab], button, a"));
    const to = { Home: 0, End: all.length - 1 }[event.key] ?? (event.key in STEPS ? (from + STEPS[event.key] + all.length) % all.length : -1);
    if (from < 0 || to < 0) return;
    event.preventDefault();
    for (const one of all) one.tabIndex = one === all[to] ? 0 : -1;
    all[to].focus();
    if (tabs) all[to].click();
  });
})();
