// Saves the chart beside a button as a PNG file, with the colours of the page.
(() => {
  const SHOWN = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-opacity", "stroke-dasharray", "stroke-linecap", "stroke-linejoin", "opacity", "font-family", "font-size", "font-weight"];
  const WIDTH = 2000, EDGE = 24; // minimum width and margin, pixels

  document.addEventListener("click", async (event) => {
    const at = event.target.closest?.("[data-picture]"), svg = at?.closest("section").querySelector("svg");
    if (!svg) return;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(await rendered(svg));
    link.download = at.dataset.picture;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  });

  /** Return an SVG element as PNG, independent of style sheets. */
  async function rendered(svg) {
    const { width, height } = svg.getBoundingClientRect(), copy = svg.cloneNode(true), times = WIDTH / width;
    const from = [svg, ...svg.querySelectorAll("*")], to = [copy, ...copy.querySelectorAll("*")];
    from.forEach((element, k) => {
      const style = getComputedStyle(element);
      for (const name of SHOWN) to[k].style.setProperty(name, style.getPropertyValue(name));
    });
    for (const [name, value] of Object.entries({ xmlns: "http://www.w3.org/2000/svg", width: WIDTH, height: height * times, viewBox: `0 0 ${width} ${height}` })) copy.setAttribute(name, value);
    const image = new Image();
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
    await image.decode();
    const canvas = document.createElement("canvas");
    Object.assign(canvas, { width: WIDTH + 2 * EDGE, height: height * times + 2 * EDGE });
    const pen = canvas.getContext("2d");
    pen.fillStyle = getComputedStyle(document.querySelector(".studio")).getPropertyValue("--card").trim() || "#ffffff";
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.drawImage(image, EDGE, EDGE, WIDTH, height * times);
    return new Promise((done) => canvas.toBlob(done, "image/png"));
  }
})();
