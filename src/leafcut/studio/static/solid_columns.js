// The stock in three dimensions, drawn by the processor, so that every browser shows it: each column of the screen is a
// line across the table, traversed from near to far.
//
// In a parallel projection every column of pixels sees the cells below one straight line. From near to far each cell
// adds its wall and its top above the filled part of the column, so that no pixel is drawn twice (the floating horizon
// of T. Wright, "A two-space solution to the hidden line problem", 1973, for cells).

import { contextOf, make } from "./icons.js";
import { sectioned } from "./solid_camera.js";
import { SCALE_END } from "./solid_colours.js";
import { surface } from "./sweep.js";

/** @import { Section, SolidCamera } from "./solid_camera.js" */
/** @import { Shape, StockGrid } from "./sweep.js" */
/** Stock: heights of the cells, their relief (solid_stock.js) and tone, and numbers of the moves that cut them last.
 * @typedef {{
 *   grid: StockGrid, floor: number, top: number, heights: Float32Array, by: Uint32Array, relief: Uint32Array,
 *   tint: Uint8Array,
 * }} Stock */
/** Section of a tool: lower and upper end above the tip, radius, colour, whether it is fluted.
 * @typedef {[number, number, number, number, boolean]} ToolPart */
/** Tool with its sections from the top down; `point`: height of its point.
 * @typedef {{
 *   x: number, y: number, z: number, shape: Shape, point: number, radius: number, parts: ToolPart[], long: number,
 *   largest: number,
 * }} Tool */
/** `ratio`: pixels of the screen per CSS pixel.
 * @typedef {{
 *   palette: number[], byHeight: boolean, bottom: number, ratio: number, section: Section, sectionColour: number,
 *   tool: Tool | null,
 * }} Look */
/** @typedef {number[]} Light */

const NOTHING = 1e30;
/** Distance of the hatching lines of a section, cells. */
const HATCH = 14;
/** Maximum rise from cell to cell, in cells, of a slope; steeper ones are walls. */
const STEP = 1.6;

