// Cuts the stock in a worker: receives a time, goes there in slices, and reports the changes.

import { SolidStock } from "./solid_stock.js";

const SLICE = 12, TELL = 30; // ms

let stock = null, wanted = 0, running = false, heard = true, told = 0, turn = 0;

self.onmessage = ({ data }) => {
  if (data.load) stock = new SolidStock(data.load.header, data.load.blocks);
  if (data.time !== undefined) [wanted, turn] = [data.time, data.turn];
  if (data.heard) heard = true;
  if (!running && stock && told !== turn) run();
};

/** Go to the requested time; each report waits until the page has processed the previous one. */
async function run() {
  running = true;
  while (told !== turn) {
    const asked = turn, there = stock.seek(wanted, SLICE);
    if (heard && (there || performance.now() - lately > TELL)) tell(there, asked);
    await new Promise((next) => setTimeout(next, there ? 4 : 0));
  }
  running = false;
}

let lately = 0;
function tell(there, asked) {
  const found = stock.changes();
  lately = performance.now();
  if (there) told = asked;
  heard = false;
  const moved = found ? [found.heights.buffer, found.by.buffer, found.relief.buffer] : [];
  self.postMessage({ found, there, turn: asked, done: stock.done }, moved);
}
