/** Place and speeds over the last minute: x, y, z, yaw, and what was commanded against what was measured. */
export class Plots {
  /** @param {HTMLElement} element an empty box; its width is followed */
  constructor(element) { this.element = element; }

  /**
   * @param {number} t seconds; going back in time starts anew
   * @param {import("./arena.js").Pose} pose with v (forward, left, up, m/s), r (rad/s to the left) and c or null
   */
  add(t, pose) {}

  /** Forget everything. */
  clear() {}

  /**
   * Show the minute that ends at a time instead of the newest, for a replay.
   * @param {number|null} t seconds; null: the newest again
   */
  showUntil(t) {}
}
