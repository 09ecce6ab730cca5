// What the page does by itself: theme, copying, shortcuts, dialogues. Nothing here knows what leafcut does.
(() => {
  const root = document.documentElement;
  root.lang = document.querySelector("meta[name=leafcut-language]").content;
  const theme = localStorage.getItem("leafcut-theme");
  if (theme) root.dataset.theme = theme;

  const dark = () =>
    root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  const say = (text) => {
    const place = document.getElementById("said");
    if (place) place.textContent = text;
  };
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
        () => say(at.dataset.said),
        () => getSelection().selectAllChildren(from),
      );
    } else if (at.dataset.dialog) {
      document.getElementById(at.dataset.dialog).showModal();
    } else {
      at.closest("dialog").close();
    }
  });

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (event.target.closest?.("input:not([type=checkbox]), select, textarea, [contenteditable]")) return;
    if (event.defaultPrevented) return;
    const key = event.key === "Escape" ? "esc" : event.key.toLowerCase();
    const at = [...document.querySelectorAll(`[data-key="${CSS.escape(key)}"]`)].find((e) => seen(e) && !e.disabled);
    if (!at) return;
    event.preventDefault();
    (at.querySelector("input[type=file]") ?? at).click();
  });
})();