export class ColumnRenderer {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.ctx = contextOf(canvas);
    this.buffer = make("canvas");
    this.inner = contextOf(this.buffer);
    this.image = new ImageData(1, 1);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this.far = new Float32Array(1);
    this.lit = new Float32Array(65536);
  }

  /** Draw a stock as seen by a camera, with `pixels` pixels per pixel of the screen.
   * @param {Stock} stock @param {SolidCamera} camera @param {Look} look @param {number} pixels */
  draw(stock, camera, look, pixels) {
    const width = Math.max(Math.round(camera.width * pixels), 1), height = Math.max(Math.round(camera.height_px * pixels), 1);
    this._room(width, height);
    this._columns(stock, camera, look, pixels, width, height);
    if (look.tool) this._tool(camera, look.tool, pixels, width, height);
    const { canvas, ctx } = this, wide = Math.round(camera.width * look.ratio);
    this.inner.putImageData(this.image, 0, 0);
    const high = Math.round(camera.height_px * look.ratio);
    if (canvas.width !== wide || canvas.height !== high) {
      canvas.width = wide;
      canvas.height = high;
    }
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.clearRect(0, 0, wide, high);
    ctx.imageSmoothingEnabled = wide !== width;
    ctx.imageSmoothingQuality = "high";
    // The columns are stored as rows; after the rotation the first pixel of each is its lowest.
    ctx.setTransform(0, -high / height, wide / width, 0, 0, high);
    ctx.drawImage(this.buffer, 0, 0);
  }

  /** @param {number} width @param {number} height */
  _room(width, height) {
    if (this.image.width === height && this.image.height === width) return;
    this.buffer.width = height;
    this.buffer.height = width;
    this.image = new ImageData(height, width);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this.far = new Float32Array(width * height);
  }

  /** @param {Stock} stock @param {SolidCamera} camera @param {Look} look @param {number} pixels @param {number} width
   * @param {number} height */
  _columns(stock, camera, look, pixels, width, height) {
    const { grid, heights, relief, tint, floor, top } = stock, { palette, byHeight, sectionColour } = look, { cell, columns } = grid;
    const { right, ahead, sin, cos } = camera.axes, k = camera.scale * pixels, box = sectioned(grid, look.section, camera);
    const out = this.pixels, away = this.far, { lit } = this, edgeX = grid.x - cell / 2, edgeY = grid.y - cell / 2;
    const light = lightOf(camera), walls = wallLights(light);
    for (let n = 0; n < 65536; n++) {
      const nx = ((n << 24) >> 24) / 127, ny = ((n << 16) >> 24) / 127;
      lit[n] = shade(nx, ny, Math.sqrt(Math.max(1 - nx * nx - ny * ny, 0)), light);
    }
    out.fill(0);
    away.fill(NOTHING);
    const toShade = SCALE_END / Math.max(top - look.bottom, 1e-6), stepUp = k * cos, stepOn = k * sin, base = height / 2 - (camera.z * cos) * k;
    const zOf = cos > 1e-6 ? 1 / stepUp : 0;
    for (let i = 0; i < width; i++) {
      const u = (i + 0.5 - width / 2) / k, px = camera.x + right[0] * u, py = camera.y + right[1] * u;
      let enters = -NOTHING, leaves = NOTHING, through = 0;
      if (Math.abs(ahead[0]) > 1e-9) {
        const a = (box.x0 - px) / ahead[0], b = (box.x1 - px) / ahead[0];
        enters = Math.min(a, b);
        leaves = Math.max(a, b);
        through = a < b ? 1 : 2;
      } else if (px < box.x0 || px >= box.x1) continue;
      if (Math.abs(ahead[1]) > 1e-9) {
        const a = (box.y0 - py) / ahead[1], b = (box.y1 - py) / ahead[1];
        if (Math.min(a, b) > enters) {
          enters = Math.min(a, b);
          through = a < b ? 3 : 4;
        }
        leaves = Math.min(leaves, Math.max(a, b));
      } else if (py < box.y0 || py >= box.y1) continue;
      if (enters >= leaves) continue;
      let face = through, cutFace = ["", "x0", "x1", "y0", "y1"][through] === box.cut;
      let column = Math.floor((px + ahead[0] * enters - edgeX) / cell + (through === 1 ? 1e-6 : through === 2 ? -1e-6 : 0));
      let row = Math.floor((py + ahead[1] * enters - edgeY) / cell + (through === 3 ? 1e-6 : through === 4 ? -1e-6 : 0));
      const sx = ahead[0] > 0 ? 1 : -1, sy = ahead[1] > 0 ? 1 : -1;
      const perX = Math.abs(ahead[0]) > 1e-9 ? cell / Math.abs(ahead[0]) : NOTHING, perY = Math.abs(ahead[1]) > 1e-9 ? cell / Math.abs(ahead[1]) : NOTHING;
      let nextX = perX < NOTHING ? (edgeX + (column + (sx > 0 ? 1 : 0)) * cell - px) / ahead[0] : NOTHING;
      let nextY = perY < NOTHING ? (edgeY + (row + (sy > 0 ? 1 : 0)) * cell - py) / ahead[1] : NOTHING;
      let t = enters, filled = 0, nearAt = -1;
      const line = i * height;
      while (t < leaves && filled < height) {
        if (column < 0 || row < 0 || column >= columns || row >= grid.rows) break;
        const at = row * columns + column, h = heights[at], end = Math.min(nextX, nextY, leaves);
        if (h > floor + 1e-6) {
          const ground = base + t * stepOn;
          // Wall facing the viewer.
          const up = Math.min(Math.ceil(ground + h * stepUp - 0.5), height);
          const from = Math.max(filled, Math.ceil(ground + floor * stepUp - 0.5), 0);
          if (up > from) {
            const code = relief[at], nearCode = nearAt >= 0 ? relief[nearAt] : code;
            // A small step belongs to a slope.
            const outer = nearAt < 0, sloped = !outer && h - heights[nearAt] < STEP * cell;
            const wall = outer ? 64 * [0, 2, 0, 3, 1][face] : (code >>> 16) & 255;
            const bright = sloped ? lit[code & 65535] * ((code >>> 24) / 200) : walls[wall];
            const tone = sloped || outer || tint[at] > SCALE_END ? tint[at] : tint[nearAt], own = tone > SCALE_END;
            const occluded = outer || sloped ? 1 : 0.55 + 0.45 * Math.min((nearCode >>> 24) / 200, 1);
            for (let p = from; p < up; p++) {
              const z = zOf ? (p + 0.5 - ground) * zOf : h;
              let colour = palette[own ? tone : byHeight ? heightTone(top - z, toShade) : outer ? 0 : tone];
              let part = bright * occluded * (outer ? 0.9 + (0.1 * (z - floor)) / (top - floor) : 1);
              if (cutFace) {
                colour = sectionColour;
                part = hatched(z + u, cell);
              }
              out[line + p] = toned(colour, part);
              away[line + p] = t * cos - (z - camera.z) * sin;
            }
          }
          if (up > filled) filled = Math.max(up, filled);
          // Top of the cell.
          const over = Math.min(Math.ceil(base + end * stepOn + h * stepUp - 0.5), height);
          if (over > filled) {
            const code = relief[at], part = lit[code & 65535] * ((code >>> 24) / 200);
            const colour = toned(palette[byHeight && tint[at] <= SCALE_END ? heightTone(top - h, toShade) : tint[at]], part), start = Math.max(filled, 0);
            for (let p = start; p < over; p++) {
              out[line + p] = colour;
              away[line + p] = (t + end) * 0.5 * cos - (h - camera.z) * sin;
            }
            filled = over;
          }
          nearAt = at;
        } else nearAt = at;
        cutFace = false;
        t = end;
        if (nextX < nextY) {
          column += sx;
          nextX += perX;
          face = sx > 0 ? 1 : 2;
        } else {
          row += sy;
          nextY += perY;
          face = sy > 0 ? 3 : 4;
        }
      }
    }
  }

  /** Draw the tool where the stock does not hide it.
   * @param {SolidCamera} camera @param {Tool} tool @param {number} pixels @param {number} width @param {number} height */
  _tool(camera, tool, pixels, width, height) {
    const [x0, y0, x1, y1] = toolRoom(camera, tool, pixels, width, height), light = lightOf(camera);
    for (let i = x0; i < x1; i++) {
      for (let p = y0; p < y1; p++) {
        const found = meetTool(camera, tool, (i + 0.5) / pixels, (height - p - 0.5) / pixels, light);
        if (!found || found[0] >= this.far[i * height + p]) continue;
        this.pixels[i * height + p] = toned(found[2], found[1]);
      }
    }
  }
}

