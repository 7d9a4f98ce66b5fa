/** The part of a drawing that is seen: moved and zoomed. */

/**
 * @typedef {import("./geometry.js").Box} Box
 * @typedef {import("./geometry.js").Point} Point
 */

const ZOOM = { least: 0.05, most: 3, step: 1.0015, fit: 1.2 };
const MARGIN = 24; // around what is brought into view, in pixels

export class Viewport {
  #svg;
  #world;
  #view = { x: 0, y: 0, scale: 1 };

  /** @param {SVGSVGElement} svg @param {SVGGElement} world in it, with all that moves */
  constructor(svg, world) {
    this.#svg = svg;
    this.#world = world;
    svg.addEventListener("wheel", (event) => this.#zoom(event), { passive: false });
  }

  /** What is seen, in the drawing's units. @returns {Box} */
  get seen() {
    const { width, height } = this.#svg.getBoundingClientRect();
    const { x, y, scale } = this.#view;
    return { x: -x / scale, y: -y / scale, width: width / scale, height: height / scale };
  }

  /** Where the mouse is, in the drawing's units. @param {MouseEvent} event @returns {Point} */
  point(event) {
    const frame = this.#svg.getBoundingClientRect();
    const { x, y, scale } = this.#view;
    return { x: (event.clientX - frame.x - x) / scale, y: (event.clientY - frame.y - y) / scale };
  }

  /** Show all of a drawing. @param {number} right @param {number} bottom its size */
  fit(right, bottom) {
    const { width, height } = this.#svg.getBoundingClientRect();
    const scale = Math.min(ZOOM.fit, Math.max(ZOOM.least, Math.min(width / right, height / bottom)));
    this.#set({ x: Math.max(0, (width - right * scale) / 2), y: 0, scale });
  }

  /** Bring a part into view, if it is not. @param {Box} box */
  reveal(box) {
    const { width, height } = this.#svg.getBoundingClientRect();
    const { x, y, scale } = this.#view;
    const moved = (offset, start, size, whole) => {
      const from = start * scale + offset, to = from + Math.min(size * scale, whole - 2 * MARGIN);
      return offset + (from < MARGIN ? MARGIN - from : to > whole - MARGIN ? whole - MARGIN - to : 0);
    };
    const isSeen = (start, size, whole) => start >= 0 && start + size <= whole;
    if (isSeen(box.x * scale + x, box.width * scale, width) && isSeen(box.y * scale + y, box.height * scale, height)) return;
    this.#set({ x: moved(x, box.x, box.width, width), y: moved(y, box.y, box.height, height), scale });
  }

  /** Move the drawing. @returns {(dx: number, dy: number) => void} called with how far it is from where it was, in pixels */
  mover() {
    const before = this.#view;
    return (dx, dy) => this.#set({ ...before, x: before.x + dx, y: before.y + dy });
  }

  #set(view) {
    this.#view = view;
    this.#world.setAttribute("transform", `translate(${view.x},${view.y}) scale(${view.scale})`);
  }

  /** @param {WheelEvent} event */
  #zoom(event) {
    event.preventDefault();
    const { x, y, scale } = this.#view;
    const next = Math.min(ZOOM.most, Math.max(ZOOM.least, scale * ZOOM.step ** -event.deltaY));
    const frame = this.#svg.getBoundingClientRect();
    const at = { x: event.clientX - frame.x, y: event.clientY - frame.y };
    this.#set({ x: at.x - (at.x - x) * next / scale, y: at.y - (at.y - y) * next / scale, scale: next });
  }
}
