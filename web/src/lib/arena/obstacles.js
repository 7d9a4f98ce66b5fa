/** Poles and walls of a scenario as boxes that stand on the floor. */

/** As the simulated camera paints them. */
export const PRISM = [120, 70, 180];

/**
 * The boxes; a wall with a doorway has one on each side of it.
 * @param {object} scenario
 * @param {number} lift_m how much higher the ceiling and all tops are
 * @returns {{centre: number[], half: number[], yaw: number}[]} metres and radians, arena axes
 */
export function prismsOf(scenario, lift_m = 0) {
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

/** Frames and decoys. */
export function allFrames(scenario) {
  return [...scenario.frames, ...(scenario.decoys ?? [])];
}

/** From where to where along a wall there is wall. */
function partsOf({ doorway }, length_m) {
  if (!doorway) return [[0, length_m]];
  const [from_m, to_m] = [doorway.offset_m - doorway.width_m / 2, doorway.offset_m + doorway.width_m / 2];
  return [[0, from_m], [to_m, length_m]].filter(([begin_m, end_m]) => end_m - begin_m > 0.001);
}
