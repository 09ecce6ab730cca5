// A tool in straight motion lowers every cell to its lowest height above it: kernels/sweep.py for the browser.
//
// Both have the same lines of code and give equal heights (compared in tests/studio/test_solid_browser.py).

/** Radius, flat, corner, reach, rise and slope of a tool (kernels/sweep.py).
 * @typedef {ArrayLike<number> & Iterable<number>} Shape */
/** Middle of the first cell, and side of the cells, mm.
 * @typedef {{ x: number, y: number, cell: number, rows: number, columns: number }} StockGrid */

const HALVINGS = 20;
/** Thinner layers are rounding errors, mm. */
const FILM = 1e-3;

/** Return the height of a tool's surface above its tip, mm, at the distance r from its axis.
 * @param {Shape} shape @param {number} r */
export function surface(shape, r) {
  const [, flat, corner, reach, rise, slope] = shape;
  if (r <= flat) return 0;
  if (r <= reach) {
    const out = r - flat;
    return corner - Math.sqrt(Math.max(corner * corner - out * out, 0));
  }
  return rise + slope * (r - reach);
}

/** @param {Shape} shape @param {number} d @param {number} grade @param {number} most */
function lowestOffset(shape, d, grade, most) {
  const [, flat, corner, reach, , slope] = shape, atReach = Math.sqrt(Math.max(reach * reach - d * d, 0));
  if (d >= reach || (slope > 0 && slope * atReach < grade * reach)) {
    if (slope <= grade) return most;
    return Math.min(Math.max((grade * d) / Math.sqrt(slope * slope - grade * grade), atReach), most);
  }
  const inner = Math.sqrt(Math.max(flat * flat - d * d, 0));
  if (corner <= 0) return Math.min(inner, most);
  if (flat <= 0) return Math.min(grade * Math.sqrt((corner * corner - d * d) / (1 + grade * grade)), most);
  let low = inner, high = atReach;
  for (let k = 0; k < HALVINGS; k++) {
    const w = 0.5 * (low + high), r = Math.sqrt(d * d + w * w), out = r - flat;
    if (out * w < grade * r * Math.sqrt(Math.max(corner * corner - out * out, 0))) low = w; else high = w;
  }
  return Math.min(0.5 * (low + high), most);
}

/** @param {Shape} shape @param {number} margin @param {number} along @param {number} d @param {number} length
 * @param {number} grade @param {number} enough */
function lowestHeight(shape, margin, along, d, length, grade, enough) {
  const radius = shape[0];
  if (length <= 0) return surface(shape, Math.min(Math.sqrt(d * d + along * along) + margin, radius));
  let w = Math.min(Math.max(0, -along), length - along);
  if (grade !== 0) {
    const bound = Math.min(0, grade * length) + surface(shape, Math.min(Math.sqrt(d * d + w * w) + margin, radius));
    if (bound >= enough) return bound;
    const edge = radius - margin;
    w = lowestOffset(shape, Math.abs(d), Math.abs(grade), Math.sqrt(Math.max(edge * edge - d * d, 0)));
    w = Math.min(Math.max(grade > 0 ? -w : w, -along), length - along);
  }
  return grade * (along + w) + surface(shape, Math.min(Math.sqrt(d * d + w * w) + margin, radius));
}

let stretchLow = 0, stretchHigh = 0;
/** Set the range in x of the row at y covered by a disc that moves from (0, 0) by (dx, dy); return whether it has one.
 * @param {number} y @param {number} dx @param {number} dy @param {number} radius */
function rowStretch(y, dx, dy, radius) {
  if (Math.abs(dy) < 1e-12) {
    if (Math.abs(y) > radius) return false;
    const half = Math.sqrt(radius * radius - y * y);
    stretchLow = Math.min(0, dx) - half;
    stretchHigh = Math.max(0, dx) + half;
    return true;
  }
  let enters = (y - radius) / dy, leaves = (y + radius) / dy;
  if (enters > leaves) [enters, leaves] = [leaves, enters];
  enters = Math.max(enters, 0);
  leaves = Math.min(leaves, 1);
  if (enters > leaves) return false;
  const side = (radius / Math.sqrt(dx * dx + dy * dy)) * (dy < 0 ? -1 : 1) * dx;
  let t = Math.min(Math.max((y - side) / dy, enters), leaves), v = y - t * dy;
  stretchLow = t * dx - Math.sqrt(Math.max(radius * radius - v * v, 0));
  t = Math.min(Math.max((y + side) / dy, enters), leaves);
  v = y - t * dy;
  stretchHigh = t * dx + Math.sqrt(Math.max(radius * radius - v * v, 0));
  return stretchLow <= stretchHigh;
}

/** Cut a field (`heights`, and `by`: number from 1 of the last move that cut a cell) by one move; extend `dirty`.
 *
 * `grid` has x, y, cell, rows and columns; `inset` reduces the tool's radius, mm; the tip moves from (x0, y0, z0) to
 * (x1, y1, z1).
 * @param {Float32Array} heights @param {Uint32Array} by @param {StockGrid} grid @param {Shape} shape
 * @param {number} x0 @param {number} y0 @param {number} z0 @param {number} x1 @param {number} y1 @param {number} z1
 * @param {number} inset @param {number} number @param {import("./boxes.js").Box} dirty */
export function sweep(heights, by, grid, shape, x0, y0, z0, x1, y1, z1, inset, number, dirty) {
  const { cell, rows, columns } = grid, radius = shape[0] - inset, flat = shape[1];
  if (radius <= 0) return;
  const xa = x0 - grid.x, ya = y0 - grid.y, dx = x1 - x0, dy = y1 - y0, dz = z1 - z0;
  let length = Math.sqrt(dx * dx + dy * dy), ux = 1, uy = 0, grade = 0;
  const zLow = Math.min(z0, z0 + dz);
  if (length < 1e-9) length = 0;
  else {
    ux = dx / length;
    uy = dy / length;
    grade = dz / length;
  }
  const zStart = length === 0 ? zLow : z0, level = grade === 0 && flat >= shape[0];
  const rowLow = Math.max(0, Math.ceil((Math.min(ya, ya + dy) - radius) / cell));
  const rowHigh = Math.min(rows - 1, Math.floor((Math.max(ya, ya + dy) + radius) / cell));
  for (let row = rowLow; row <= rowHigh; row++) {
    const y = row * cell - ya;
    if (!rowStretch(y, dx, dy, radius)) continue;
    const low = Math.max(0, Math.ceil((stretchLow + xa) / cell - 1e-9));
    const high = Math.min(columns - 1, Math.floor((stretchHigh + xa) / cell + 1e-9));
    let first = -1, last = -1;
    for (let column = low, at = row * columns + low; column <= high; column++, at++) {
      const h = heights[at];
      if (h <= zLow) continue;
      let z = zLow;
      if (!level) {
        const x = column * cell - xa;
        z = zStart + lowestHeight(shape, inset, x * ux + y * uy, y * ux - x * uy, length, grade, h - zStart);
      }
      if (z >= h) continue;
      heights[at] = z;
      if (h - z > FILM) by[at] = number;
      if (first < 0) first = column;
      last = column;
    }
    if (first < 0) continue;
    dirty[0] = Math.min(dirty[0], first);
    dirty[1] = Math.min(dirty[1], row);
    dirty[2] = Math.max(dirty[2], last + 1);
    dirty[3] = Math.max(dirty[3], row + 1);
  }
}
