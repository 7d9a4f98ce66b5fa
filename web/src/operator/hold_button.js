/** A button that means something only while it is held: by pointer, finger, or Enter while it has the focus. */

import { setAttribute } from "../lib/dom.js";

const PERIOD_MS = 100; // the flight takes a longer gap for let go

export class HoldButton {
  #button;
  #hear;
  #timer = 0;

  /**
   * @param {HTMLButtonElement} button
   * @param {{held: () => void, letGo: () => void}} hear held: now, and ten times a second while it is held
   */
  constructor(button, hear) {
    this.#button = button;
    this.#hear = hear;
    button.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || button.disabled) return;
      button.setPointerCapture(event.pointerId); // a finger that rolls off the edge still holds it
      this.press();
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) {
      button.addEventListener(name, () => this.release());
    }
    button.addEventListener("keydown", (event) => {
      if (event.key === "Enter" && !event.repeat) this.press();
      if (event.key === "Enter") event.preventDefault();
    });
    button.addEventListener("keyup", (event) => {
      if (event.key === "Enter") this.release();
    });
    button.addEventListener("contextmenu", (event) => event.preventDefault()); // a long touch opens one
    addEventListener("blur", () => this.release());
    document.addEventListener("visibilitychange", () => this.release());
  }

  /** It is pressed, by whatever means. */
  press() {
    if (this.#timer || this.#button.disabled) return;
    setAttribute(this.#button, "data-held", true);
    this.#timer = setInterval(() => this.#hold(), PERIOD_MS);
    this.#hold();
  }

  /** It is let go, or cannot be held any more. */
  release() {
    if (!this.#timer) return;
    clearInterval(this.#timer);
    this.#timer = 0;
    setAttribute(this.#button, "data-held", null);
    this.#hear.letGo();
  }

  #hold() {
    if (this.#button.disabled) this.release();
    else this.#hear.held();
  }
}
