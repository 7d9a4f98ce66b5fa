/** A stick on the screen: a finger or the mouse leads it, let go it springs back. */

import { make } from "../lib/dom.js";
import { withoutDeadZone } from "./values.js";

const DEAD_ZONE = 0.06;

/** One stick with two axes. Several are held at once, each by a finger of its own. */
export class ScreenStick {
  /** @type {number|null} */
  #pointer = null;
  #knob;
  #onChange;

  /** To the right and up, each -1 to 1. */
  right = 0;
  up = 0;

  /**
   * @param {HTMLElement} element an empty box
   * @param {{label: string, ends: [string, string, string, string], onChange?: () => void}} options label: for those
   *   who do not see it; ends: words at its top, right, bottom and left
   */
  constructor(element, { label, ends, onChange = () => {} }) {
    this.element = element;
    this.#onChange = onChange;
    this.#knob = make("span", { class: "knob", "aria-hidden": "true" });
    element.classList.add("stick");
    element.setAttribute("role", "group");
    element.setAttribute("aria-label", label);
    for (const [number, side] of ["top", "right", "bottom", "left"].entries()) {
      element.append(make("span", { class: `end ${side}`, "aria-hidden": "true" }, ends[number]));
    }
    element.append(this.#knob);
    element.addEventListener("pointerdown", (event) => this.#down(event));
    element.addEventListener("pointermove", (event) => this.#move(event));
    for (const name of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) {
      element.addEventListener(name, (event) => {
        if (event.pointerId === this.#pointer) this.release();
      });
    }
    element.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  /** Let it spring back, whoever holds it. */
  release() {
    this.#pointer = null;
    this.element.classList.remove("held");
    this.#place(0, 0);
  }

  /** @param {PointerEvent} event */
  #down(event) {
    if (this.#pointer !== null || (event.pointerType === "mouse" && event.button !== 0)) return;
    event.preventDefault();
    this.#pointer = event.pointerId;
    this.element.setPointerCapture(event.pointerId);
    this.element.classList.add("held");
    this.#move(event);
  }

  /** @param {PointerEvent} event */
  #move(event) {
    if (event.pointerId !== this.#pointer) return;
    const box = this.element.getBoundingClientRect();
    const radius = box.width * 0.36; // from there on it is at its end
    const x = (event.clientX - box.left - box.width / 2) / radius;
    const y = (box.top + box.height / 2 - event.clientY) / radius;
    this.#place(Math.max(-1, Math.min(1, x)), Math.max(-1, Math.min(1, y)));
  }

  /** @param {number} x to the right, -1 to 1 @param {number} y up, -1 to 1 */
  #place(x, y) {
    this.right = withoutDeadZone(x, DEAD_ZONE);
    this.up = withoutDeadZone(y, DEAD_ZONE);
    this.#knob.style.setProperty("--x", x.toFixed(3));
    this.#knob.style.setProperty("--y", y.toFixed(3));
    this.#onChange();
  }
}
