// Picture of the stock by three.js, which NiceGUI contains: a grid of heights, the tool, its path, and a section.

import { sectioned } from "./solid_camera.js";
import { SCALE_END } from "./solid_colours.js";
import { surface } from "./sweep.js";

/** @import * as Three from "three" */
/** @import { Box } from "./boxes.js" */
/** @import { Section, SolidCamera } from "./solid_camera.js" */
/** @import { Shape, StockGrid } from "./sweep.js" */
/** Stock: heights of the cells, their tone, and numbers of the moves that cut them last.
 * @typedef {{
 *   grid: StockGrid, floor: number, top: number, heights: Float32Array, by: Uint32Array, tint: Uint8Array,
 * }} Stock */
/** Cylinder of a tool: lower and upper end above the tip, radius, colour.
 * @typedef {[number, number, number, number]} ToolPart */
/** Tool with its cylinders from the top down; `point`: height of its point.
 * @typedef {{ x: number, y: number, z: number, shape: Shape, point: number, parts: ToolPart[] }} Tool */
/** Colours of the tones, 0xRRGGBB; `byHeight`: uncut and cut cells are coloured from the top down to `bottom`, mm.
 * @typedef {{ colours: number[], byHeight: boolean, bottom: number }} Paint */
/** `ratio`: pixels of the screen per CSS pixel; `path`: number of visible moves; `moves`: whether the picture changes.
 * @typedef {{
 *   ratio: number, section: Section, sectionColour: number, tool: Tool | null, path: number, moves: boolean,
 * }} Look */

/** Distance of the hatching lines of a section, cells. */
const HATCH = 14;
/** Direction of the light: to the right, ahead and up, as seen by the viewer. */
const LIGHT = [-0.52, -0.42, 0.74];
/** Names of WebGL drivers that draw with the processor, and the step in cells of their grid during motion. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i, COARSE = 4;
/** Far more than the size of a stock and its tool, mm. */
const FAR = 1e4;

