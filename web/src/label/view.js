/** A picture, enlarged, with frames that are clicked and moved. */

/** @typedef {import("./main.js").Place} Place */

const LARGEST = 12;
const REACH = 8; // screen pixels within which a corner is taken
const LINES = { red: "#ff5a5a", green: "#3ddc5f", blue: "#6ea1ff", cyan: "#2ee6e6", magenta: "#ff5cf4" };

/**
 * The corners upper left, upper right, lower right, lower left, in whatever order they were clicked.
 * @param {Place[]} clicked four
 * @returns {Place[]}
 */
export function ordered(clicked) {
  const [x, y] = [0, 1].map((k) => clicked.reduce((sum, place) => sum + place[k], 0) / clicked.length);
  const around = [...clicked].sort((a, b) => Math.atan2(a[1] - y, a[0] - x) - Math.atan2(b[1] - y, b[0] - x)); // clockwise, as rows go down
  const first = around.reduce((best, place, k) => (place[0] + place[1] < around[best][0] + around[best][1] ? k : best), 0);
  return [...around.slice(first), ...around.slice(0, first)];
}

/** Draws on a canvas, and tells what is clicked and moved. */
export class PictureView {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{click: (place: Place) => void, moved: (gate: number, corner: number, place: Place) => void, released: () => void}} hear
   */
  constructor(canvas, hear) {
    this.canvas = canvas;
    this.image = new Image();
    this.scale = 0;
    /** @type {[import("./main.js").Gate[], import("./main.js").Shown[], Place[]]} */
    this.last = [[], [], []];
    /** @type {[number, number]|null} */
    this.held = null;
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !this.scale) return;
      this.held = this.cornerAt(event);
      if (this.held) canvas.setPointerCapture(event.pointerId);
      else hear.click(this.placeOf(event));
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.held) hear.moved(...this.held, this.placeOf(event));
    });
    canvas.addEventListener("pointerup", () => {
      if (this.held) hear.released();
      this.held = null;
    });
  }

  /** Show another picture. @param {string} address */
  async load(address) {
    const image = new Image();
    image.src = address;
    await image.decode().catch(() => {
      throw new Error("The picture cannot be shown; remove it from the folder.");
    });
    this.image = image;
    const { clientWidth, clientHeight } = /** @type {HTMLElement} */ (this.canvas.parentElement);
    const fits = Math.floor(Math.min(clientWidth / image.width, clientHeight / image.height));
    this.scale = Math.min(Math.max(fits, 1), LARGEST);
    this.draw(...this.last);
  }

  /** @param {number} steps */
  zoom(steps) {
    if (!this.scale) return;
    this.scale = Math.min(Math.max(this.scale + steps, 1), LARGEST);
    this.draw(...this.last);
  }

  /** Where a click is, column and row. @param {MouseEvent} event @returns {Place} */
  placeOf(event) {
    const box = this.canvas.getBoundingClientRect();
    return [(event.clientX - box.left) / this.scale - 0.5, (event.clientY - box.top) / this.scale - 0.5];
  }

  /** The corner under the pointer: its frame and its place in it. @param {MouseEvent} event @returns {[number, number]|null} */
  cornerAt(event) {
    const [x, y] = this.placeOf(event);
    for (const [gate, { corners }] of this.last[0].entries()) {
      const corner = corners.findIndex((place) => Math.hypot(place[0] - x, place[1] - y) * this.scale < REACH);
      if (corner >= 0) return [gate, corner];
    }
    return null;
  }

  /**
   * @param {import("./main.js").Gate[]} gates
   * @param {import("./main.js").Shown[]} shown
   * @param {Place[]} begun corners of the next frame
   */
  draw(gates, shown, begun) {
    this.last = [gates, shown, begun];
    const { canvas, image, scale } = this;
    if (!scale) return;
    [canvas.width, canvas.height] = [image.width * scale, image.height * scale];
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    pen.imageSmoothingEnabled = false;
    pen.drawImage(image, 0, 0, canvas.width, canvas.height);
    const at = (/** @type {Place} */ [column, row]) => /** @type {Place} */ ([(column + 0.5) * scale, (row + 0.5) * scale]);
    pen.lineWidth = 1.5;
    for (const [k, gate] of gates.entries()) {
      pen.strokeStyle = LINES[/** @type {keyof LINES} */ (gate.colour)];
      for (const outline of shown[k]?.outlines ?? []) {
        pen.beginPath();
        for (const place of outline) pen.lineTo(...at(place));
        pen.closePath();
        pen.stroke();
      }
      for (const place of gate.corners) cross(pen, at(place));
    }
    pen.strokeStyle = "#fff";
    for (const place of begun) cross(pen, at(place));
  }
}

/** A mark whose middle stays visible. @param {CanvasRenderingContext2D} pen @param {Place} place */
function cross(pen, [x, y]) {
  for (const [right, down] of [[1, 1], [1, -1], [-1, 1], [-1, -1]]) {
    pen.beginPath();
    pen.moveTo(x + 2 * right, y + 2 * down);
    pen.lineTo(x + 6 * right, y + 6 * down);
    pen.stroke();
  }
}