/** Return the direction of the light, from the upper left of the viewer.
 * @param {SolidCamera} camera @returns {Light} */
function lightOf(camera) {
  const { right, ahead } = camera.axes, l = [-0.52, -0.42, 0.74];
  return [l[0] * right[0] + l[1] * ahead[0], l[0] * right[1] + l[1] * ahead[1], l[2]];
}

/** Return the brightness of a surface with a normal: about 1 for a horizontal surface.
 * @param {number} nx @param {number} ny @param {number} nz @param {Light} light */
function shade(nx, ny, nz, light) {
  return 0.44 + 0.2 * (0.5 + 0.5 * nz) + 0.5 * Math.max(nx * light[0] + ny * light[1] + nz * light[2], 0);
}

/** Return the brightness of walls by direction, in 256ths of a turn.
 * @param {Light} light */
function wallLights(light) {
  const out = new Float32Array(256);
  for (let n = 0; n < 256; n++) {
    const angle = (n / 256) * 2 * Math.PI;
    out[n] = shade(Math.cos(angle), Math.sin(angle), 0, light);
  }
  return out;
}

/** Return the brightness of a section's face, with hatching.
 * @param {number} place @param {number} cell */
function hatched(place, cell) {
  const line = place / (HATCH * cell);
  return line - Math.floor(line) < 0.16 ? 0.87 : 1;
}

/** @param {number} under @param {number} toShade */
function heightTone(under, toShade) {
  const tone = under * toShade;
  return tone < 0 ? 0 : tone > SCALE_END ? SCALE_END : tone | 0;
}

/** Return a colour, 0xRRGGBB, scaled by a brightness, as a pixel.
 * @param {number} colour @param {number} part */
function toned(colour, part) {
  let r = ((colour >> 16) & 255) * part, g = ((colour >> 8) & 255) * part, b = (colour & 255) * part;
  if (r > 255) r = 255;
  if (g > 255) g = 255;
  if (b > 255) b = 255;
  return 0xff000000 | (b << 16) | (g << 8) | r;
}

/** Return the pixel range of a tool: first column, first row, last column, last row, rows counted from below.
 * @param {SolidCamera} camera @param {Tool} tool @param {number} pixels @param {number} width @param {number} height */
