// Drawings of a page by the id of their element, for other elements.

const drawings = new Map();
const waiting = new Map();

/** Register a drawing; null unregisters it. */
export function register(id, drawing) {
  if (!drawing) {
    drawings.delete(id);
    return;
  }
  drawings.set(id, drawing);
  (waiting.get(id) ?? []).forEach((act) => act(drawing));
  waiting.delete(id);
}

/** Call `act` with a drawing, now or when it is registered. */
export function whenThere(id, act) {
  if (drawings.has(id)) act(drawings.get(id));
  else waiting.set(id, [...(waiting.get(id) ?? []), act]);
}

/** Load a style sheet once, by default that of the drawing. */
export function withStyle(name = "drawing.css") {
  const href = import.meta.resolve(`leafcut-canvas/${name}`);
  if (document.querySelector(`link[href="${href}"]`)) return;
  const link = document.createElement("link");
  link.rel = "stylesheet";
  link.href = href;
  document.head.append(link);
}
