// Painting of the differences of two programs: missing and added moves, and a mark at every difference with a position.

const SIGNS = ["missing", "added", "changed"];
const SIZE = 8; // radius of a mark, pixels

export function paintDifferences(ctx, frame, scene, colours) {
  const ink = { missing: colours.bad, added: colours.accent, changed: colours.warn };
  for (const name of ["missing", "added"]) paintMoves(ctx, frame, scene, name, ink[name], colours.card);
  frame.inPixels(ctx);
  for (let k = 0; k < scene.marks; k++) {
    const { x, y, change } = scene.at(k);
    drawMark(ctx, frame.toX(x), frame.toY(y), SIGNS[change], ink[SIGNS[change]], colours.card);
  }
}

/** Draw the moves of only one program; missing moves are dashed. */
function paintMoves(ctx, frame, scene, name, colour, ground) {
  const points = scene[name], path = new Path2D();
  for (let k = 0, down = false; k < points.length; k += 2) {
    if (!Number.isFinite(points[k])) down = false;
    else if (down) path.lineTo(points[k], points[k + 1]);
    else {
      path.moveTo(points[k], points[k + 1]);
      down = true;
    }
  }
  frame.inMm(ctx, scene.origin);
  ctx.lineCap = "butt";
  for (const [stroke, width] of [[ground, 6], [colour, 3.4]]) {
    ctx.strokeStyle = stroke;
    ctx.lineWidth = width / frame.scale;
    ctx.setLineDash(name === "missing" && stroke === colour ? [7 / frame.scale, 4 / frame.scale] : []);
    ctx.stroke(path);
  }
  ctx.setLineDash([]);
}

/** Draw a disc with a minus, a plus, or the sign for a change. */
function drawMark(ctx, px, py, sign, colour, ground) {
  if (!Number.isFinite(px + py)) return;
  ctx.beginPath();
  ctx.arc(px, py, SIZE, 0, 2 * Math.PI);
  ctx.fillStyle = colour;
  ctx.strokeStyle = ground;
  ctx.lineWidth = 2;
  ctx.fill();
  ctx.stroke();
  ctx.beginPath();
  if (sign === "changed") {
    for (const dy of [-2, 2]) {
      ctx.moveTo(px - 4, py + dy);
      ctx.lineTo(px + 4, py + dy);
    }
  } else {
    ctx.moveTo(px - 4, py);
    ctx.lineTo(px + 4, py);
    if (sign === "added") {
      ctx.moveTo(px, py - 4);
      ctx.lineTo(px, py + 4);
    }
  }
  ctx.stroke();
}

/** Draw a ring around the mark that is selected or under the pointer. */
export function ringMark(ctx, frame, { x, y }, colour) {
  frame.inPixels(ctx);
  ctx.strokeStyle = colour;
  ctx.lineWidth = 2.5;
  ctx.beginPath();
  ctx.arc(frame.toX(x), frame.toY(y), SIZE + 4, 0, 2 * Math.PI);
  ctx.stroke();
}
