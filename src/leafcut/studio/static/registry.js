// The drawings of a page by the number of their element, so that other elements find theirs.

const drawings = new Map();
const waiting = new Map();

/** Make a drawing known; null when it is gone. */
export function register(id, drawing) {
  if (!drawing) {
    drawings.delete(id);
    return;
  }
  drawings.set(id, drawing);
  (waiting.get(id) ?? []).forEach((act) => act(drawing));
  waiting.delete(id);
}

/** Call `act` with a drawing, now or as soon as it is there. */
export function whenThere(id, act) {
  if (drawings.has(id)) act(drawings.get(id));
  else waiting.set(id, [...(waiting.get(id) ?? []), act]);
}

/** Load the style sheet of the drawing once, or another one. */
export function withStyle(name = "drawing.css") {
  const href = import.meta.resolve(`leafcut-canvas/${name}`);
  if (document.querySelector(`link[href="${href}"]`)) return;
  const link = document.createElement("link");
  link.rel = "stylesheet";
  link.href = href;
  document.head.append(link);
}
