// Scenes as bytes, in the format of studio/drawing/scene.py.

import { readScene } from "../../src/leafcut/studio/static/scene.js";

const KINDS = { Float64Array: "f8", Float32Array: "f4", Int32Array: "i4", Uint32Array: "u4", Uint8Array: "u1" };

/** Return the bytes of a scene. */
export function packed(header, blocks) {
  const table = {}, parts = [];
  let offset = 0;
  for (const [name, column] of Object.entries(blocks)) {
    const size = 8 * Math.ceil(column.byteLength / 8), bytes = new Uint8Array(size);
    bytes.set(new Uint8Array(column.buffer, column.byteOffset, column.byteLength));
    table[name] = [KINDS[column.constructor.name], offset, column.length, 1];
    parts.push(bytes);
    offset += size;
  }
  const text = new TextEncoder().encode(JSON.stringify({ origin: [0, 0], extents: [0, 0, 100, 100], ...header, blocks: table }));
  const size = 8 * Math.ceil(text.length / 8), head = new Uint8Array(16 + size).fill(32);
  head.set(new TextEncoder().encode("LCSCENE1"));
  new DataView(head.buffer).setUint32(8, size, true);
  new DataView(head.buffer).setUint32(12, 0, true);
  head.set(text, 16);
  const all = new Uint8Array(head.length + offset);
  let at = 0;
  for (const part of [head, ...parts]) {
    all.set(part, at);
    at += part.length;
  }
  return all.buffer;
}

/** Return a toolpath; each row is { to: [x, y, z], doing, seconds, line, source, tool, arc }. */
export function toolpath(rows, { stop = [], pierce = [], header = {} } = {}) {
  const column = (key, fallback) => rows.map((row, k) => row[key] ?? fallback(k)), arcs = [...rows.keys()].filter((k) => rows[k].arc);
  return readScene(packed({ kind: "toolpath", which: "after", tools: {}, ...header }, {
    doing: Uint8Array.from(column("doing", () => 1)), place: Float32Array.from(column("to", () => 0).flat()),
    seconds: Float32Array.from(column("seconds", () => 1)), line: Uint32Array.from(column("line", (k) => k + 1)),
    source: Uint32Array.from(column("source", (k) => k)), feed: Float32Array.from(column("feed", () => 10)),
    tool: Uint32Array.from(column("tool", () => 1)), arc_row: Uint32Array.from(arcs),
    arc: Float32Array.from(arcs.flatMap((k) => rows[k].arc)), stop: Uint32Array.from(stop), pierce: Float32Array.from(pierce.flat()),
    lead: new Float32Array(), text: new Uint8Array(),
  }));
}

/** Return a part with holes [x, y, diameter] and outlines { vertices: [x, y, bulge][], closed }. */
export function part({ holes = [], outlines = [], header = {} }) {
  let first = 0;
  const outline = outlines.flatMap(({ vertices, closed = true }, k) => {
    first += vertices.length;
    return [first - vertices.length, vertices.length, closed ? 16 : 0, k];
  });
  return readScene(packed({ kind: "part", layers: [], issues: [], ...header }, {
    hole: Float32Array.from(holes.flat()), hole_tool: Int32Array.from(holes, () => 0), slot: new Float32Array(),
    vertex: Float32Array.from(outlines.flatMap(({ vertices }) => vertices.flat())), outline: Uint32Array.from(outline), issue: new Float32Array(),
  }));
}

/** Return a repeatable source of numbers from 0 to 1. */
export function random(seed = 1) {
  let state = seed;
  return () => (state = (state * 16807) % 2147483647) / 2147483647;
}
