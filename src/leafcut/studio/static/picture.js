// A chart as a PNG file: drawn again, large, with the colours of the page.

const SHOWN = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-opacity", "stroke-dasharray", "stroke-linecap", "stroke-linejoin", "opacity", "font-family", "font-size", "font-weight", "paint-order"];
const WIDTH = 1000, HEIGHT = 560, TIMES = 2, EDGE = 24;

/** Save a chart: `kind` is its class, `data` its data, `options` its constructor options. */
export async function savePicture(kind, data, options, name, place) {
  const host = document.createElement("div");
  host.className = "lc-picture";
  Object.assign(host.style, { position: "fixed", left: "-4000px", top: "0", width: `${WIDTH}px`, height: `${HEIGHT}px` });
  place.append(host); // inside the element that defines the colours
  const chart = new kind(host, options);
  try {
    chart.set(data);
    chart.draw();
    const colour = getComputedStyle(place).getPropertyValue("--card").trim() || "#ffffff";
    download(await rendered(chart.svg, colour), name);
  } finally {
    chart.destroy();
    host.remove();
  }
}

/** Return an SVG element as PNG, independent of style sheets. */
async function rendered(svg, colour) {
  const { width, height } = svg.getBoundingClientRect(), copy = svg.cloneNode(true);
  const from = [svg, ...svg.querySelectorAll("*")], to = [copy, ...copy.querySelectorAll("*")];
  from.forEach((element, k) => {
    const style = getComputedStyle(element);
    to[k].setAttribute("style", SHOWN.map((name) => `${name}:${style.getPropertyValue(name)}`).join(";"));
  });
  for (const [name, value] of Object.entries({ xmlns: "http://www.w3.org/2000/svg", width, height })) copy.setAttribute(name, value);
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
  await image.decode();
  const canvas = document.createElement("canvas"), edge = EDGE * TIMES;
  Object.assign(canvas, { width: width * TIMES + 2 * edge, height: height * TIMES + 2 * edge });
  const pen = canvas.getContext("2d");
  pen.fillStyle = colour;
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.drawImage(image, edge, edge, width * TIMES, height * TIMES);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
}

function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
