/** What the mouse does with the diagram: select, move and join states, lead transitions elsewhere, move the drawing. */

/**
 * @typedef {import("../lib/diagram/diagram_view.js").DiagramView} DiagramView
 * @typedef {import("../lib/diagram/diagram_view.js").Selection} Selection
 * @typedef {import("../lib/diagram/geometry.js").Point} Point
 * @typedef {{selected: (selection: Selection) => void, placed: (places: Object<string, Point>) => void,
 *   joined: (from: string, to: string) => void, moved: (state: string, parent: string, place: Point) => void,
 *   led: (transition: string, end: "source"|"target", state: string) => void,
 *   opened: (selection: Selection) => void}} Listener told what the user has done
 * @typedef {{move: (event: PointerEvent) => void, end: (event: PointerEvent, wasMoved: boolean) => void}} Action
 */

const CLICK_PX = 4;

/** @param {DiagramView} view @param {Listener} listener */
export function takeMouse(view, listener) {
  const { root } = view;
  root.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    const found = view.at(event.target);
    if (found.kind === "mission") return;
    event.preventDefault();
    listener.selected(found);
  });
  root.addEventListener("pointerdown", (event) => {
    if (event.button === 0) drag(root, event, pressed(view, listener, event));
  });
  root.addEventListener("dblclick", (event) => {
    // While the mouse is captured the event's target is the drawing.
    const found = view.at(document.elementFromPoint(event.clientX, event.clientY));
    if (found.kind !== "mission") listener.opened(found);
  });
  root.addEventListener("pointerover", (event) => {
    const found = view.at(event.target);
    if (event.buttons === 0) view.hover(found.kind === "transition" ? found.id : "");
  });
}

/**
 * Select what the mouse was pressed on.
 * @param {DiagramView} view @param {Listener} listener @param {PointerEvent} event
 * @returns {Action|null} what dragging does
 */
function pressed(view, listener, event) {
  const point = view.viewport.point(event);
  const folded = view.foldAt(event.target);
  if (folded) {
    view.toggle(folded);
    return null;
  }
  const handle = view.handleAt(point); // also below a line
  if (handle !== null) return joining(view, listener, handle);
  const { kind, id } = view.selection;
  for (const pulled of [kind === "transition" ? id : "", view.hovered]) {
    const end = view.endAt(point, pulled);
    if (end === null) continue;
    listener.selected({ kind: "transition", id: pulled });
    return leading(view, listener, pulled, end);
  }
  const found = view.at(event.target);
  listener.selected(found);
  if (found.kind === "state" && view.isMovable(found.id)) return moving(view, listener, found.id, point);
  return found.kind === "transition" ? null : panning(view, event);
}

/**
 * Follow the mouse until its button is released.
 * @param {SVGSVGElement} root @param {PointerEvent} start @param {Action|null} action
 */
function drag(root, start, action) {
  if (!action) return;
  let isMoved = false;
  /** @type {PointerEvent|null} */
  let latest = null;
  let frame = 0;
  /** @param {PointerEvent} event */
  const move = (event) => {
    isMoved ||= Math.hypot(event.clientX - start.clientX, event.clientY - start.clientY) > CLICK_PX;
    if (!isMoved) return;
    latest = event;
    frame ||= requestAnimationFrame(() => {
      frame = 0;
      if (latest) action.move(latest);
    });
  };
  /** @param {PointerEvent} event */
  const end = (event) => {
    root.removeEventListener("pointermove", move);
    root.removeEventListener("pointerup", end);
    root.removeEventListener("pointercancel", end);
    cancelAnimationFrame(frame);
    if (isMoved) action.move(event);
    action.end(event, isMoved && event.type === "pointerup");
  };
  root.setPointerCapture(start.pointerId);
  root.addEventListener("pointermove", move);
  root.addEventListener("pointerup", end);
  root.addEventListener("pointercancel", end);
}

/** @param {DiagramView} view @param {PointerEvent} start @returns {Action} */
function panning(view, start) {
  const moveBy = view.viewport.mover();
  return {
    move: (event) => {
      moveBy(event.clientX - start.clientX, event.clientY - start.clientY);
      view.viewport.onTouched();
    },
    end: () => {},
  };
}

/** @param {DiagramView} view @param {Listener} listener @param {string} id @param {Point} start @returns {Action} */
function moving(view, listener, id, start) {
  const moveBy = view.mover(id);
  return {
    move: (event) => {
      const { x, y } = view.viewport.point(event);
      moveBy(x - start.x, y - start.y);
    },
    end: (event, wasMoved) => {
      const parent = view.parentOf(id);
      const around = event.shiftKey ? view.superstateAt(id, view.viewport.point(event)) : parent;
      const place = view.placeIn(id, around);
      if (!wasMoved || !place) return;
      if (around === parent) listener.placed({ [id]: place });
      else listener.moved(id, around, place);
    },
  };
}

/** A line from a state to the mouse, which becomes a transition. @param {DiagramView} view @param {Listener} listener @param {string} from @returns {Action} */
function joining(view, listener, from) {
  return pulling(view, view.handleOf(from), "", (to) => listener.joined(from, to));
}

/**
 * An end of a transition follows the mouse, to another state.
 * @param {DiagramView} view @param {Listener} listener @param {string} id @param {"source"|"target"} end @returns {Action}
 */
function leading(view, listener, id, end) {
  return pulling(view, view.otherEndOf(id, end), id, (state) => listener.led(id, end, state));
}

/**
 * @param {DiagramView} view @param {Point} start @param {string} pulled id of a transition, "": a new one
 * @param {(state: string) => void} dropped @returns {Action}
 */
function pulling(view, start, pulled, dropped) {
  return {
    move: (event) => view.drawDraft(start, view.viewport.point(event), pulled),
    end: (event, wasMoved) => {
      view.removeDraft();
      const to = wasMoved ? view.stateAt(view.viewport.point(event)) : null;
      if (to !== null) dropped(to);
    },
  };
}
