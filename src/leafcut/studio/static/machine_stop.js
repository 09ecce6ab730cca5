// Stop of the machine: sent directly to the studio, even if the page's connection hangs. Esc and Pause do the same
// while the machine moves, wherever the focus is.

const STOP = "[data-machine-stop]";

/** @param {HTMLElement} bar */
async function stop(bar) {
  bar.dataset.sent = "true";
  const answer = await fetch("/api/machine/stop", { method: "POST" }).catch(() => null);
  if (answer?.ok) setTimeout(() => delete bar.dataset.sent, 600);
  else bar.dataset.sent = "lost"; // shown by the style sheet
}

document.addEventListener("click", (event) => {
  const bar = event.target instanceof Element ? /** @type {HTMLElement | null} */ (event.target.closest(STOP)) : null;
  if (bar) stop(bar);
}, true);
window.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" && event.key !== "Pause") return;
  const bar = /** @type {HTMLElement | null} */ (document.querySelector(STOP));
  if (!bar?.getClientRects().length || (event.key === "Escape" && bar.dataset.moves !== "true")) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  stop(bar);
}, true);
