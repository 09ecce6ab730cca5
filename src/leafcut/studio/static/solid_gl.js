// The stock drawn by a GPU: every pixel's ray traverses the cells until it meets a wall or a top, with the colours and
// the light of solid_columns.js.

import { lightOf, HATCH, STEP } from "./solid_columns.js";
import { sectioned } from "./solid_camera.js";
import { SCALE_END } from "./solid_colours.js";

/** Maximum number of sections of a drawn tool: cutting part, shank, holder. */
const PARTS = 6;

const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
uniform sampler2D heights;
uniform usampler2D relief, tint;
uniform sampler2D palette;
uniform vec2 right, ahead, edge, middle;
uniform float sinH, cosH, perMm, cell, floorZ, top, bottom, middleZ;
uniform vec4 box;      // x0, y0, x1, y1
uniform int cutSide;   // of a section: 1 x0, 2 x1, 3 y0, 4 y1
uniform bool byHeight;
uniform vec3 light, sectionColour;
uniform vec2 size;
uniform vec4 tool;     // place of the tip, and 1 where there is one
uniform float shape[6];
uniform float point;
uniform int partCount;
uniform vec4 parts[${PARTS}]; // low, high, radius, striped
uniform vec3 partColour[${PARTS}];
out vec4 colour;

float shade(vec3 n) { return 0.44 + 0.2 * (0.5 + 0.5 * n.z) + 0.5 * max(dot(n, light), 0.0); }
vec3 toned(float tone) { return texelFetch(palette, ivec2(int(tone), 0), 0).rgb; }
float heightTone(float z) { return clamp((top - z) * ${SCALE_END}.0 / max(top - bottom, 1e-6), 0.0, ${SCALE_END}.0); }
float surface(float r) {
  if (r <= shape[1]) return 0.0;
  if (r <= shape[3]) { float o = r - shape[1]; return shape[2] - sqrt(max(shape[2] * shape[2] - o * o, 0.0)); }
  return shape[4] + shape[5] * (r - shape[3]);
}
vec3 side(vec2 at, float slope, float r, float z, vec3 base, bool striped) {
  float k = slope > 1e-6 ? slope / length(vec2(1.0, slope)) : 1.0, down = slope > 1e-6 ? -1.0 / length(vec2(1.0, slope)) : 0.0;
  float part = shade(vec3(at / max(length(at), 1e-9) * k, down));
  if (striped && r > 0.0) {
    float flute = sin(2.0 * atan(at.y, at.x) - 1.4 * z / max(r, 1e-6));
    part *= flute > 0.55 ? 0.62 : flute > 0.4 ? 1.12 : 1.0;
  }
  return base * part * 1.04;
}
vec4 meetTool(vec3 from, vec3 way) {
  vec3 o = from - tool.xyz;
  float a = dot(way.xy, way.xy), half_ = dot(o.xy, way.xy), apart = dot(o.xy, o.xy);
  for (int n = 0; n < ${PARTS}; n++) {
    if (n >= partCount) break;
    float low = parts[n].x, high = parts[n].y, radius = parts[n].z, atTop = (high - o.z) / min(way.z, -1e-9);
    if (way.z < -1e-9 && apart + 2.0 * half_ * atTop + a * atTop * atTop <= radius * radius) return vec4(partColour[n] * shade(vec3(0, 0, 1)) * 0.96, atTop);
    float root = half_ * half_ - a * (apart - radius * radius);
    if (a < 1e-9 || root < 0.0) continue;
    float at = (-half_ - sqrt(root)) / a, z = o.z + way.z * at;
    if (z > high || z < low) continue;
    return vec4(side(o.xy + way.xy * at, 0.0, radius, z, partColour[n], parts[n].w > 0.5), at);
  }
  float root = half_ * half_ - a * (apart - shape[0] * shape[0]);
  if (a < 1e-9 || root < 0.0 || point <= 0.0) return vec4(0, 0, 0, 1e30);
  float last = (-half_ + sqrt(root)) / a, start = max((-half_ - sqrt(root)) / a, (point - o.z) / min(way.z, -1e-9)), before = start;
  if (start >= last) return vec4(0, 0, 0, 1e30);
  for (int n = 0; n <= 16; n++) {
    float at = start + (last - start) * float(n) / 16.0;
    if (o.z + way.z * at < surface(min(length(o.xy + way.xy * at), shape[0]))) { before = at; continue; }
    if (n == 0) break;
    for (int turn = 0; turn < 8; turn++) {
      float mid = 0.5 * (before + at);
      if (o.z + way.z * mid < surface(min(length(o.xy + way.xy * mid), shape[0]))) before = mid; else at = mid;
    }
    vec2 p = o.xy + way.xy * at;
    float r = length(p), slope = (surface(min(r + 1e-3, shape[0])) - surface(max(r - 1e-3, 0.0))) / 2e-3;
    return vec4(side(p, slope, r, o.z + way.z * at, partColour[partCount - 1], true), at);
  }
  return vec4(0, 0, 0, 1e30);
}
void main() {
  float u = (gl_FragCoord.x - 0.5 * size.x) / perMm, v = (gl_FragCoord.y - 0.5 * size.y) / perMm;
  vec3 from = vec3(middle + right * u + ahead * v * sinH, middleZ + v * cosH), way = vec3(ahead * cosH, -sinH);
  vec4 found = vec4(0, 0, 0, 1e30);
  // From where to where the ray is in the box.
  float enters = -1e30, leaves = 1e30;
  int through = 0;
  bool inside = true;
  for (int k = 0; k < 3; k++) {
    float low = k == 0 ? box.x : k == 1 ? box.y : floorZ, high = k == 0 ? box.z : k == 1 ? box.w : top + 1e-4;
    if (abs(way[k]) < 1e-6) { if (from[k] < low || from[k] > high) inside = false; continue; }
    float a = (low - from[k]) / way[k], b = (high - from[k]) / way[k];
    if (min(a, b) > enters) { enters = min(a, b); through = k == 2 ? 0 : 1 + 2 * k + (a < b ? 0 : 1); }
    leaves = min(leaves, max(a, b));
  }
  if (inside && enters < leaves) {
    ivec2 cells = textureSize(heights, 0);
    vec2 start = (from.xy + way.xy * enters - edge) / cell;
    ivec2 at = ivec2(floor(start + vec2(through == 1 ? 1e-3 : through == 2 ? -1e-3 : 0.0, through == 3 ? 1e-3 : through == 4 ? -1e-3 : 0.0)));
    at = clamp(at, ivec2(0), cells - 1);
    ivec2 step_ = ivec2(way.x > 0.0 ? 1 : -1, way.y > 0.0 ? 1 : -1);
    vec2 per = vec2(abs(way.x) > 1e-6 ? cell / abs(way.x) : 1e30, abs(way.y) > 1e-6 ? cell / abs(way.y) : 1e30);
    vec2 next = vec2(
      per.x < 1e29 ? (edge.x + float(at.x + (step_.x > 0 ? 1 : 0)) * cell - from.x) / way.x : 1e30,
      per.y < 1e29 ? (edge.y + float(at.y + (step_.y > 0 ? 1 : 0)) * cell - from.y) / way.y : 1e30);
    float t = enters;
    int face = through;
    bool first = true;
    ivec2 near = at;
    for (int n = 0; n < 1100; n++) {
      float h = texelFetch(heights, at, 0).r, end = min(min(next.x, next.y), leaves), zIn = from.z + way.z * t, zOut = from.z + way.z * end;
      if (h > floorZ + 1e-6) {
        uint code = texelFetch(relief, at, 0).r;
        if (zIn <= h && !(first && through == 0)) {
          bool outer = first;
          uint nearCode = texelFetch(relief, near, 0).r;
          float angle = outer ? (face == 1 ? 0.5 : face == 2 ? 0.0 : face == 3 ? 0.75 : 0.25) : float((code >> 16) & 255u) / 256.0;
          bool sloped = !outer && h - texelFetch(heights, near, 0).r < ${STEP} * cell;
          float nx = float(int(code << 24) >> 24) / 127.0, ny = float(int(code << 16) >> 24) / 127.0;
          float bright = sloped ? shade(vec3(nx, ny, sqrt(max(1.0 - nx * nx - ny * ny, 0.0)))) * float(code >> 24) / 200.0 : shade(vec3(cos(angle * 6.2831853), sin(angle * 6.2831853), 0.0));
          uint upper = texelFetch(tint, at, 0).r, own = sloped || outer || upper > ${SCALE_END}u ? upper : texelFetch(tint, near, 0).r;
          float tone = own > ${SCALE_END}u ? float(own) : byHeight ? heightTone(zIn) : outer ? 0.0 : float(own);
          float part = bright * (outer ? 0.9 + 0.1 * (zIn - floorZ) / (top - floorZ) : sloped ? 1.0 : 0.55 + 0.45 * min(float(nearCode >> 24) / 200.0, 1.0));
          vec3 base = toned(tone);
          if (first && cutSide > 0 && through == cutSide) { base = sectionColour; part = fract((zIn + u) / (${HATCH}.0 * cell)) < 0.16 ? 0.87 : 1.0; }
          found = vec4(base * part, t);
          break;
        }
        if (zOut <= h) {
          float nx = float(int(code << 24) >> 24) / 127.0, ny = float(int(code << 16) >> 24) / 127.0;
          float part = shade(vec3(nx, ny, sqrt(max(1.0 - nx * nx - ny * ny, 0.0)))) * float(code >> 24) / 200.0;
          uint own = texelFetch(tint, at, 0).r;
          found = vec4(toned(byHeight && own <= ${SCALE_END}u ? heightTone(h) : float(own)) * part, (h - from.z) / way.z);
          break;
        }
      }
      if (end >= leaves) break;
      near = at;
      first = false;
      t = end;
      if (next.x < next.y) { at.x += step_.x; next.x += per.x; face = step_.x > 0 ? 1 : 2; }
      else { at.y += step_.y; next.y += per.y; face = step_.y > 0 ? 3 : 4; }
      if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, cells))) break;
    }
  }
  if (tool.w > 0.5) {
    vec4 met = meetTool(from, way);
    if (met.w < found.w) found = met;
  }
  colour = found.w < 1e29 ? vec4(min(found.rgb, vec3(1.0)), 1.0) : vec4(0.0);
}`;

/** Whether this browser has a real GPU, without a performance caveat. */
export function canDrawByGpu() {
  try {
    const gl = document.createElement("canvas").getContext("webgl2", { failIfMajorPerformanceCaveat: true });
    if (!gl) return false;
    const about = gl.getExtension("WEBGL_debug_renderer_info"), name = about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : "";
    gl.getExtension("WEBGL_lose_context")?.loseContext();
    return !/swiftshader|llvmpipe|software|basic render/i.test(name);
  } catch {
    return false;
  }
}

export class GpuRenderer {
  /** Throws an Error without WebGL 2. */
  constructor(canvas) {
    this.canvas = canvas;
    this.name = "gpu";
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: true, premultipliedAlpha: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.gl = gl;
    this.lost = false;
    canvas.addEventListener("webglcontextlost", () => { this.lost = true; });
    this.program = linked(gl);
    this.at = {};
    this.textures = {};
    gl.useProgram(this.program);
    gl.bindVertexArray(gl.createVertexArray());
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    for (const [unit, name] of ["heights", "relief", "tint", "palette"].entries()) {
      this.textures[name] = gl.createTexture();
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, this.textures[name]);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
      for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
      gl.uniform1i(this._at(name), unit);
    }
  }

  _at(name) { return (this.at[name] ??= this.gl.getUniformLocation(this.program, name)); }

  /** Upload the changes of a stock; `rect` null: everything. */
  update(stock) {
    const { gl } = this, { columns, rows } = stock.grid;
    const kinds = { heights: [gl.R32F, gl.RED, gl.FLOAT], relief: [gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT], tint: [gl.R8UI, gl.RED_INTEGER, gl.UNSIGNED_BYTE] };
    for (const [unit, [name, [inner, format, type]]] of Object.entries(kinds).entries()) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.texImage2D(gl.TEXTURE_2D, 0, inner, columns, rows, 0, format, type, stock[name]);
    }
  }

  draw(stock, camera, look, pixels) {
    const { gl, canvas } = this, { grid } = stock, { right, ahead, sin, cos } = camera.axes;
    const width = Math.max(Math.round(camera.width * pixels), 1), height = Math.max(Math.round(camera.height_px * pixels), 1);
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    const box = sectioned(grid, look.section, camera), set = (name, ...v) => gl[`uniform${v.length}f`](this._at(name), ...v);
    gl.viewport(0, 0, width, height);
    gl.activeTexture(gl.TEXTURE3);
    const bytes = new Uint8Array(1024);
    look.palette.forEach((c, k) => bytes.set([c >> 16, (c >> 8) & 255, c & 255, 255], 4 * k));
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    set("right", ...right);
    set("ahead", ...ahead);
    set("edge", grid.x - grid.cell / 2, grid.y - grid.cell / 2);
    set("middle", camera.x, camera.y);
    for (const [name, value] of Object.entries({ sinH: sin, cosH: cos, perMm: camera.scale * pixels, cell: grid.cell, floorZ: stock.floor, top: stock.top, bottom: look.bottom, middleZ: camera.z })) set(name, value);
    set("box", box.x0, box.y0, box.x1, box.y1);
    gl.uniform1i(this._at("cutSide"), ["", "x0", "x1", "y0", "y1"].indexOf(box.cut));
    gl.uniform1i(this._at("byHeight"), look.byHeight ? 1 : 0);
    set("light", ...lightOf(camera));
    set("sectionColour", ...rgb(look.sectionColour));
    set("size", width, height);
    const { tool } = look;
    set("tool", tool?.x ?? 0, tool?.y ?? 0, tool?.z ?? 0, tool ? 1 : 0);
    if (tool) {
      gl.uniform1fv(this._at("shape"), tool.shape);
      set("point", tool.point);
      gl.uniform1i(this._at("partCount"), Math.min(tool.parts.length, PARTS));
      gl.uniform4fv(this._at("parts"), tool.parts.flatMap(([low, high, radius, , striped]) => [low, high, radius, striped ? 1 : 0]));
      gl.uniform3fv(this._at("partColour"), tool.parts.flatMap((part) => rgb(part[3])));
    }
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}

function rgb(colour) { return [(colour >> 16) & 255, (colour >> 8) & 255, colour & 255].map((v) => v / 255); }

function linked(gl) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || "no program for the GPU");
  return program;
}
