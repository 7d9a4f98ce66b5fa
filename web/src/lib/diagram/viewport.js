/** The part of a drawing that is seen: moved and zoomed. */

/**
 * @typedef {import("./geometry.js").Box} Box
 * @typedef {import("./geometry.js").Point} Point
 */

const ZOOM = { least: 0.05, most: 3, step: 1.0015 };
const MARGIN = 24; // around what is brought into view, in pixels

export class Viewport {
  #svg;
  #world;
  #wheelNeeds;
  #largest;
  /** Told that somebody has zoomed with the wheel or moved it. */
  onTouched = () => {};
  #view = { x: 0, y: 0, scale: 1 };

  /**
   * @param {SVGSVGElement} svg
   * @param {SVGGElement} world in it, with all that moves
   * @param {HTMLElement|null} wheelNeeds what must have the focus before the wheel zooms; else it scrolls the page
   * @param {number} largest scale at which something is shown by itself
   */
  constructor(svg, world, wheelNeeds, largest) {
    this.#wheelNeeds = wheelNeeds;
    this.#largest = largest;
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

  /** The largest scale with which a part is seen whole. @param {number} width @param {number} height */
  scaleOf(width, height) {
    const frame = this.#svg.getBoundingClientRect();
    return Math.min(frame.width / width, frame.height / height);
  }

  /**
   * Show a part with what is around it, whole if that can be at a scale.
   * @param {Box} box
   * @param {[number, number]} all the drawing's size
   * @param {[number, number]} scales the least and the largest
   */
  show(box, all, [least, largest]) {
    const { width, height } = this.#svg.getBoundingClientRect();
    const scale = Math.min(largest, Math.max(least, this.scaleOf(box.width + MARGIN, box.height + MARGIN)));
    /**
     * In the middle, but nothing empty beside the drawing if it is larger than what is seen.
     * @param {number} start @param {number} size @param {number} whole @param {number} seen
     */
    const place = (start, size, whole, seen) => {
      if (whole * scale <= seen) return (seen - whole * scale) / 2;
      return Math.min(0, Math.max(seen - whole * scale, seen / 2 - (start + size / 2) * scale));
    };
    this.#set({ x: place(box.x, box.width, all[0], width), y: place(box.y, box.height, all[1], height), scale });
  }

  /** Show all of a drawing. @param {[number, number]} size its width and height */
  fit(size) {
    this.show({ x: 0, y: 0, width: size[0] - MARGIN, height: size[1] - MARGIN }, size, [ZOOM.least, this.#largest]);
  }

  /** Bring a part into view, if it is not. @param {Box} box */
  reveal(box) {
    const { width, height } = this.#svg.getBoundingClientRect();
    const { x, y, scale } = this.#view;
    /** @param {number} offset @param {number} start @param {number} size @param {number} whole */
    const moved = (offset, start, size, whole) => {
      const from = start * scale + offset, to = from + Math.min(size * scale, whole - 2 * MARGIN);
      return offset + (from < MARGIN ? MARGIN - from : to > whole - MARGIN ? whole - MARGIN - to : 0);
    };
    /** @param {number} start @param {number} size @param {number} whole */
    const isSeen = (start, size, whole) => start >= 0 && start + size <= whole;
    if (isSeen(box.x * scale + x, box.width * scale, width) && isSeen(box.y * scale + y, box.height * scale, height)) return;
    this.#set({ x: moved(x, box.x, box.width, width), y: moved(y, box.y, box.height, height), scale });
  }

  /** Move the drawing. @returns {(dx: number, dy: number) => void} called with how far it is from where it was, in pixels */
  mover() {
    const before = this.#view;
    return (dx, dy) => this.#set({ ...before, x: before.x + dx, y: before.y + dy });
  }

  /** @param {{x: number, y: number, scale: number}} view */
  #set(view) {
    this.#view = view;
    this.#world.setAttribute("transform", `translate(${view.x},${view.y}) scale(${view.scale})`);
  }

  /** @param {WheelEvent} event */
  #zoom(event) {
    if (this.#wheelNeeds && !event.ctrlKey && !this.#wheelNeeds.contains(document.activeElement)) return;
    event.preventDefault();
    this.zoom(ZOOM.step ** -event.deltaY, event);
    this.onTouched();
  }

  /** Come nearer (above 1) or go away (below 1). @param {number} factor @param {{clientX: number, clientY: number}|null} [place] that stays where it is; the middle */
  zoom(factor, place = null) {
    const { x, y, scale } = this.#view;
    const next = Math.min(ZOOM.most, Math.max(ZOOM.least, scale * factor));
    const frame = this.#svg.getBoundingClientRect();
    const at = place ? { x: place.clientX - frame.x, y: place.clientY - frame.y } : { x: frame.width / 2, y: frame.height / 2 };
    this.#set({ x: at.x - (at.x - x) * next / scale, y: at.y - (at.y - y) * next / scale, scale: next });
  }
}
