/** Brings the images of a run to a view: the one that is wanted, and while it plays those that come next. */
import { addressOf } from "../lib/replay/run.js";

const AHEAD = 12;
const KEPT = 60;
const AT_ONCE = 3;

export class Images {
  #view;
  #address;
  #count;
  /** @type {Map<number, Blob>} */
  #kept = new Map(); // oldest first
  /** @type {Set<number>} */
  #loading = new Set();
  /** @type {number|null} */
  #wanted = null;
  /** @type {number|null} */
  #shown = null;

  /**
   * @param {import("../lib/flight/camera.js").CameraView} view
   * @param {string} name of the run
   * @param {number} count how many images it has
   */
  constructor(view, name, count) {
    this.#view = view;
    this.#address = addressOf(name);
    this.#count = count;
    view.setImage(null, count ? "before the first image" : "this flight has no video");
  }

  /** @param {number|null} number of the image to show; null: there is none yet */
  want(number) {
    this.#wanted = number;
    if (number === null) {
      if (this.#shown !== null) this.#view.setImage(null, "before the first image");
      this.#shown = null;
      return;
    }
    this.#show();
    this.#load();
  }

  /** Show the wanted image, or while it is under way the newest before it that is there. */
  #show() {
    let number = this.#wanted;
    while (number !== null && number > /** @type {number} */ (this.#wanted) - AHEAD
      && !this.#kept.has(number)) number -= 1;
    const blob = this.#kept.get(/** @type {number} */ (number));
    if (!blob || number === this.#shown) return;
    this.#shown = number;
    this.#view.setImage(blob);
  }

  #load() {
    for (let step = 0; step < AHEAD && this.#loading.size < AT_ONCE; step += 1) {
      const number = /** @type {number} */ (this.#wanted) + step;
      if (number >= this.#count || this.#kept.has(number) || this.#loading.has(number)) continue;
      this.#fetch(number);
    }
  }

  /** @param {number} number */
  async #fetch(number) {
    this.#loading.add(number);
    try {
      const answer = await fetch(`${this.#address}/image/${number}.jpg`);
      if (answer.ok) this.#keep(number, await answer.blob());
      else if (number === this.#wanted) this.#view.setImage(null, "this image cannot be shown");
    } catch {
      if (number === this.#wanted) this.#view.setImage(null, "the monitor does not answer");
    } finally {
      this.#loading.delete(number);
    }
    if (this.#wanted === null || !this.#kept.has(number)) return; // not again and again what failed
    this.#show();
    this.#load();
  }

  /** @param {number} number @param {Blob} blob */
  #keep(number, blob) {
    this.#kept.set(number, blob);
    for (const old of this.#kept.keys()) {
      if (this.#kept.size <= KEPT) break;
      this.#kept.delete(old);
    }
  }
}
