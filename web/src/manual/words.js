/** Who flies, in words. */

/** @import {Live} from "../lib/messages.js" */

const BY_HAND = ["Manual", "Altitude", "Position", "Position Slow", "Acro", "Stabilized", "Rattitude"];

/**
 * @param {Live.DroneStatus|undefined} status of the drone
 * @param {{holder: string, yours: boolean, flying: boolean}} control
 * @returns {{look: "mine"|"theirs"|"auto"|"lost", head: string, words: string}}
 */
export function whoFlies(status, control) {
  if (!status) return { look: "lost", head: "No drone", words: "start one: framerunner sim" };
  const link = status.link?.state;
  if (link === "lost") return { look: "lost", head: "Link lost", words: `last mode: ${status.mode}` };
  const off = status.armed ? "" : ", motors off";
  if (control.yours && control.flying) return { look: "mine", head: "Manual", words: `you fly${off}` };
  if (control.holder && control.flying) return { look: "theirs", head: "Manual", words: `${control.holder} flies${off}` };
  if (control.yours) return { look: "auto", head: "Automatic", words: `${doing(status)}; your sticks wait` };
  if (BY_HAND.includes(status.mode) && status.armed) {
    return { look: "theirs", head: "Manual", words: "somebody outside the monitor flies" };
  }
  const held = control.holder ? `; ${control.holder} has the sticks` : "";
  return { look: "auto", head: "Automatic", words: `${doing(status)}${held}` };
}

/** @param {Live.DroneStatus} status */
function doing(status) {
  const { mission } = status;
  if (status.armed && mission?.alive && mission.flying && !mission.paused) return `mission ${mission.state}`;
  const mode = status.mode ? status.mode.toLowerCase() : "no mode";
  const paused = mission?.alive && mission.paused ? `, mission ${mission.state} waits` : "";
  return status.armed ? `${mode}${paused}` : `${mode}, motors off`;
}

/**
 * Figures of the drone, as pairs of name and value.
 * @param {Live.DroneStatus|undefined} status
 * @param {Live.DronePose|null} pose
 */
export function figuresOf(status, pose) {
  /** @param {number|null|undefined} value @param {number} decimals @param {string} unit */
  const number = (value, decimals, unit) =>
    typeof value === "number" && Number.isFinite(value) ? `${value.toFixed(decimals)} ${unit}` : "–";
  const speed = pose?.v ? Math.hypot(...pose.v) : null;
  return {
    mode: status?.mode || "–",
    motors: status ? (status.armed ? "on" : "off") : "–",
    height: number(pose?.p?.[2], 1, "m"),
    speed: number(speed, 1, "m/s"),
    battery: number(status?.battery_percent, 0, "%"),
    link: status?.link?.state ?? "–",
  };
}
