/** The message "history": a flight so far, as poses. */

/**
 * @param {number} id of the drone
 * @param {any[][]} rows t, x, y, z, yaw, velocity forward, left, up, turn rate, the four commanded, motors, state
 * @returns {import("../arena/arena.js").DronePose[]} with the attitude level
 */
export function posesOf(id, rows) {
  return rows.map(([t, x, y, z, yaw, forward, left, up, r, cx, cy, cz, cr, on, s]) => ({
    id, t, s, r,
    p: [x, y, z],
    q: [Math.cos(yaw / 2), 0, 0, Math.sin(yaw / 2)],
    v: [forward, left, up],
    c: cx === null ? null : [cx, cy, cz, cr],
    on: on === 1,
    fresh: true,
  }));
}
