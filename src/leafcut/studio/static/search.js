// Searching in sorted values, and for the nearest of several items.

/** Return the first index below `count` for which `holds` is true, or `count`. It must be true for all later ones.
 * @param {number} count @param {(index: number) => boolean} holds */
export function firstWhere(count, holds) {
  let low = 0, high = count;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (holds(middle)) high = middle; else low = middle + 1;
  }
  return low;
}

/** Return the nearest item within `reach`, or -1; of equally near items the last, or the first.
 * @param {Iterable<number>} items @param {number} reach @param {(item: number) => number} distance
 * @param {"last" | "first"} [among] */
export function nearest(items, reach, distance, among = "last") {
  let best = -1, least = reach;
  for (const item of items) {
    const away = distance(item);
    if (away < least || (away === least && (best < 0 || (among === "last" ? item > best : item < best)))) {
      least = away;
      best = item;
    }
  }
  return best;
}
