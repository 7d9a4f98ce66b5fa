import { wantsStillness } from "../dom.js";

const LARGEST = 6; // pixels on the page for one of the drawing
const GLIDE_MS = 350;
const SLOW_MS = 70; // between two steps of a glide: a machine that is so slow is spared the rest of it
const STEP = 1.35;

/** Moves about in an SVG by its view box: drag, pinch, wheel, keys. */
export class PanZoom {
  #svg;
  #box;
  #home;
  #view;
  #pointers = new Map();
  #glide = 0;
  #onTouched;

  /**
   * @param {HTMLElement} box holds the SVG and takes the focus
   * @param {SVGSVGElement} svg with a view box around all of it
   * @param {function(): void} onTouched called when somebody moves it by hand
   */
  constructor(box, svg, onTouched) {
    this.#svg = svg;
    this.#box = box;
    const { x, y, width, height } = svg.viewBox.baseVal;
    this.#home = { x, y, width, height };
    this.#view = { ...this.#home };
    this.#onTouched = onTouched;
    svg.removeAttribute("width");
    svg.removeAttribute("height");
    svg.style.maxWidth = "";
    svg.setAttribute("preserveAspectRatio", "xMidYMid meet");
    const on = (type, hear) => svg.addEventListener(type, hear);
    on("pointerdown", (event) => this.#down(event));
    on("pointermove", (event) => this.#move(event));
    for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) on(type, (event) => this.#pointers.delete(event.pointerId));
    svg.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
  }

  /** Show all of it. */
  whole() {
    this.#to(this.#home);
  }

  /**
   * Show a part, whole and with some room around it.
   * @param {DOMRect} part in the drawing's own measure
   */
  show(part) {
    const room = 16;
    this.#to({ x: part.x - room, y: part.y - room, width: part.width + 2 * room, height: part.height + 2 * room });
  }

  /** Come nearer (above 1) or go away (below 1); about the middle if no place is given. */
  zoom(factor, place = null) {
    const view = this.#seen();
    const scale = this.#svg.clientWidth / view.width;
    const least = Math.min(this.#svg.clientWidth / this.#home.width, this.#svg.clientHeight / this.#home.height) * 0.7;
    const used = Math.min(LARGEST, Math.max(least, scale * factor)) / scale;
    const [x, y] = place ?? [view.x + view.width / 2, view.y + view.height / 2];
    this.#set({
      x: x - (x - view.x) / used, y: y - (y - view.y) / used,
      width: view.width / used, height: view.height / used,
    });
  }

  /** What keys do: arrows move, + and - zoom, 0 shows all. Returns whether it was one of these. */
  key(key) {
    const view = this.#seen();
    const [dx, dy] = [view.width / 8, view.height / 8];
    const shift = { ArrowLeft: [-dx, 0], ArrowRight: [dx, 0], ArrowUp: [0, -dy], ArrowDown: [0, dy] }[key];
    if (shift) this.#set({ ...view, x: view.x + shift[0], y: view.y + shift[1] });
    else if (key === "+" || key === "=") this.zoom(STEP);
    else if (key === "-") this.zoom(1 / STEP);
    else return false;
    this.#onTouched();
    return true;
  }

  /** The part of the drawing that fills the box: the view box and what stands beside it. */
  #seen() {
    const { clientWidth: wide, clientHeight: high } = this.#svg;
    const { x, y, width, height } = this.#view;
    const scale = Math.min(wide / width, high / height) || 1;
    const [w, h] = [wide / scale, high / scale];
    return { x: x - (w - width) / 2, y: y - (h - height) / 2, width: w, height: h };
  }

  #set(view) {
    cancelAnimationFrame(this.#glide);
    this.#view = view;
    this.#svg.setAttribute("viewBox", `${view.x} ${view.y} ${view.width} ${view.height}`);
  }

  #to(aim) {
    cancelAnimationFrame(this.#glide);
    if (wantsStillness() || document.hidden || this.#svg.clientWidth === 0) return this.#set({ ...aim });
    const from = { ...this.#view };
    const began = performance.now();
    let last = began;
    const step = (now) => {
      const isSlow = performance.now() - last > SLOW_MS;
      last = performance.now();
      const share = isSlow ? 1 : Math.min(1, Math.max(0, (now - began) / GLIDE_MS));
      const eased = share * share * (3 - 2 * share);
      const view = {};
      for (const name of ["x", "y", "width", "height"]) view[name] = from[name] + (aim[name] - from[name]) * eased;
      this.#set(view);
      if (share < 1) this.#glide = requestAnimationFrame(step);
    };
    this.#glide = requestAnimationFrame(step);
  }

  #place(clientX, clientY) {
    const { left, top } = this.#svg.getBoundingClientRect();
    const view = this.#seen();
    const scale = view.width / this.#svg.clientWidth;
    return [view.x + (clientX - left) * scale, view.y + (clientY - top) * scale];
  }

  #down(event) {
    this.#svg.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, [event.clientX, event.clientY]);
    this.#box.focus({ preventScroll: true });
  }

  #move(event) {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const others = [...this.#pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
    const view = this.#seen();
    const scale = view.width / this.#svg.clientWidth;
    const share = others.length > 0 ? 0.5 : 1; // of two fingers each moves it by half
    this.#set({ ...view, x: view.x - (now[0] - before[0]) * scale * share, y: view.y - (now[1] - before[1]) * scale * share });
    if (others.length > 0) {
      const apart = (place) => Math.max(10, Math.hypot(place[0] - others[0][0], place[1] - others[0][1]));
      this.zoom(apart(now) / apart(before), this.#place((now[0] + others[0][0]) / 2, (now[1] + others[0][1]) / 2));
    }
    this.#pointers.set(event.pointerId, now);
    this.#onTouched();
  }

  /** The wheel scrolls the page unless the drawing has the focus or Ctrl is held. */
  #wheel(event) {
    if (!event.ctrlKey && !this.#box.contains(document.activeElement)) return;
    event.preventDefault();
    this.zoom(Math.exp(-event.deltaY / (event.ctrlKey ? 150 : 400)), this.#place(event.clientX, event.clientY));
    this.#onTouched();
  }
}
