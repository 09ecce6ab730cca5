// Shows the progress of a job in title and icon of the tab, and a notification at its end if the user wants it.

/** `share`: completed part, percent; `job`: its id. @typedef {{ job?: string, name?: string, state?: string, share?: number }} Job */

const KEPT = "leafcut-notice";
const TITLE = document.title || "leafcut studio";
/** @type {Record<string, string>} */
const SIGNS = { waiting: "…", running: "▶", done: "✓", stopped: "✓", failed: "✗", cancelled: "✗", interrupted: "✗" };
const STAYS = 4000; // ms for which the tab still shows the end of a job after the user has seen it

let last = /** @type {Job} */ ({}), words = /** @type {Record<string, string>} */ ({});
let seenData = /** @type {string | undefined} */ (undefined);
let plain = /** @type {string | null | undefined} */ (null); // address of the page's own icon

/** @param {Job} job */
function isOver({ state = "" }) { return state in SIGNS && state !== "waiting" && state !== "running"; }

/** Whether the user wants notifications, and the browser allows them. */
function isAllowed() { return window.Notification?.permission === "granted"; }
function isWanted() { return localStorage.getItem(KEPT) === "on" && isAllowed(); }

/** Return an icon with a ring that shows the progress; green at the end.
 * @param {number} share @param {boolean} over */
function icon(share, over) {
  const round = 2 * Math.PI * 12, done = over ? round : (round * share) / 100;
  const ring = `<circle cx="16" cy="16" r="12" fill="none" stroke="#8a978f" stroke-opacity=".45" stroke-width="6"/>`
    + `<circle cx="16" cy="16" r="12" fill="${over ? "#1d6b41" : "none"}" stroke="#1d6b41" stroke-width="6" stroke-dasharray="${done} ${round}" transform="rotate(-90 16 16)"/>`;
  return `data:image/svg+xml,${encodeURIComponent(`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">${ring}</svg>`)}`;
}

/** Show a job in the tab; without a state, the page's own title and icon.
 * @param {Job} job */
function show(job) {
  const { state, share = 0, name } = job, link = /** @type {HTMLLinkElement | null} */ (document.querySelector("link[rel~=icon]"));
  plain ??= link?.getAttribute("href");
  document.title = state ? `${SIGNS[state]}${state === "running" && share ? ` ${share} %` : ""} ${name} – leafcut` : TITLE;
  if (link && plain) link.href = state ? icon(share, isOver(job)) : plain;
}

/** @param {Job} job */
function notify({ job, name, state = "" }) {
  if (!isWanted() || !document.hidden) return;
  const notification = new Notification(`${name} – leafcut`, { body: words[state] ?? words.done, tag: job });
  notification.onclick = () => {
    window.focus();
    notification.close();
  };
}

/** @param {Job} job */
function take(job) {
  const ended = isOver(job) && last.job === job.job && !isOver(last);
  last = job;
  if (ended || !isOver(job)) show(job); // ignore jobs that had ended before the page was loaded
  if (!ended) return;
  notify(job);
  if (document.hasFocus()) seen();
}

/** Remove the end of a job from the tab after a while: the user is active on the page and sees it. */
function seen() {
  if (document.hidden || !isOver(last)) return;
  setTimeout(() => { if (isOver(last)) show({}); }, STAYS);
}

/** Store the user's choice; ask for the browser's permission.
 * @param {HTMLInputElement} box */
async function choose(box) {
  if (box.checked && window.Notification && Notification.permission === "default") await Notification.requestPermission();
  if (box.checked && !isAllowed()) {
    box.checked = false;
    box.title = words.blocked;
    box.closest("label")?.setAttribute("title", words.blocked);
  }
  localStorage.setItem(KEPT, box.checked ? "on" : "off");
}

document.addEventListener("DOMContentLoaded", () => {
  new MutationObserver(() => {
    const badge = document.getElementById("badge");
    if (!badge) return;
    if (badge.dataset.words && !words.done) words = JSON.parse(badge.dataset.words);
    if (badge.dataset.job !== seenData) {
      seenData = badge.dataset.job;
      take(JSON.parse(seenData || "{}"));
    }
    for (const box of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll("[data-notice]:not([data-known])"))) {
      box.dataset.known = "true";
      box.checked = isWanted();
      box.addEventListener("change", () => choose(box));
    }
  }).observe(document.body, { childList: true, subtree: true, attributes: true, attributeFilter: ["data-job"] });
});
document.addEventListener("visibilitychange", seen);
window.addEventListener("focus", seen);
document.addEventListener("pointerdown", seen);
