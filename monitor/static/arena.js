/**
 * @typedef {object} Pose one drone, as in the live channel's message "pose"
 * @property {number} [id] 1 if there is none
 * @property {number} t seconds
 * @property {number[]} p x, y, z, metres, arena axes
 * @property {number[]} q w, x, y, z, body forward-left-up to arena
 * @property {boolean} on motors
 * @property {number} s index into the states of its mission; -1 if none
 * @property {boolean} [fresh] true if there is none
 */

/** The arena in three dimensions. */
export class Arena {
  /** @param {HTMLElement} element an empty box with a size; its size is followed */
  constructor(element) { this.element = element; }

  /** @param {{scenario: object|null, lift_m: number, source: string}} world as in the message "world" */
  setWorld(world) {}

  /**
   * Where the drones are now; moves on smoothly from where they were, and draws on at their trails.
   * @param {Pose[]} drones
   * @param {string[]|Object<number, string[]>} states ids of the mission's states, the same for all or by drone
   */
  setPoses(drones, states) {}

  /** @param {"orbit"|"follow"|"onboard"} view */
  setView(view) {}

  /** Whom "follow" and "onboard" follow. @param {number} id */
  select(id) {}

  /** Forget the trails. @param {number} [id] only this drone's */
  clearTrail(id) {}

  /**
   * Draw a whole trail at once, for a replay that jumps; the next `setPoses` goes on from its end.
   * @param {Pose[]} poses
   * @param {string[]} states
   * @param {number} [id]
   */
  setTrail(poses, states, id = 1) {}

  /** Let go of the graphics card. */
  dispose() {}
}
