// General behaviour of the page, independent of leafcut: theme, copying, shortcuts, dialogs.
(() => {
  const root = document.documentElement;
  root.lang = document.querySelector("meta[name=leafcut-language]").content;
  const theme = localStorage.getItem("leafcut-theme");
  if (theme) root.dataset.theme = theme;

  const dark = () =>
    root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  /** Show another text on a button for a while. */
  const instead = (at, words, ms, then = () => {}) => {
    if (at.dataset.words) return;
    at.dataset.words = at.textContent;
    at.textContent = words;
    setTimeout(() => {
      if (at.textContent === words) at.textContent = at.dataset.words;
      delete at.dataset.words;
      then();
    }, ms);
  };
  // Irreversible actions need a second click.
  document.addEventListener(
    "click",
    (event) => {
      const at = event.target.closest?.("[data-sure]");
      if (!at || at.dataset.asked) return;
      event.stopPropagation();
      at.dataset.asked = "true";
      instead(at, at.dataset.sure, 4000, () => delete at.dataset.asked);
    },
    true,
  );
  document.addEventListener("DOMContentLoaded", () => {
    const lost = document.querySelector("meta[name=leafcut-lost]")?.content.split("|") ?? [];
    document.querySelectorAll("#popup > span").forEach((e, k) => { e.textContent = lost[k] ?? e.textContent; });
  });
  // Switching the language does not leave the current page.
  document.addEventListener("click", (event) => {
    const at = event.target.closest?.(".languages a");
    if (at) at.search = new URLSearchParams({ ...Object.fromEntries(new URLSearchParams(location.search)), lang: at.lang });
  });
  const seen = (e) => e.getClientRects().length > 0;
  // A click outside an open menu, or on one of its links, closes it.
  document.addEventListener("click", (event) => {
    for (const menu of document.querySelectorAll(".more-files[open]")) {
      if (!menu.contains(event.target) || event.target.closest("a")) menu.open = false;
    }
  });

  document.addEventListener("click", async (event) => {
    const at = event.target.closest?.("[data-theme-switch], [data-copy], [data-dialog], [data-close]");
    if (!at) return;
    if ("themeSwitch" in at.dataset) {
      root.dataset.theme = dark() ? "light" : "dark";
      localStorage.setItem("leafcut-theme", root.dataset.theme);
      document.dispatchEvent(new CustomEvent("leafcut-theme"));
    } else if (at.dataset.copy) {
      const from = document.getElementById(at.dataset.copy);
      await navigator.clipboard.writeText(from.textContent).then(
        () => instead(at, at.dataset.said, 2000),
        () => getSelection().selectAllChildren(from),
      );
    } else if (at.dataset.dialog) {
      document.getElementById(at.dataset.dialog).showModal();
    } else {
      at.closest("dialog").close();
    }
  });

  // Folded columns stay folded, also on the next page.
  const folded = new Set((localStorage.getItem("leafcut-folded") ?? "").split(" ").filter(Boolean));
  const tellFolded = () => {
    root.dataset.folded = [...folded].join(" ");
    const buttons = document.querySelectorAll("[data-fold]");
    buttons.forEach((at) => at.setAttribute("aria-expanded", String(!folded.has(at.dataset.fold))));
    return buttons.length > 0;
  };
  if (!tellFolded()) {
    const watch = new MutationObserver(() => { if (tellFolded()) watch.disconnect(); });
    watch.observe(root, { childList: true, subtree: true });
  }
  document.addEventListener("click", (event) => {
    const side = event.target.closest?.("[data-fold]")?.dataset.fold;
    if (!side) return;
    if (!folded.delete(side)) folded.add(side);
    localStorage.setItem("leafcut-folded", [...folded].join(" "));
    tellFolded();
  });
  // In one column, the running job is below the button that starts it.
  document.addEventListener("click", (event) => {
    const narrow = matchMedia("(max-width: 760px)").matches;
    if (narrow && event.target.closest?.('[data-key="r"]')) document.querySelector(".middle")?.scrollIntoView();
  });
  // Run applies to the file that is being uploaded, so wait for it.
  document.addEventListener(
    "click",
    (event) => {
      const at = event.target.closest?.("[data-key~=r]");
      if (!at || !window.leafcutSending) return;
      event.stopPropagation();
      window.leafcutSending.then((came) => came && at.click());
    },
    true,
  );

  document.addEventListener("keydown", (event) => {
    const run = event.key === "Enter" && (event.ctrlKey || event.metaKey) && document.querySelector("[data-key~=r]");
    if (run && seen(run) && !document.querySelector("dialog[open]")) {
      event.preventDefault();
      document.activeElement.blur(); // a field reports its text when it loses the focus
      run.click();
      return;
    }
    if (event.altKey || document.querySelector("dialog[open]")) return;
    const undo = { z: event.shiftKey ? "y" : "u", y: "y" }[event.key.toLowerCase()], held = event.ctrlKey || event.metaKey;
    if (held && !undo) return;
    if (event.target.closest?.("input:not([type=checkbox], [type=file]), select, textarea, [contenteditable]:not([aria-readonly=true])")) return;
    if (event.defaultPrevented) return;
    if (event.shiftKey && !held && /^[a-z]$/i.test(event.key)) return; // letters with Shift belong to the drawing
    const key = held ? undo : event.key === "Escape" ? "esc" : event.key.toLowerCase();
    const at = [...document.querySelectorAll(`[data-key~="${CSS.escape(key)}"]`)].find((e) => seen(e) && !e.disabled);
    if (!at) return;
    event.preventDefault();
    (at.querySelector("input[type=file]") ?? at).click();
  });
})();
