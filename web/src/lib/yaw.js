/** Angle of a heading to the left of the x axis, radians. @param {number[]} q quaternion w, x, y, z @returns {number} */
export function yawOf([w, x, y, z]) {
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}
