// Cuts the stock in a worker: receives a time, goes there in slices, and reports the changes.

import { SolidStock } from "./solid_stock.js";

const SLICE = 12, REPORT = 30; // ms

/** @type {SolidStock | null} */
let stock = null;
let wanted = 0, turn = 0; // requested time, s, and number of the request
let reached = 0; // number of the last request whose time was reached
let running = false;
let heard = true; // the page has processed the last report
let reported = 0; // time of the last report, ms

self.onmessage = ({ data }) => {
  if (data.load) stock = new SolidStock(data.load.header, data.load.blocks);
  if (data.time !== undefined) [wanted, turn] = [data.time, data.turn];
  if (data.heard) heard = true;
  if (!running && stock && reached !== turn) run(stock);
};

/** Go to the requested time; each report waits until the page has processed the previous one.
 * @param {SolidStock} stock */
async function run(stock) {
  running = true;
  while (reached !== turn) {
    const asked = turn, there = stock.seek(wanted, SLICE);
    if (heard && (there || performance.now() - reported > REPORT)) report(stock, there, asked);
    await new Promise((next) => setTimeout(next, there ? 4 : 0));
  }
  running = false;
}

/** @param {SolidStock} stock @param {boolean} there @param {number} asked */
function report(stock, there, asked) {
  const found = stock.changes();
  reported = performance.now();
  if (there) reached = asked;
  heard = false;
  const moved = found ? [found.heights.buffer, found.by.buffer] : [];
  self.postMessage({ found, there, turn: asked, done: stock.done }, { transfer: moved });
}
