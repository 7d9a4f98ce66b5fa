/** Lines of transitions between the boxes of states. */

/**
 * @typedef {{x: number, y: number}} Point
 * @typedef {{x: number, y: number, width: number, height: number}} Box in the drawing's units, from its upper left
 * @typedef {Point[]} Curve three or four control points of a Bézier curve
 */

const BEND = 26; // of a line beside another between the same states
const LOOP = 26;

/** @param {Box} box @returns {Point} */
export const centre = ({ x, y, width, height }) => ({ x: x + width / 2, y: y + height / 2 });

/** Whether a point is in a box. @param {Box} box @param {Point} point */
export function contains(box, { x, y }) {
  return x >= box.x && x <= box.x + box.width && y >= box.y && y <= box.y + box.height;
}

/** The area that two boxes share, the first one enlarged by a margin. @param {Box} a @param {Box} b @param {number} [margin] */
export function overlap(a, b, margin = 0) {
  const width = Math.min(a.x + a.width + margin, b.x + b.width) - Math.max(a.x - margin, b.x);
  const height = Math.min(a.y + a.height + margin, b.y + b.height) - Math.max(a.y - margin, b.y);
  return width > 0 && height > 0 ? width * height : 0;
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
 * @param {number} lane 0 for a straight one; others are bent aside
 * @returns {Curve}
 */
export function line(from, to, lane) {
  if (isLoop(from, to)) return loop(from, to, lane);
  const a = centre(from), b = centre(to);
  const length = Math.hypot(b.x - a.x, b.y - a.y) || 1;
  const side = { x: -(b.y - a.y) / length, y: (b.x - a.x) / length };
  const out = border(from, b), into = border(to, a); // the middle between the boxes, however large they are
  const middle = { x: (out.x + into.x) / 2 + side.x * lane * BEND, y: (out.y + into.y) / 2 + side.y * lane * BEND };
  const start = border(from, middle), end = border(to, middle);
  return [start, { x: 2 * middle.x - (start.x + end.x) / 2, y: 2 * middle.y - (start.y + end.y) / 2 }, end];
}

/** Whether a line leads back to its state, or to one in or around it. @param {Box} from @param {Box} to */
export const isLoop = (from, to) => from === to || isWithin(to, from) || isWithin(from, to);

/** A line that leaves a box on its right, to itself or to a state in or around it. @param {Box} from @param {Box} to @param {number} lane @returns {Curve} */
function loop(from, to, lane) {
  const out = LOOP * (1 + Math.abs(lane));
  const start = { x: from.x + from.width, y: from.y + Math.min(from.height * 0.3, 24) };
  const end = from === to ? { x: start.x, y: from.y + from.height * 0.75 } : border(to, { x: start.x + out, y: centre(to).y });
  const right = Math.max(start.x, end.x) + out;
  return [start, { x: right, y: start.y }, { x: right, y: end.y }, end];
}

/** A point of a curve. @param {Curve} curve @param {number} t from 0, its start, to 1 @returns {Point} */
export function pointOn(curve, t) {
  const s = 1 - t;
  const [a, b, c, d] = curve;
  if (!d) return { x: s * s * a.x + 2 * s * t * b.x + t * t * c.x, y: s * s * a.y + 2 * s * t * b.y + t * t * c.y };
  const [p, q, r, u] = [s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t];
  return { x: p * a.x + q * b.x + r * c.x + u * d.x, y: p * a.y + q * b.y + r * c.y + u * d.y };
}

/** A curve as the path of SVG. @param {Curve} curve */
export function pathOf(curve) {
  const [start, ...others] = curve.map(({ x, y }) => `${x.toFixed(1)},${y.toFixed(1)}`);
  return `M${start}${curve.length === 3 ? "Q" : "C"}${others.join(" ")}`;
}
