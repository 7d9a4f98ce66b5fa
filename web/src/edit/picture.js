/** The diagram as a file: SVG with its styles written into it, or a PNG of that. */

const STYLES = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-dasharray", "font-size", "font-weight", "font-family", "text-anchor", "paint-order", "opacity"];
const PNG_SCALE = 2;
const MARGIN = 16;

/**
 * Save what is drawn.
 * @param {HTMLElement} drawing with the diagram
 * @param {string} name of the file, without its ending
 * @param {"svg"|"png"} kind
 */
export async function savePicture(drawing, name, kind) {
  const source = /** @type {SVGSVGElement} */ (drawing.querySelector("svg"));
  const world = /** @type {SVGGElement} */ (source.querySelector("g"));
  const { x, y, width, height } = world.getBBox();
  const copy = /** @type {SVGSVGElement} */ (source.cloneNode(true));
  const originals = source.querySelectorAll("*");
  copy.querySelectorAll("*").forEach((element, index) => {
    const computed = getComputedStyle(originals[index]);
    for (const style of STYLES) element.setAttribute(style, computed.getPropertyValue(style));
  });
  for (const element of copy.querySelectorAll(".e-handle, .e-hit, .e-draft, title")) element.remove();
  copy.querySelector("g")?.removeAttribute("transform");
  const size = { width: Math.ceil(width + 2 * MARGIN), height: Math.ceil(height + 2 * MARGIN) };
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("viewBox", `${x - MARGIN} ${y - MARGIN} ${size.width} ${size.height}`);
  copy.setAttribute("width", String(size.width));
  copy.setAttribute("height", String(size.height));
  const blob = new Blob([new XMLSerializer().serializeToString(copy)], { type: "image/svg+xml" });
  save(kind === "svg" ? blob : await paint(blob, size), `${name}.${kind}`);
}

/** @param {Blob} blob an SVG @param {{width: number, height: number}} size @returns {Promise<Blob>} a PNG */
async function paint(blob, { width, height }) {
  const image = new Image();
  image.src = URL.createObjectURL(blob);
  await image.decode();
  URL.revokeObjectURL(image.src);
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width: width * PNG_SCALE, height: height * PNG_SCALE });
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.fillStyle = "#fff";
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve) => canvas.toBlob((made) => resolve(/** @type {Blob} */ (made)), "image/png"));
}

/** @param {Blob} blob @param {string} name */
function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
