// General behaviour of the page, independent of leafcut: theme, copying, shortcuts, dialogs.
// A classic script, because a module runs after the first painting, in the wrong theme.
(() => {
  const root = document.documentElement;
  /** Return a value that the server passes to the page.
   * @param {string} name */
  function metaContent(name) { return /** @type {HTMLMetaElement | null} */ (document.querySelector(`meta[name=leafcut-${name}]`))?.content ?? ""; }
  /** Return the element around the target of an event.
   * @param {Event} event @param {string} selector */
  function around({ target }, selector) {
    return target instanceof Element ? /** @type {HTMLElement | null} */ (target.closest(selector)) : null;
  }
  root.lang = metaContent("language");
  const theme = localStorage.getItem("leafcut-theme");
  if (theme) root.dataset.theme = theme;

  const dark = () =>
    root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  /** Show another text on a button for a while; `then` runs at the end.
   * @param {HTMLElement} at @param {string | undefined} words @param {number} ms */
  function instead(at, words = "", ms, then = () => {}) {
    if (at.dataset.words) return;
    const own = (at.dataset.words = at.textContent);
    at.textContent = words;
    setTimeout(() => {
      if (at.textContent === words) at.textContent = own;
      delete at.dataset.words;
      then();
    }, ms);
  }
  // Irreversible actions need a second click.
  document.addEventListener("click", (event) => {
    const at = around(event, "[data-sure]");
    if (!at || at.dataset.asked) return;
    event.stopPropagation();
    at.dataset.asked = "true";
    instead(at, at.dataset.sure, 4000, () => { delete at.dataset.asked; });
  }, true);
  document.addEventListener("DOMContentLoaded", () => {
    const lost = metaContent("lost").split("|");
    document.querySelectorAll("#popup > span").forEach((line, k) => { line.textContent = lost[k] || line.textContent; });
  });
  // Switching the language reloads the current page, which keeps its choices.
  document.addEventListener("click", (event) => {
    const lang = around(event, ".languages a")?.lang, address = new URLSearchParams(location.search);
    if (!lang) return;
    event.preventDefault();
    address.set("lang", lang);
    history.replaceState(history.state, "", `?${address}`);
    location.reload();
  });
  // A click outside an open menu, or on one of its links, closes it.
  document.addEventListener("click", (event) => {
    for (const menu of document.querySelectorAll(".more-files[open]")) {
      if (!event.composedPath().includes(menu) || around(event, "a")) menu.removeAttribute("open");
    }
  });

  document.addEventListener("click", async (event) => {
    const at = around(event, "[data-theme-switch], [data-copy], [data-dialog], [data-close]");
    if (!at) return;
    if ("themeSwitch" in at.dataset) {
      root.dataset.theme = dark() ? "light" : "dark";
      localStorage.setItem("leafcut-theme", root.dataset.theme);
    } else if (at.dataset.copy) {
      const from = document.getElementById(at.dataset.copy);
      if (!from) return;
      await navigator.clipboard.writeText(from.textContent).then(
        () => instead(at, at.dataset.said, 2000),
        () => getSelection()?.selectAllChildren(from),
      );
    } else if (at.dataset.dialog) {
      /** @type {HTMLDialogElement | null} */ (document.getElementById(at.dataset.dialog))?.showModal();
    } else {
      at.closest("dialog")?.close();
    }
  });

  // Folded columns stay folded, also on the next page.
  const folded = new Set((localStorage.getItem("leafcut-folded") ?? "").split(" ").filter(Boolean));
  const tellFolded = () => {
    root.dataset.folded = [...folded].join(" ");
    const buttons = /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-fold]"));
    buttons.forEach((at) => at.setAttribute("aria-expanded", String(!folded.has(at.dataset.fold ?? ""))));
    return buttons.length > 0;
  };
  if (!tellFolded()) {
    const watch = new MutationObserver(() => { if (tellFolded()) watch.disconnect(); });
    watch.observe(root, { childList: true, subtree: true });
  }
  document.addEventListener("click", (event) => {
    const side = around(event, "[data-fold]")?.dataset.fold;
    if (!side) return;
    if (!folded.delete(side)) folded.add(side);
    localStorage.setItem("leafcut-folded", [...folded].join(" "));
    tellFolded();
  });
  // In one column, the running job is below the button that starts it.
  document.addEventListener("click", (event) => {
    const narrow = matchMedia("(max-width: 760px)").matches;
    if (narrow && around(event, '[data-key="r"]')) document.querySelector(".middle")?.scrollIntoView();
  });
  // Run applies to the file that is being uploaded, so wait for it.
  document.addEventListener("click", (event) => {
    const at = around(event, "[data-key~=r]");
    if (!at || !window.leafcutSending) return;
    event.stopPropagation();
    window.leafcutSending.then((came) => { if (came) at.click(); });
  }, true);

  /** Return the first visible element with a shortcut that is not disabled.
   * @param {string} key */
  function withKey(key) {
    const all = /** @type {NodeListOf<HTMLButtonElement>} */ (document.querySelectorAll(`[data-key~="${CSS.escape(key)}"]`));
    return [...all].find((at) => at.getClientRects().length > 0 && !at.disabled);
  }

  document.addEventListener("keydown", (event) => {
    const held = event.ctrlKey || event.metaKey, run = event.key === "Enter" && held && withKey("r");
    if (event.altKey || document.querySelector("dialog[open]")) return;
    if (run) {
      event.preventDefault();
      if (document.activeElement instanceof HTMLElement) document.activeElement.blur(); // a field reports its text when it loses the focus
      run.click();
      return;
    }
    const undo = { z: event.shiftKey ? "y" : "u", y: "y" }[event.key.toLowerCase()];
    if (held && !undo) return;
    if (around(event, "input:not([type=checkbox], [type=file]), select, textarea, [contenteditable]:not([aria-readonly=true])")) return;
    if (event.defaultPrevented) return;
    if (event.shiftKey && !held && /^[a-z]$/i.test(event.key)) return; // letters with Shift belong to the drawing
    const at = withKey(held && undo ? undo : event.key === "Escape" ? "esc" : event.key.toLowerCase());
    if (!at) return;
    event.preventDefault();
    (/** @type {HTMLElement | null} */ (at.querySelector("input[type=file]")) ?? at).click();
  });
})();
