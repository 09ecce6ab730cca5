// Placement of the part: program zero, which can be dragged if an option sets it, and the travel of the machine.

import { FONT, circle, haloed } from "./marks.js";

/** @import { Box, Point } from "./boxes.js" */
/** @import { Drawing } from "./canvas.js" */
/** @import { Colours } from "./theme.js" */
/** @import { View } from "./view.js" */
/** Travel of a machine: its box, mm, whether its position is known, and whether the program fits.
 * @typedef {{ box: Box, known: boolean, fits: boolean, machine: string }} Travel */
/** @typedef {{ movable?: boolean, travel?: Travel | null }} PlacementSettings */

const ARM = 34, GRIP = 9, LEFT = 56, RULER = 24; // pixels

export class Placement {
  /** @param {Drawing} drawing */
  constructor(drawing) {
    this.drawing = drawing;
    this.movable = false;
    /** @type {Travel | null} */
    this.travel = null;
    /** Target of dragged zero, mm. @type {Point | null} */
    this.drag = null;
  }

  /** @param {PlacementSettings} settings */
  set({ movable = false, travel = null }) {
    this.movable = movable;
    this.travel = travel;
    this.drag = null;
  }

  /** Return whether the pointer is over a movable program zero.
   * @param {number} px @param {number} py */
  over(px, py) {
    const { view, layers } = this.drawing;
    return this.movable && layers.origin && Math.hypot(px - view.toX(0), py - view.toY(0)) <= GRIP;
  }

  /** Move program zero to a pointer position; return its position, mm.
   * @param {number} px @param {number} py */
  dragTo(px, py) {
    const { view, measure } = this.drawing;
    return (this.drag = measure.snapped(view.mmX(px), view.mmY(py)));
  }

  /** End dragging; return the new position of zero, mm, or null if unchanged.
   * @param {boolean} cancelled */
  drop(cancelled) {
    const to = this.drag;
    this.drag = null;
    return cancelled || !to || Math.hypot(...to) === 0 ? null : to;
  }

  /** Draw zero and travel; `ctx` is in pixels.
   * @param {Context} ctx @param {View} view @param {Colours} colours */
  draw(ctx, view, colours) {
    const { layers } = this.drawing;
    if (layers.travel && this.travel) this._travel(ctx, view, colours, this.travel);
    if (layers.origin && !this.drawing.unitless && this.drawing.shows) {
      zeroMark(ctx, view.toX(0), view.toY(0), colours, this.movable, this.drag ? 0.45 : 1);
      if (this.drag) zeroMark(ctx, view.toX(this.drag[0]), view.toY(this.drag[1]), colours, true, 1);
    }
  }

  /** @param {Context} ctx @param {View} view @param {Colours} colours @param {Travel} travel */
  _travel(ctx, view, colours, { box, known, fits, machine }) {
    const { words } = this.drawing;
    const x = view.toX(box[0]), y = view.toY(box[3]), width = (box[2] - box[0]) * view.scale, height = (box[3] - box[1]) * view.scale;
    const colour = fits ? colours["ink-2"] : colours.bad;
    ctx.strokeStyle = colour;
    ctx.lineWidth = fits ? 1.2 : 2;
    ctx.setLineDash([9, 5]);
    ctx.strokeRect(x, y, width, height);
    ctx.setLineDash([]);
    const size = `${Math.round(box[2] - box[0])} × ${Math.round(box[3] - box[1])} mm`;
    const parts = [`${words.travel} ${machine}, ${size}`, fits ? (known ? "" : words.travelAround) : words.travelOut];
    ctx.font = FONT;
    ctx.textAlign = "left";
    ctx.textBaseline = "bottom";
    // Text along the upper edge if visible, else along the lower edge, never behind the ruler.
    const low = y + height < view.height - RULER ? y + height + 17 : -1, at = y > 20 ? y - 5 : low;
    if (width > 60 && at > 0 && x + width > LEFT) haloed(ctx, parts.filter(Boolean).join(" · "), Math.max(x + 2, LEFT), at, colour, colours.card);
  }
}

/** Draw program zero: arrows in X and Y, and a ring as a handle.
 * @param {Context} ctx @param {number} px @param {number} py @param {Colours} colours @param {boolean} movable
 * @param {number} alpha */
function zeroMark(ctx, px, py, colours, movable, alpha) {
  ctx.globalAlpha = alpha;
  for (const [dx, dy, colour, letter] of /** @type {[number, number, string, string][]} */ ([[1, 0, colours.change, "X"], [0, -1, colours.accent, "Y"]])) {
    ctx.strokeStyle = ctx.fillStyle = colour;
    ctx.lineWidth = 2;
    ctx.beginPath();
    ctx.moveTo(px, py);
    ctx.lineTo(px + ARM * dx, py + ARM * dy);
    ctx.stroke();
    ctx.beginPath();
    ctx.moveTo(px + (ARM + 6) * dx, py + (ARM + 6) * dy);
    ctx.lineTo(px + ARM * dx - 4 * dy, py + ARM * dy + 4 * dx);
    ctx.lineTo(px + ARM * dx + 4 * dy, py + ARM * dy - 4 * dx);
    ctx.closePath();
    ctx.fill();
    ctx.font = FONT;
    ctx.textAlign = "center";
    ctx.textBaseline = "middle";
    haloed(ctx, letter, px + (ARM + 14) * dx, py + (ARM + 14) * dy, colour, colours.card);
  }
  ctx.lineWidth = 2;
  ctx.strokeStyle = colours.ink;
  ctx.fillStyle = colours.card;
  const ring = circle(px, py, movable ? 6 : 3.5);
  ctx.fill(ring);
  ctx.stroke(ring);
  ctx.fillStyle = colours.ink;
  if (movable) ctx.fill(circle(px, py, 2));
  ctx.globalAlpha = 1;
}
