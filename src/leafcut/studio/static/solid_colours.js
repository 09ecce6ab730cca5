// Colours of the stock: metal, depth, engagement, or feed.

/** @import { ToolpathScene } from "./scene.js" */

/** Colour scales, 0xRRGGBB. Lightness decreases monotonically, for readers with any colour vision. */
/** @type {Record<string, number[]>} */
const SCALES = {
  depth: [0xd2dcd3, 0xa8d4bd, 0x4da6ad, 0x2a6c96, 0x263270, 0x241344],
  engagement: [0xfdf0c4, 0xf9c873, 0xee8a4a, 0xcf4a4a, 0x912a62, 0x4f1a56],
  feed: [0xd9e4f8, 0x94c4e8, 0x4d9fc9, 0x35739f, 0x344a80, 0x2b1f55],
};
/** Uncut and cut metal in the light and the dark theme. */
const METAL = { light: { raw: 0xbcc4cb, cut: 0xe9e6dd, section: 0xd9774a }, dark: { raw: 0x7d8891, cut: 0xc9cfd1, section: 0xd0703f } };
/** Tool: shank, cutting part, and holder. */
export const TOOL = { shank: 0xb9c0c8, cuts: 0x8f98a3, holder: 0x6d7782 };
/** Last tone of scales; then the tones of cells that the other program leaves higher or lower, and of fixtures. */
export const SCALE_END = 252, MORE = 253, LESS = 254, FIXTURE = 255;
/** Colours of these three tones.
 * @type {Record<number, number>} */
const SPECIAL = { [MORE]: 0xd98c1f, [LESS]: 0x8a3ab0, [FIXTURE]: 0x8d7f70 };

export const COLOURINGS = ["metal", "depth", "engagement", "feed"];

/** Return the 256 colours of a colouring; the first is that of uncut material.
 * @param {string} colouring @param {boolean} dark @returns {number[]} */
export function paletteOf(colouring, dark) {
  const { raw, cut } = METAL[dark ? "dark" : "light"], scale = SCALES[colouring];
  const out = new Array(256).fill(cut);
  if (scale) for (let k = 0; k <= SCALE_END; k++) out[k] = mixed(scale, k / SCALE_END);
  if (colouring !== "depth") out[0] = raw;
  return Object.assign(out, SPECIAL);
}

/** @param {boolean} dark */
export function sectionColour(dark) { return METAL[dark ? "dark" : "light"].section; }

/** @param {number} colour */
function css(colour) { return `#${colour.toString(16).padStart(6, "0")}`; }

/** Return the CSS colour of one of the special tones.
 * @param {number} tone */
export function toneCss(tone) { return css(SPECIAL[tone]); }

/** Return a scale as CSS, from left to right.
 * @param {string} colouring */
export function scaleCss(colouring) { return `linear-gradient(to right, ${SCALES[colouring].map(css).join(", ")})`; }

/** Return the tone (0 … 255) of each move by its number from 1, and of uncut material at index 0. `most` is the
 * highest feed, mm/s.
 * @param {string} colouring @param {{ row: Uint32Array, width: Uint8Array, rapid: Uint8Array }} blocks
 * @param {Pick<ToolpathScene, "feed">} scene */
export function tonesOf(colouring, blocks, scene) {
  const { row, width, rapid } = blocks, tones = new Uint8Array(row.length + 1);
  let most = 0;
  for (let k = 0; k < row.length; k++) if (!rapid[k]) most = Math.max(most, scene.feed[row[k]]);
  for (let k = 0; k < row.length; k++) {
    const share = colouring === "engagement" ? width[k] / 255 : colouring === "feed" && most > 0 ? scene.feed[row[k]] / most : 0;
    tones[k + 1] = 1 + Math.round((SCALE_END - 1) * Math.min(share, 1));
  }
  return { tones, most };
}

/** @param {number[]} scale @param {number} share */
function mixed(scale, share) {
  const at = share * (scale.length - 1), k = Math.min(Math.floor(at), scale.length - 2), part = at - k, [a, b] = [scale[k], scale[k + 1]];
  const channel = (/** @type {number} */ shift) => Math.round(((a >> shift) & 255) * (1 - part) + ((b >> shift) & 255) * part) << shift;
  return channel(16) | channel(8) | channel(0);
}
