/** Poles and walls of a scenario as boxes that stand on the floor. */

/**
 * What is drawn of a scenario: a part of `Scenario` in scenarios/models.py. Older simulators' have less.
 * @typedef {object} Scenario
 * @property {{length_x_m: number, width_y_m: number, height_m: number}} arena
 * @property {{x_m: number, y_m: number, edge_m: number, top_m: number}} base
 * @property {Frame[]} frames
 * @property {Frame[]} [decoys]
 * @property {Pole[]} [poles]
 * @property {Wall[]} [walls]
 * @property {Camera} camera
 * @property {{sun_direction_arena: number[], ambient: number}} light
 * @property {Goal[]} [goals]
 */

/**
 * @typedef {object} Frame
 * @property {string} colour
 * @property {number} x_m its centre
 * @property {number} y_m
 * @property {number} z_m
 * @property {number} yaw_rad of its normal
 * @property {number} outer_width_m
 * @property {number} outer_height_m
 * @property {number} bar_m
 * @property {number|null} [depth_m] along its normal; none: bar_m
 */

/**
 * @typedef {{x_m: number, y_m: number, edge_m: number, height_m?: number|null}} Pole
 * @typedef {{offset_m: number, width_m: number}} Doorway
 * @typedef {object} Wall
 * @property {number} x_m where it begins
 * @property {number} y_m
 * @property {number} end_x_m
 * @property {number} end_y_m
 * @property {number} thickness_m
 * @property {number|null} [height_m] null: up to the ceiling
 * @property {Doorway|null} [doorway]
 */

/**
 * @typedef {object} Camera
 * @property {number} width_px
 * @property {number} height_px
 * @property {number} horizontal_fov_rad
 * @property {number[]} position_flu_m
 */

/**
 * @typedef {object} Goal with `hold_m` or `face`
 * @property {number[]|null} [hold_m] a place
 * @property {number} radius_m
 * @property {string|null} [face] colour of a frame
 * @property {number[]} distance_m from it, least and greatest
 */

/** @typedef {{centre: number[], half: number[], yaw: number}} Solid a box; metres and radians, arena axes */

/** As the simulated camera paints them. */
export const PRISM = [120, 70, 180];

/**
 * The boxes; a wall with a doorway has one on each side of it.
 * @param {Scenario} scenario
 * @param {number} lift_m how much higher the ceiling and all tops are
 * @returns {Solid[]}
 */
export function prismsOf(scenario, lift_m = 0) {
  /**
   * @param {number} x @param {number} y @param {number} yaw @param {number} length_m @param {number} width_m
   * @param {number|null|undefined} own_m its own height
   */
  const standing = (x, y, yaw, length_m, width_m, own_m) => {
    const height_m = (own_m ?? scenario.arena.height_m) + lift_m;
    return { centre: [x, y, height_m / 2], half: [length_m / 2, width_m / 2, height_m / 2], yaw };
  };
  // Scenarios of older simulators have neither.
  const poles = (scenario.poles ?? []).map(({ x_m, y_m, edge_m, height_m }) => standing(x_m, y_m, 0, edge_m, edge_m, height_m));
  const walls = (scenario.walls ?? []).flatMap((wall) => {
    const [dx, dy] = [wall.end_x_m - wall.x_m, wall.end_y_m - wall.y_m];
    const length_m = Math.hypot(dx, dy);
    return partsOf(wall, length_m).map(([from_m, to_m]) => {
      const share = (from_m + to_m) / 2 / length_m;
      return standing(wall.x_m + share * dx, wall.y_m + share * dy, Math.atan2(dy, dx), to_m - from_m, wall.thickness_m, wall.height_m);
    });
  });
  return [...poles, ...walls];
}

/** Frames and decoys. @param {Scenario} scenario */
export function allGates(scenario) {
  return [...scenario.frames, ...(scenario.decoys ?? [])];
}

/** From where to where along a wall there is wall. @param {Wall} wall @param {number} length_m */
function partsOf({ doorway }, length_m) {
  if (!doorway) return [[0, length_m]];
  const [from_m, to_m] = [doorway.offset_m - doorway.width_m / 2, doorway.offset_m + doorway.width_m / 2];
  return [[0, from_m], [to_m, length_m]].filter(([begin_m, end_m]) => end_m - begin_m > 0.001);
}
