// Stop of the machine: sent directly to the studio, even if the page's connection hangs. Esc and Pause do the same
// while the machine moves, wherever the focus is.
(() => {
  const bar = () => document.querySelector("[data-machine-stop]");
  const seen = (at) => at && at.getClientRects().length > 0;

  async function stop(at) {
    at.dataset.sent = "true";
    try {
      const answer = await fetch("/api/machine/stop", { method: "POST" });
      if (!answer.ok) throw new Error(answer.status);
    } catch {
      at.dataset.sent = "lost"; // shown by the style sheet
      return;
    }
    setTimeout(() => delete at.dataset.sent, 600);
  }

  document.addEventListener("click", (event) => {
    const at = event.target.closest?.("[data-machine-stop]");
    if (at) stop(at);
  }, true);
  window.addEventListener("keydown", (event) => {
    if (event.key !== "Escape" && event.key !== "Pause") return;
    const at = bar();
    if (!seen(at) || (event.key === "Escape" && at.dataset.moves !== "true")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    stop(at);
  }, true);
})();
