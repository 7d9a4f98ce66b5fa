/** What a mission's navigator knows, drawn in the arena: gates as it estimates them, and the path that it plans. */
import { GATE_COLOURS } from "../colours.js";

/**
 * @typedef {object} MappedFrame as in the live channel's message "map"
 * @property {string} colour
 * @property {number[]} p centre, metres, arena axes
 * @property {number} yaw of its normal
 * @property {number[]|null} std standard deviations along x, y, z, metres; null: not known
 * @property {boolean} certain known well enough to fly through
 * @property {number[]|null} [size] outer width and height, metres; not told by older apps
 */

/**
 * @typedef {object} NavigationMap
 * @property {string} goal what the navigator does
 * @property {MappedFrame[]} frames
 * @property {number[][]} path
 * @property {EstimatedPlace|null} [place] where it takes the drone to be; null: where its vehicle reports
 */

/** @typedef {{p: number[], std: number[]}} EstimatedPlace metres, arena axes */

export const SIGMAS = 2; // how many standard deviations an ellipse reaches
export const PATH_COLOUR = "#b3007d";
export const PLACE_COLOUR = "#1a7fd6"; // of the drone's place as its app has estimated it
export const TRUTH_COLOUR = "#101418"; // of where a simulated drone truly was
const OTHER_COLOUR = "#7a7a7a"; // of a gate that is no part of the task
const OUTER_M = [0.42, 0.22]; // width and height of a gate of which nobody tells them
const AROUND = 1.35; // an outline is drawn so much larger, around the gate where the estimate is right
export const NORMAL_M = 0.3; // how far the line along its normal goes, to each side
const [LEAST_M, MOST_M] = [0.005, 4]; // half axes of an ellipsoid

/**
 * The map of a message "map"; null if it is empty, which it is where there is no navigator.
 * @template {NavigationMap} Message
 * @param {Message} message
 * @returns {Message|null}
 */
export function mapIn(message) {
  const isEmpty = message.frames.length === 0 && message.path.length === 0 && message.goal === "";
  return isEmpty && !message.place ? null : message;
}

/** The colour in which a frame is drawn. @param {string} colour */
export function colourOf(colour) {
  return Object.hasOwn(GATE_COLOURS, colour) ? GATE_COLOURS[colour] : OTHER_COLOUR;
}

/**
 * Half the width and the height of a gate's outline, metres.
 * @param {MappedFrame} gate
 * @param {import("./obstacles.js").Scenario|null} scenario
 */
export function halfSizeOf(gate, scenario) {
  const known = scenario?.frames.find((each) => each.colour === gate.colour);
  const [width, height] = gate.size ?? (known ? [known.outer_width_m, known.outer_height_m] : OUTER_M);
  return [(AROUND * width) / 2, (height + (AROUND - 1) * width) / 2];
}

/**
 * Half axes of the ellipsoid of a place along x, y, z, metres; null if not known.
 * @param {{std: number[]|null}} place
 */
export function halfAxesOf({ std }) {
  return std ? std.map((sigma) => Math.min(MOST_M, Math.max(LEAST_M, SIGMAS * sigma))) : null;
}
