/** Lines of transitions between the boxes of states. */

/**
 * @typedef {import("./layout.js").Box} Box
 * @typedef {{x: number, y: number}} Point
 * @typedef {{path: string, label: Point}} Line path: of SVG
 */

const BEND = 26; // of a line beside another between the same states
const LOOP = 26;

/** @param {Box} box @returns {Point} */
export const centre = ({ x, y, width, height }) => ({ x: x + width / 2, y: y + height / 2 });

/** Whether a point is in a box. @param {Box} box @param {Point} point */
export function contains(box, { x, y }) {
  return x >= box.x && x <= box.x + box.width && y >= box.y && y <= box.y + box.height;
}

/** Where the line from a box's centre to a point leaves the box. @param {Box} box @param {Point} towards @returns {Point} */
function border(box, towards) {
  const { x, y } = centre(box);
  const dx = towards.x - x, dy = towards.y - y;
  if (dx === 0 && dy === 0) return { x, y: y + box.height / 2 };
  const share = Math.min(
    dx === 0 ? Infinity : box.width / 2 / Math.abs(dx), dy === 0 ? Infinity : box.height / 2 / Math.abs(dy));
  return { x: x + share * dx, y: y + share * dy };
}

/** Whether a box lies wholly within another. @param {Box} inner @param {Box} outer */
function isWithin(inner, outer) {
  return inner !== outer && contains(outer, inner)
    && contains(outer, { x: inner.x + inner.width, y: inner.y + inner.height });
}

/**
 * The line of a transition.
 * @param {Box} from
 * @param {Box} to
 * @param {number} lane 0 for the only line between these states; others are bent aside
 * @returns {Line}
 */
export function line(from, to, lane) {
  if (from === to || isWithin(to, from) || isWithin(from, to)) return loop(from, to, lane);
  const a = centre(from), b = centre(to);
  const length = Math.hypot(b.x - a.x, b.y - a.y) || 1;
  const side = { x: -(b.y - a.y) / length, y: (b.x - a.x) / length };
  const out = border(from, b), into = border(to, a); // the middle between the boxes, however large they are
  const middle = { x: (out.x + into.x) / 2 + side.x * lane * BEND, y: (out.y + into.y) / 2 + side.y * lane * BEND };
  const start = border(from, middle), end = border(to, middle);
  const bent = { x: 2 * middle.x - (start.x + end.x) / 2, y: 2 * middle.y - (start.y + end.y) / 2 };
  return {
    path: `M${start.x.toFixed(1)},${start.y.toFixed(1)}Q${bent.x.toFixed(1)},${bent.y.toFixed(1)} ${end.x.toFixed(1)},${end.y.toFixed(1)}`,
    label: middle,
  };
}

/** A line that leaves a box on its right, to itself or to a state in or around it. @returns {Line} */
function loop(from, to, lane) {
  const out = LOOP * (1 + Math.abs(lane));
  const start = { x: from.x + from.width, y: from.y + Math.min(from.height * 0.3, 24) };
  const end = from === to ? { x: start.x, y: from.y + from.height * 0.75 } : border(to, { x: start.x + out, y: centre(to).y });
  const right = Math.max(start.x, end.x) + out;
  return {
    path: `M${start.x},${start.y}C${right},${start.y} ${right},${end.y} ${end.x},${end.y}`,
    label: { x: right - out / 4, y: (start.y + end.y) / 2 },
  };
}