export class SolidView {
  /** Throw an error if the browser has no WebGL.
   * @param {typeof Three} three @param {HTMLCanvasElement} canvas */
  constructor(three, canvas) {
    this.three = three;
    this.renderer = new three.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.outputColorSpace = three.LinearSRGBColorSpace; // the colours of the page, unchanged
    this.renderer.localClippingEnabled = true;
    this.camera = new three.OrthographicCamera();
    this.camera.matrixAutoUpdate = false;
    this.sun = new three.DirectionalLight(0xffffff, 0.5 * Math.PI);
    const sky = new three.HemisphereLight(0xffffff, 0xb0b0b0, 0.64 * Math.PI);
    sky.position.set(0, 0, 1);
    this.floor = new three.Plane(new three.Vector3(0, 0, 1));
    this.cut = new three.Plane();
    this.body = new three.Mesh(new three.BufferGeometry(), new three.MeshLambertMaterial({ vertexColors: true, flatShading: true }));
    const hatching = new three.DataTexture(new Uint8Array([...Array(6)].flatMap((_, k) => Array(3).fill(k ? 255 : 222).concat(255))), 6, 1);
    hatching.wrapS = three.RepeatWrapping;
    hatching.needsUpdate = true;
    this.face = new three.Mesh(new three.BufferGeometry(), new three.MeshBasicMaterial({ map: hatching, side: three.DoubleSide }));
    this.tool = new three.Group();
    const line = new three.LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.7, depthTest: false });
    this.path = new three.LineSegments(new three.BufferGeometry(), line);
    this.scene = new three.Scene().add(sky, this.sun, this.body, this.face, this.tool, this.path);
    for (const object of [this.body, this.face, this.path]) object.frustumCulled = false;
    /** @type {Stock | null} */
    this.stock = null;
    /** All cells: first column and row, end column and row. */
    this._all = /** @type {Box} */ ([0, 0, 0, 0]);
    const gl = this.renderer.getContext(), driver = gl.getExtension("WEBGL_debug_renderer_info");
    this.software = SOFTWARE.test(String(gl.getParameter(driver ? driver.UNMASKED_RENDERER_WEBGL : gl.RENDERER)));
    /** Triangles of the body at rest and during motion. @type {Three.BufferAttribute | null} */
    this.fine = null;
    /** @type {Three.BufferAttribute | null} */
    this.coarse = null;
    /** Tool that is built. @type {string} */
    this._built = "";
  }

  /** Show a stock and the moves that cut it; its cells are drawn by `paint`.
   * @param {Stock} stock @param {Float32Array} moves */
  begin(stock, moves) {
    const { grid: { x, y, cell, rows, columns }, floor } = stock, wide = columns + 2;
    this.stock = stock;
    this._all = /** @type {Box} */ ([0, 0, columns, rows]);
    this.floor.constant = -floor;
    // A ring around the cells lies below the floor, where the sides of the block are cut off.
    const position = new Float32Array(3 * wide * (rows + 2));
    const between = (/** @type {number} */ k, /** @type {number} */ count) => Math.min(Math.max(k - 1, -0.5), count - 0.5);
    for (let at = 0; at < wide * (rows + 2); at++) {
      position.set([x + between(at % wide, columns) * cell, y + between(Math.floor(at / wide), rows) * cell, floor - 1], 3 * at);
    }
    this._fill(this.body, { position: [position, 3], color: [new Uint8Array(4 * wide * (rows + 2)).fill(255), 4] });
    [this.fine, this.coarse] = [1, this.software ? COARSE : 1].map((step) => new this.three.BufferAttribute(triangles(wide, rows + 2, step), 1));
    this._fill(this.path, { position: [moves, 3], color: [new Uint8Array(4 * (moves.length / 3)).fill(255), 4] });
    this.body.material.clippingPlanes = [this.floor];
  }

  /** @param {Three.Mesh | Three.LineSegments} object @param {Record<string, [Float32Array | Uint8Array, number]>} attributes
   * @param {Uint32Array | null} index */
  _fill(object, attributes, index = null) {
    const { three } = this;
    object.geometry.dispose();
    object.geometry = new three.BufferGeometry();
    for (const [name, [values, size]] of Object.entries(attributes)) {
      object.geometry.setAttribute(name, new three.BufferAttribute(values, size, values instanceof Uint8Array));
    }
    if (index) object.geometry.setIndex(new three.BufferAttribute(index, 1));
  }

  /** Take over heights and colours of the cells of a rectangle.
   * @param {Paint} paint */
  paint({ colours, byHeight, bottom }, rect = this._all) {
    const { stock, body: { geometry } } = this;
    if (!stock) return;
    const { grid: { columns }, heights, tint, floor, top } = stock, [c0, r0, c1, r1] = rect, wide = columns + 2;
    const { position, color } = /** @type {Record<string, Three.BufferAttribute>} */ (geometry.attributes);
    if (rect === this._all) for (let k = 0; k < color.count; k++) setColour(color.array, k, colours[0]); // also the ring
    const toTone = SCALE_END / Math.max(top - bottom, 1e-6);
    for (let row = r0; row < r1; row++) {
      for (let column = c0; column < c1; column++) {
        const at = row * columns + column, to = (row + 1) * wide + column + 1, height = heights[at], own = tint[at];
        const tone = byHeight && own <= SCALE_END ? Math.min(Math.max((top - height) * toTone, 0), SCALE_END) | 0 : own;
        position.array[3 * to + 2] = height > floor + 1e-6 ? height : floor - 1;
        setColour(color.array, to, colours[tone]);
      }
    }
    for (const [attribute, size] of /** @type {[Three.BufferAttribute, number][]} */ ([[position, 3], [color, 4]])) {
      attribute.addUpdateRange(size * r0 * wide, size * (r1 - r0 + 2) * wide); // with a row of the ring, or of cells, on both sides
      attribute.needsUpdate = true;
    }
  }

  /** Colour the path, rapids and feed moves.
   * @param {Uint8Array} rapids @param {number} rapid @param {number} feed */
  paintPath(rapids, rapid, feed) {
    const color = /** @type {Three.BufferAttribute} */ (this.path.geometry.attributes.color);
    for (let k = 0; k < 2 * rapids.length; k++) setColour(color.array, k, rapids[k >> 1] ? rapid : feed);
    color.needsUpdate = true;
  }

  /** @param {SolidCamera} camera @param {Look} look */
  draw(camera, { ratio, section, sectionColour, tool, path, moves }) {
    const { renderer } = this;
    this.body.geometry.setIndex(moves ? this.coarse : this.fine);
    renderer.setPixelRatio(ratio);
    renderer.setSize(camera.width, camera.height_px, false);
    this._see(camera);
    this._section(camera, section, sectionColour);
    this._place(tool);
    this.path.geometry.setDrawRange(0, 2 * path);
    renderer.render(this.scene, this.camera);
  }

  /** @param {SolidCamera} from */
  _see({ axes: { right, ahead, sin, cos }, x, y, z, width, height_px: height, scale }) {
    const { camera, three: { Vector3 } } = this, back = new Vector3(-ahead[0] * cos, -ahead[1] * cos, sin);
    camera.right = width / 2 / scale;
    camera.top = height / 2 / scale;
    [camera.left, camera.bottom, camera.near, camera.far] = [-camera.right, -camera.top, -FAR, FAR];
    camera.updateProjectionMatrix();
    camera.matrix.makeBasis(new Vector3(...right, 0), new Vector3(ahead[0] * sin, ahead[1] * sin, cos), back).setPosition(x, y, z);
    camera.matrixWorldNeedsUpdate = true;
    const [across, away, up] = LIGHT;
    this.sun.position.set(across * right[0] + away * ahead[0], across * right[1] + away * ahead[1], up);
  }

  /** Cut the body open, and fill the face of the section.
   * @param {SolidCamera} camera @param {Section} section @param {number} colour */
  _section(camera, section, colour) {
    const { stock, body: { material }, cut, face } = this;
    face.visible = Boolean(stock && section.axis);
    material.clippingPlanes = face.visible ? [this.floor, cut] : [this.floor];
    if (!stock || !section.axis) return;
    const { grid, heights, floor } = stock, box = sectioned(grid, section, camera), side = /** @type {"x0" | "x1" | "y0" | "y1"} */ (box.cut);
    const alongX = section.axis === "x", at = box[side], sign = side.endsWith("0") ? 1 : -1;
    cut.setComponents(alongX ? sign : 0, alongX ? 0 : sign, 0, -sign * at);
    const count = alongX ? grid.rows : grid.columns, start = alongX ? grid.y : grid.x, most = alongX ? grid.columns : grid.rows;
    const across = Math.min(Math.max(Math.round((at - (alongX ? grid.x : grid.y)) / grid.cell), 0), most - 1);
    const position = new Float32Array(6 * (count + 2)), uv = new Float32Array(4 * (count + 2)), index = [];
    for (let k = 0; k < count + 2; k++) {
      const cell = Math.min(Math.max(k - 1, 0), count - 1), place = start + Math.min(Math.max(k - 1, -0.5), count - 0.5) * grid.cell;
      const height = Math.max(heights[alongX ? cell * grid.columns + across : across * grid.columns + cell], floor);
      for (const [to, z] of [[2 * k, floor], [2 * k + 1, height]]) {
        position.set(alongX ? [at, place, z] : [place, at, z], 3 * to);
        uv[2 * to] = (place + z) / (HATCH * grid.cell);
      }
      if (k) index.push(2 * k - 2, 2 * k, 2 * k - 1, 2 * k - 1, 2 * k, 2 * k + 1);
    }
    this._fill(face, { position: [position, 3], uv: [uv, 2] }, Uint32Array.from(index));
    face.material.color.setHex(colour, this.three.LinearSRGBColorSpace);
  }

  /** @param {Tool | null} tool */
  _place(tool) {
    const { three, tool: group } = this;
    group.visible = Boolean(tool);
    if (!tool) return;
    group.position.set(tool.x, tool.y, tool.z);
    const { shape, point, parts } = tool, built = JSON.stringify([[...shape], parts]);
    if (built === this._built) return;
    this._built = built;
    for (const mesh of /** @type {Three.Mesh[]} */ (group.children)) mesh.geometry.dispose();
    group.clear();
    const add = (/** @type {Three.BufferGeometry} */ geometry, /** @type {number} */ colour) => {
      const color = new three.Color().setHex(colour, three.LinearSRGBColorSpace);
      group.add(new three.Mesh(geometry.rotateX(Math.PI / 2), new three.MeshLambertMaterial({ color })));
    };
    for (const [low, high, radius, colour] of parts) {
      if (high > low) add(new three.CylinderGeometry(radius, radius, high - low, 48).translate(0, (low + high) / 2, 0), colour);
    }
    const radii = [...Array(25)].map((_, k) => (shape[0] * k) / 24);
    if (point > 0) add(new three.LatheGeometry(radii.map((r) => new three.Vector2(r, surface(shape, r))), 48), parts[parts.length - 1][3]);
  }

  /** Release the context of the canvas. */
  destroy() {
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }
}

/** @param {ArrayLike<number> & Record<number, number>} to @param {number} at @param {number} colour */
function setColour(to, at, colour) {
  to[4 * at] = colour >> 16;
  to[4 * at + 1] = (colour >> 8) & 255;
  to[4 * at + 2] = colour & 255;
}

/** Return the corners of the triangles of a grid of vertices; `step` leaves out vertices, except at the edges.
 * @param {number} columns @param {number} rows @param {number} step */
function triangles(columns, rows, step) {
  const every = (/** @type {number} */ count) => [...Array(count).keys()].filter((k) => k === 0 || k >= count - 2 || k % step === 1 % step);
  const across = every(columns), up = every(rows), out = new Uint32Array(6 * (across.length - 1) * (up.length - 1));
  let to = 0;
  for (let row = 0; row + 1 < up.length; row++) {
    for (let column = 0; column + 1 < across.length; column++, to += 6) {
      const [low, high] = [up[row] * columns, up[row + 1] * columns], [left, right] = [across[column], across[column + 1]];
      out.set([low + left, low + right, high + left, low + right, high + right, high + left], to);
    }
  }
  return out;
}
