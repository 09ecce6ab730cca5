// Shows the progress of a job in title and icon of the tab, and a notification at its end if the user wants it.
(() => {
  const KEPT = "leafcut-notice";
  const TITLE = document.title || "leafcut studio";
  const SIGNS = { waiting: "…", running: "▶", done: "✓", stopped: "✓", failed: "✗", cancelled: "✗", interrupted: "✗" };
  const OVER = new Set(["done", "stopped", "failed", "cancelled", "interrupted"]);
  const STAYS = 4000; // ms for which the tab still shows the end of a job after the user has seen it
  let last = {}, plain = null, words = {};

  /** Return an icon with a ring that shows the progress; green at the end. */
  function icon(share, over) {
    const round = 2 * Math.PI * 12, done = over ? round : (round * share) / 100;
    const ring = `<circle cx="16" cy="16" r="12" fill="none" stroke="#8a978f" stroke-opacity=".45" stroke-width="6"/>`
      + `<circle cx="16" cy="16" r="12" fill="${over ? "#1d6b41" : "none"}" stroke="#1d6b41" stroke-width="6" stroke-dasharray="${done} ${round}" transform="rotate(-90 16 16)"/>`;
    return `data:image/svg+xml,${encodeURIComponent(`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">${ring}</svg>`)}`;
  }

  function show(job) {
    const link = document.querySelector("link[rel~=icon]");
    plain ??= link?.getAttribute("href");
    const over = OVER.has(job.state);
    const share = job.state === "running" && job.share ? ` ${job.share} %` : "";
    document.title = job.state ? `${SIGNS[job.state]}${share} ${job.name} – leafcut` : TITLE;
    if (link && plain) link.href = job.state ? icon(job.share, over) : plain;
  }

  function tell(job) {
    const wanted = localStorage.getItem(KEPT) === "on" && window.Notification?.permission === "granted";
    if (!wanted || !document.hidden) return;
    const made = new Notification(`${job.name} – leafcut`, { body: words[job.state] ?? words.done, tag: job.job });
    made.onclick = () => { window.focus(); made.close(); };
  }

  function look(at) {
    const job = JSON.parse(at.dataset.job || "{}"), over = OVER.has(job.state);
    const ended = over && last.job === job.job && !OVER.has(last.state);
    last = job;
    if (!over) show(job);
    if (!ended) return; // ignore jobs that had ended before the page was loaded
    show(job);
    tell(job);
    if (document.hasFocus()) seen();
  }

  /** Remove the end of a job from the tab after a while: the user is active on the page and sees it. */
  function seen() {
    if (document.hidden || !OVER.has(last.state)) return;
    setTimeout(() => { if (OVER.has(last.state)) show({}); }, STAYS);
  }

  async function ask(at) {
    if (at.checked && window.Notification && Notification.permission === "default") await Notification.requestPermission();
    const allowed = window.Notification?.permission === "granted";
    if (at.checked && !allowed) {
      at.checked = false;
      at.title = words.blocked;
      at.closest("label")?.setAttribute("title", words.blocked);
    }
    localStorage.setItem(KEPT, at.checked ? "on" : "off");
  }

  document.addEventListener("DOMContentLoaded", () => {
    new MutationObserver(() => {
      const at = document.getElementById("badge");
      if (!at) return;
      if (at.dataset.words && !words.done) words = JSON.parse(at.dataset.words);
      if (at.dataset.job !== at.seen) { at.seen = at.dataset.job; look(at); }
      for (const one of document.querySelectorAll("[data-notice]:not([data-known])")) {
        one.dataset.known = "true";
        one.checked = localStorage.getItem(KEPT) === "on" && window.Notification?.permission === "granted";
        one.addEventListener("change", () => ask(one));
      }
    }).observe(document.body, { childList: true, subtree: true, attributes: true, attributeFilter: ["data-job"] });
  });
  document.addEventListener("visibilitychange", seen);
  window.addEventListener("focus", seen);
  document.addEventListener("pointerdown", seen);
})();
