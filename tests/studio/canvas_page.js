// A page with the drawing, and no server behind them but files.

import { Drawing } from "/static/canvas.js";

const at = (id) => document.getElementById(id);
const drawing = new Drawing(at("drawing"), { words: await (await fetch("/words.json")).json() });
const events = [];
for (const name of ["hover", "select", "time", "drag", "mode"]) drawing.on(name, (detail) => events.push([name, detail]));

/** Fetch scenes of one name and show those that are there. */
async function load(name, layers = ["part", "before", "after"]) {
  for (const layer of layers) {
    const bytes = await (await fetch(`/scene/${name}.${layer}`)).arrayBuffer();
    drawing.show(bytes, layer);
  }
}

/** Wait until the drawing has nothing left to draw. */
const settled = () => new Promise((done) => {
  const wait = () => (drawing._request ? requestAnimationFrame(wait) : done());
  requestAnimationFrame(wait);
});

Object.assign(window, {
  drawing, events, load, settled,
});
window.loaded = true;
