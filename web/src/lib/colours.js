/** Colours of states and gates: those of the pictures that a flight leaves, so that a trail looks the same everywhere. */

/** Paul Tol's "muted" scheme, which colour-blind people can tell apart, and three more beside it. */
export const STATE_COLOURS = [
  "#332288", "#ee7733", "#117733", "#cc6677", "#33bbee", "#999933",
  "#aa4499", "#44aa99", "#000000", "#ddaa33", "#777777", "#882255",
];

/** The pure colours of frames and decoys. @type {Record<string, string>} */
export const GATE_COLOURS = { red: "#ff0000", green: "#00ff00", blue: "#0000ff", cyan: "#00ffff", magenta: "#ff00ff" };

/**
 * The kind of a state: the last part of its id, "turning" of "red.turning".
 * @param {string} stateId
 */
export function kindOf(stateId) {
  return stateId.slice(stateId.lastIndexOf(".") + 1);
}

/**
 * The colour of a state. States of one kind have one colour; kinds are numbered as they first appear.
 * @param {string} stateId such as "red.turning"
 * @param {string[]} order kinds seen so far; a new one is added to it
 * @returns {string} "#rrggbb"
 */
export function stateColour(stateId, order) {
  const kind = kindOf(stateId);
  let number = order.indexOf(kind);
  if (number < 0) number = order.push(kind) - 1;
  return STATE_COLOURS[number % STATE_COLOURS.length];
}

/** Red, green and blue of "#rrggbb", 0..255. @param {string} colour */
export function channels(colour) {
  return [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
}
