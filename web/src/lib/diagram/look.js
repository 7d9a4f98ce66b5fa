/** What mouse, fingers and keys do with a diagram that is only looked at: move and zoom it, open and close superstates. */

const CLICK_PX = 5;
const STEP = 1.35;

/** @param {import("./diagram_view.js").DiagramView} view @param {HTMLElement} box holds it and takes the focus */
export function lookAt(view, box) {
  const { root, viewport } = view;
  /** @type {Map<number, {x: number, y: number}>} */
  const fingers = new Map();
  let moved = 0;
  root.addEventListener("pointerdown", (event) => {
    root.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    moved = 0;
    box.focus({ preventScroll: true });
  });
  root.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const now = { x: event.clientX, y: event.clientY };
    const [other] = [...fingers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
    const share = other ? 0.5 : 1; // of two fingers each moves it by half
    viewport.mover()((now.x - before.x) * share, (now.y - before.y) * share);
    if (other) {
      /** @param {{x: number, y: number}} place */
      const apart = (place) => Math.max(10, Math.hypot(place.x - other.x, place.y - other.y));
      viewport.zoom(apart(now) / apart(before), { clientX: (now.x + other.x) / 2, clientY: (now.y + other.y) / 2 });
    }
    fingers.set(event.pointerId, now);
    moved += Math.hypot(now.x - before.x, now.y - before.y);
    if (moved > CLICK_PX) viewport.onTouched();
  });
  root.addEventListener("pointerup", (event) => {
    if (moved <= CLICK_PX && fingers.size === 1) {
      const found = view.foldAt(document.elementFromPoint(event.clientX, event.clientY));
      if (found) view.toggle(found);
    }
  });
  for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
    root.addEventListener(type, (event) => fingers.delete(/** @type {PointerEvent} */ (event).pointerId));
  }
  box.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { width, height } = root.getBoundingClientRect();
    const shift = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (shift) viewport.mover()(shift[0] * width / 8, shift[1] * height / 8);
    else if (event.key === "+" || event.key === "=") viewport.zoom(STEP);
    else if (event.key === "-") viewport.zoom(1 / STEP);
    else return;
    viewport.onTouched();
    event.preventDefault();
  });
}