function toolRoom(camera, tool, pixels, width, height) {
  const { sin } = camera.axes, reach = tool.largest * camera.scale;
  const [px, low] = camera.project(tool.x, tool.y, tool.z), [, high] = camera.project(tool.x, tool.y, tool.z + tool.long);
  const edge = (/** @type {number} */ v, /** @type {number} */ most) => Math.min(Math.max(Math.round(v * pixels), 0), most);
  const bottom = camera.height_px - low - reach * sin - 1, up = camera.height_px - high + reach * sin + 1;
  return [edge(px - reach - 1, width), edge(bottom, height), edge(px + reach + 1, width), edge(up, height)];
}

/** Return depth, brightness and colour of a tool at a pixel; null outside.
 * @param {SolidCamera} camera @param {Tool} tool @param {number} px @param {number} py @param {Light} light
 * @returns {[number, number, number] | null} */
function meetTool(camera, tool, px, py, light) {
  const { from, way } = camera.ray(px, py), ox = from[0] - tool.x, oy = from[1] - tool.y, oz = from[2] - tool.z;
  const a = way[0] * way[0] + way[1] * way[1], half = ox * way[0] + oy * way[1], apart = ox * ox + oy * oy;
  const flat = a < 1e-9;
  for (const [low, high, radius, colour, striped] of tool.parts) {
    // Upper end first, then the side: a cylinder, or the cutting surface.
    const atTop = (high - oz) / way[2], onTop = apart + 2 * half * atTop + a * atTop * atTop;
    if (Math.abs(way[2]) > 1e-9 && onTop <= radius * radius) return [atTop, shade(0, 0, 1, light) * 0.96, colour];
    if (flat) continue;
    const root = half * half - a * (apart - radius * radius);
    if (root < 0) continue;
    const at = (-half - Math.sqrt(root)) / a, z = oz + way[2] * at;
    if (z > high) continue;
    if (z >= low) return [at, ...sideOf(ox + way[0] * at, oy + way[1] * at, 0, radius, z, light, colour, striped)];
  }
  if (flat) return null;
  // Point: search along the ray until it is inside.
  const { shape, point } = tool, radius = shape[0], root = half * half - a * (apart - radius * radius);
  if (root < 0 || point <= 0) return null;
  const last = (-half + Math.sqrt(root)) / a, start = Math.max((-half - Math.sqrt(root)) / a, (point - oz) / way[2]);
  const over = (/** @type {number} */ at) => oz + way[2] * at - surface(shape, Math.min(Math.sqrt(Math.max(apart + 2 * half * at + a * at * at, 0)), radius));
  if (start >= last) return null;
  let before = start;
  for (let n = 0; n <= 16; n++) {
    let at = start + ((last - start) * n) / 16;
    if (over(at) < 0) { before = at; continue; }
    if (n === 0) return null;
    for (let turn = 0; turn < 8; turn++) {
      const middle = (before + at) / 2;
      if (over(middle) < 0) before = middle; else at = middle;
    }
    const x = ox + way[0] * at, y = oy + way[1] * at, r = Math.hypot(x, y);
    const slope = (surface(shape, Math.min(r + 1e-3, radius)) - surface(shape, Math.max(r - 1e-3, 0))) / 2e-3;
    return [at, ...sideOf(x, y, slope, r, oz + way[2] * at, light, tool.parts[tool.parts.length - 1][3], true)];
  }
  return null;
}

/** Return brightness and colour of a tool's side; the cutting part has flutes.
 * @param {number} x @param {number} y @param {number} slope @param {number} r @param {number} z @param {Light} light
 * @param {number} colour @param {boolean} striped @returns {[number, number]} */
function sideOf(x, y, slope, r, z, light, colour, striped) {
  const k = slope > 1e-6 ? slope / Math.hypot(1, slope) : 1, away = Math.max(Math.hypot(x, y), 1e-9), down = slope > 1e-6 ? -1 / Math.hypot(1, slope) : 0;
  let part = shade((x / away) * k, (y / away) * k, down, light);
  if (striped && r > 0) {
    const flute = Math.sin(2 * Math.atan2(y, x) - (1.4 * z) / Math.max(r, 1e-6));
    part *= flute > 0.55 ? 0.62 : flute > 0.4 ? 1.12 : 1;
  }
  return [part * 1.04, colour];
}
