// The focus stays where a person put it, although parts of the page are drawn anew; arrows go through tabs and toolbars.
(() => {
  /** What has, or had, the focus, and by what what comes in its place is known. */
  let last = null;

  const shown = (at) => at.isConnected && at.getClientRects().length > 0 && !at.disabled;
  /** Return what an element is called; the text of one that asks "sure?" for a while is not its name. */
  const name = (at) => at.getAttribute("aria-label") ?? at.dataset.words ?? at.labels?.[0]?.textContent ?? at.textContent.trim();
  /** NiceGUI numbers its elements, and gives others to what is drawn anew: such an id says nothing. */
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
    if (now && now !== document.body && shown(now)) return; // what is hidden loses the focus a little later only
    const away = last.after && !shown(last.at) ? document.querySelector(last.after) : null;
    const at = successor() ?? (away && shown(away) ? away : null);
    if (at) at.focus({ preventScroll: true });
  }

  document.addEventListener("focusin", (event) => remember(event.target));
  // What gives up the focus by itself, still there to keep it, has not lost it to a page drawn anew.
  document.addEventListener("focusout", ({ target, relatedTarget }) => {
    if (relatedTarget) return;
    // What is taken off the page is still on it while this is said, and no more when the taking is over.
    queueMicrotask(() => { if (last?.at === target && shown(target) && document.activeElement === document.body) last = null; });
  });
  // Who clicks beside everything, or leaves the page by Tab, has no focus and wants none.
  document.addEventListener("pointerdown", (event) => {
    if (!event.target.closest?.("button, a, input, select, textarea, summary, label, [tabindex]")) last = null;
  }, true);
  document.addEventListener("keydown", (event) => { if (event.key === "Tab" && document.activeElement === document.body) last = null; }, true);
  // A table that is larger than its place is scrolled by keys, too: a stop of Tab as long as that is so.
  const widths = new ResizeObserver((all) => all.forEach(({ target }) => reach(target.closest(".scroll"))));
  function reach(at) {
    if (!at) return; // it was taken off
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

  // Tabs and toolbars are one stop of Tab each; arrows, Home and End go through them.
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
