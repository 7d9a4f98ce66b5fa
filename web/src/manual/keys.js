/** The keyboard as sticks: each key leads its axis smoothly to its end, and back when it is let go. */

import { AXES, neutral } from "./values.js";

/** @import {Sticks} from "./values.js" */

const RISE_PER_S = 2.5;
const FALL_PER_S = 8;

/**
 * By place on the keyboard, so that every layout has them under the same fingers.
 * @type {Record<string, [keyof Sticks, number]>}
 */
const KEYS = {
  ArrowUp: ["forward", 1],
  ArrowDown: ["forward", -1],
  ArrowRight: ["right", 1],
  ArrowLeft: ["right", -1],
  KeyW: ["up", 1],
  KeyS: ["up", -1],
  KeyD: ["yaw", 1],
  KeyA: ["yaw", -1],
};

/** Keys held, and where the sticks are that they lead. */
export class Keys {
  /** @type {Set<string>} */
  #held = new Set();
  #sticks = neutral();
  /** @type {number|null} */
  #lastMs = null;

  /** @param {string} code of a key @returns {boolean} whether it steers */
  steers(code) {
    return code in KEYS;
  }

  /** @param {string} code */
  press(code) {
    if (code in KEYS) this.#held.add(code);
  }

  /** @param {string} code */
  release(code) {
    this.#held.delete(code);
  }

  /** Let go of all keys; the sticks are centred at once. */
  clear() {
    this.#held.clear();
    this.#sticks = neutral();
  }

  /**
   * @param {number} nowMs
   * @returns {Sticks}
   */
  read(nowMs) {
    const passed_s = this.#lastMs === null ? 0 : Math.min(0.1, Math.max(0, (nowMs - this.#lastMs) / 1000));
    this.#lastMs = nowMs;
    const wanted = neutral();
    for (const code of this.#held) wanted[KEYS[code][0]] += KEYS[code][1];
    for (const axis of AXES) this.#sticks[axis] = led(this.#sticks[axis], wanted[axis], passed_s);
    return { ...this.#sticks };
  }
}

/**
 * Where a stick is after some time, on its way to where it is wanted.
 * @param {number} now @param {number} wanted @param {number} passed_s
 */
function led(now, wanted, passed_s) {
  const returns = wanted === 0 || now * wanted < 0;
  const step = (returns ? FALL_PER_S : RISE_PER_S) * passed_s;
  return Math.abs(wanted - now) <= step ? wanted : now + Math.sign(wanted - now) * step;
}
