// What the page does by itself: theme, copying, shortcuts, dialogues. Nothing here knows what leafcut does.
(() => {
  const root = document.documentElement;
  root.lang = document.querySelector("meta[name=leafcut-language]").content;
  const theme = localStorage.getItem("leafcut-theme");
  if (theme) root.dataset.theme = theme;

  const dark = () =>
    root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  /** Let a button say something else for a while. */
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
  // What cannot be taken back is asked for twice.
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
  // Another language shows the same job.
  document.addEventListener("click", (event) => {
    const at = event.target.closest?.(".languages a"), job = new URLSearchParams(location.search).get("job");
    if (at && job) at.search = new URLSearchParams({ lang: at.lang, job });
  });
  const seen = (e) => e.getClientRects().length > 0;

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

  document.addEventListener("keydown", (event) => {
    if (event.altKey || document.querySelector("dialog[open]")) return;
    const undo = { z: event.shiftKey ? "y" : "u", y: "y" }[event.key.toLowerCase()], held = event.ctrlKey || event.metaKey;
    if (held && !undo) return;
    if (event.target.closest?.("input:not([type=checkbox]), select, textarea, [contenteditable]")) return;
    if (event.defaultPrevented) return;
    if (event.shiftKey && !held && /^[a-z]$/i.test(event.key)) return; // a letter with Shift is the drawing's
    const key = held ? undo : event.key === "Escape" ? "esc" : event.key.toLowerCase();
    const at = [...document.querySelectorAll(`[data-key~="${CSS.escape(key)}"]`)].find((e) => seen(e) && !e.disabled);
    if (!at) return;
    event.preventDefault();
    (at.querySelector("input[type=file]") ?? at).click();
  });
})();
