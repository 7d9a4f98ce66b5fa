/** The button that stops the motors: held for a second, or pressed and then confirmed in a dialog. */

import { make } from "../lib/dom.js";

const HOLD_MS = 1000;

export class StopButton {
  #timer = 0;
  #done = false;
  /** @type {HTMLDialogElement|undefined} */
  #dialog;
  /** @type {HTMLElement|undefined} */
  #question;
  #confirm;

  /**
   * @param {HTMLElement} element where the button goes
   * @param {{confirmed: () => void, asking: () => void, question: () => string}} hear confirmed: stop now; asking: the
   *   dialog opens; question: what it asks
   */
  constructor(element, { confirmed, asking, question }) {
    this.#confirm = confirmed;
    const words = make("span", {}, "Stop motors");
    const hint = make("small", {}, "hold 1 s");
    const button = make("button", { type: "button", class: "stop", "aria-haspopup": "dialog" }, words, hint);
    button.addEventListener("pointerdown", (event) => this.#down(event, button));
    for (const name of ["pointerup", "pointerleave", "pointercancel"]) {
      button.addEventListener(name, () => this.#up(button));
    }
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    button.addEventListener("click", () => {
      if (this.#done) {
        this.#done = false;
        return;
      }
      asking();
      /** @type {HTMLElement} */ (this.#question).textContent = question();
      /** @type {HTMLDialogElement} */ (this.#dialog).showModal();
    });
    element.append(button, this.#makeDialog());
    this.button = button;
  }

  /** Whether the dialog is open. */
  get asks() {
    return /** @type {HTMLDialogElement} */ (this.#dialog).open;
  }

  #makeDialog() {
    this.#question = make("h2", { id: "stop-question" });
    const cancel = make("button", { type: "button", autofocus: true }, "Cancel");
    const stop = make("button", { type: "button", class: "stop" }, "Stop the motors");
    cancel.addEventListener("click", () => /** @type {HTMLDialogElement} */ (this.#dialog).close());
    stop.addEventListener("click", () => {
      /** @type {HTMLDialogElement} */ (this.#dialog).close();
      this.#confirm();
    });
    this.#dialog = make(
      "dialog",
      { class: "p-dialog", "aria-labelledby": "stop-question" },
      this.#question,
      make("p", {}, "It falls from where it is."),
      make("p", { class: "p-choice" }, cancel, stop),
    );
    return this.#dialog;
  }

  /** @param {PointerEvent} event @param {HTMLButtonElement} button */
  #down(event, button) {
    if (event.button !== 0) return;
    this.#done = false;
    button.classList.add("pressing");
    this.#timer = setTimeout(() => {
      this.#done = true;
      button.classList.remove("pressing");
      this.#confirm();
    }, HOLD_MS);
  }

  /** @param {HTMLButtonElement} button */
  #up(button) {
    clearTimeout(this.#timer);
    button.classList.remove("pressing");
  }
}
