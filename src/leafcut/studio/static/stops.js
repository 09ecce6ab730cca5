// Stops of a toolpath by grid cell.

/** Return the number (from 0) of the first stop of a track within `reach` mm of a position, or -1. */
export function stopNear(track, x, y, reach) {
  const { scene } = track, [ox, oy] = scene.origin;
  let best = -1, least = reach;
  track.stops ??= stopCells(scene);
  const { cells, size } = track.stops, column = Math.floor((x - ox) / size), row = Math.floor((y - oy) / size);
  const span = Math.min(Math.max(Math.ceil(reach / size), 1), 3);
  for (let dx = -span; dx <= span; dx++) {
    for (let dy = -span; dy <= span; dy++) {
      for (const k of cells.get(cellKey(column + dx, row + dy)) ?? []) {
        const [sx, sy] = scene.stopPlace(k), away = Math.hypot(sx + ox - x, sy + oy - y);
        if (away < least || (away === least && best < 0)) {
          least = away;
          best = k;
        }
      }
    }
  }
  return best;
}

/** Return a number for a cell; distant cells may share it, so positions are compared as well. */
function cellKey(column, row) { return (column & 0x7fff) * 0x10000 + (row & 0xffff); }

function stopCells(scene) {
  const e = scene.extents ?? [0, 0, 1, 1];
  const size = Math.max(Math.sqrt(((e[2] - e[0]) * (e[3] - e[1])) / Math.max(scene.stop.length, 1)), 0.05), cells = new Map();
  for (let k = 0; k < scene.stop.length; k++) {
    const [x, y] = scene.stopPlace(k), key = cellKey(Math.floor(x / size), Math.floor(y / size));
    if (cells.has(key)) cells.get(key).push(k); else cells.set(key, [k]);
  }
  return { cells, size };
}
