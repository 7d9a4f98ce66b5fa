/** A gamepad: mode 2, that is, the left stick climbs and turns, the right one goes forward and sideways. */

import { neutral, withoutDeadZone } from "./values.js";

/** @import {Sticks} from "./values.js" */
/** @typedef {import("../lib/messages.js").ManualControl.Order["what"]} What */

const DEAD_ZONE = 0.08;

/**
 * Buttons of the standard mapping: the lowest of the four on the right, the right one, the left one.
 * @type {Record<number, What>}
 */
const BUTTONS = { 0: "take", 1: "give", 2: "hold" };

/** The first gamepad that has two sticks. */
export class Gamepads {
  /** @type {Object<string, boolean>|null} */
  #pressed = null;

  /** Its name; "" if there is none. */
  name = "";

  /**
   * Look at it once.
   * @returns {{sticks: Sticks, orders: What[]}} orders: of buttons pressed since last time
   */
  read() {
    const pad = [...(navigator.getGamepads?.() ?? [])].find((each) => each?.connected && each.axes.length >= 4);
    this.name = pad ? pad.id : "";
    if (!pad) {
      this.#pressed = null;
      return { sticks: neutral(), orders: [] };
    }
    const [turn, down, right, back] = [0, 1, 2, 3].map((axis) => withoutDeadZone(pad.axes[axis], DEAD_ZONE));
    return { sticks: { forward: 0 - back, right, up: 0 - down, yaw: turn }, orders: this.#orders(pad) };
  }

  /** Forget which buttons are down: those held now have to be let go before they count. */
  clear() {
    this.#pressed = null;
  }

  /** @param {Gamepad} pad */
  #orders(pad) {
    /** @type {What[]} */
    const orders = [];
    const before = this.#pressed;
    this.#pressed = {};
    for (const [number, what] of Object.entries(BUTTONS)) {
      const down = Boolean(pad.buttons[/** @type {number} */ (/** @type {unknown} */ (number))]?.pressed);
      this.#pressed[number] = down;
      if (down && before !== null && !before[number]) orders.push(what);
    }
    return orders;
  }
}
