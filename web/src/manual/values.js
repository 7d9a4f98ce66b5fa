/**
 * What the inputs say, and what is sent for it.
 *
 * @typedef {object} Sticks each -1 to 1
 * @property {number} forward
 * @property {number} right
 * @property {number} up
 * @property {number} yaw clockwise from above
 */

/** @type {("forward"|"right"|"up"|"yaw")[]} */
export const AXES = ["forward", "right", "up", "yaw"];

/** How far from its middle an autopilot takes a stick for centred (PX4's MAN_DEADZONE): what is sent begins there. */
export const VEHICLE_DEAD_ZONE = 0.1;

/** Up and yaw are slow by nature: their share of full stick is so much greater than the one chosen. */
const BOOST = { forward: 1, right: 1, up: 2, yaw: 2 };

/** @returns {Sticks} */
export function neutral() {
  return { forward: 0, right: 0, up: 0, yaw: 0 };
}

/** The largest deflection. @param {Sticks} sticks */
export function size(sticks) {
  return Math.max(...AXES.map((axis) => Math.abs(sticks[axis])));
}

/**
 * Take out a dead zone: 0 within, and from there evenly up to 1.
 * @param {number} value -1 to 1; anything else, such as a broken axis, counts as 0
 * @param {number} dead
 */
export function withoutDeadZone(value, dead) {
  if (!Number.isFinite(value) || Math.abs(value) <= dead) return 0;
  return Math.sign(value) * Math.min(1, (Math.abs(value) - dead) / (1 - dead));
}

/**
 * What is sent for a deflection.
 * @param {Sticks} sticks as held
 * @param {number} share of full stick that a full deflection is to be, 0 to 1
 * @returns {Sticks}
 */
export function shaped(sticks, share) {
  const sent = neutral();
  for (const axis of AXES) {
    const held = Math.max(-1, Math.min(1, sticks[axis]));
    if (held === 0) continue;
    const top = Math.min(1, share * BOOST[axis]);
    const value = VEHICLE_DEAD_ZONE + (1 - VEHICLE_DEAD_ZONE) * top * Math.abs(held);
    sent[axis] = Math.sign(held) * Math.round(value * 1000) / 1000;
  }
  return sent;
}

/**
 * Who steers: the input that is held furthest from its middle.
 * @param {{name: string, sticks: Sticks}[]} inputs
 * @returns {{name: string, sticks: Sticks}} name "" if all are centred
 */
export function strongest(inputs) {
  let found = { name: "", sticks: neutral() };
  for (const input of inputs) if (size(input.sticks) > size(found.sticks)) found = input;
  return found;
}
