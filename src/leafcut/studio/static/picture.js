// Saves the chart beside a button as a PNG file, with the colours of the page.

const SHOWN = [
  "fill", "fill-opacity", "stroke", "stroke-width", "stroke-opacity", "stroke-dasharray", "stroke-linecap", "stroke-linejoin", "opacity",
  "font-family", "font-size", "font-weight",
];
const WIDTH = 2000, EDGE = 24; // minimum width and margin, pixels

document.addEventListener("click", async ({ target }) => {
  const button = target instanceof Element ? /** @type {HTMLElement | null} */ (target.closest("[data-picture]")) : null;
  const svg = button?.closest("section")?.querySelector("svg");
  if (!button || !svg) return;
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await rendered(svg));
  link.download = button.dataset.picture ?? "";
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
});

/** Return an SVG element as PNG, independent of style sheets.
 * @param {SVGSVGElement} svg @returns {Promise<Blob>} */
async function rendered(svg) {
  const { width, height } = svg.getBoundingClientRect(), copy = /** @type {SVGSVGElement} */ (svg.cloneNode(true)), high = height * (WIDTH / width);
  const from = [svg, ...svg.querySelectorAll("*")], to = /** @type {SVGElement[]} */ ([copy, ...copy.querySelectorAll("*")]);
  for (const [k, element] of from.entries()) {
    const style = getComputedStyle(element);
    for (const name of SHOWN) to[k].style.setProperty(name, style.getPropertyValue(name));
  }
  const attributes = { xmlns: "http://www.w3.org/2000/svg", width: WIDTH, height: high, viewBox: `0 0 ${width} ${height}` };
  for (const [name, value] of Object.entries(attributes)) copy.setAttribute(name, String(value));
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
  await image.decode();
  const canvas = Object.assign(document.createElement("canvas"), { width: WIDTH + 2 * EDGE, height: high + 2 * EDGE });
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.fillStyle = getComputedStyle(document.querySelector(".studio") ?? document.body).getPropertyValue("--card").trim() || "#ffffff";
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.drawImage(image, EDGE, EDGE, WIDTH, high);
  return new Promise((done, failed) => { canvas.toBlob((blob) => (blob ? done(blob) : failed(new Error("the picture is too large"))), "image/png"); });
}
