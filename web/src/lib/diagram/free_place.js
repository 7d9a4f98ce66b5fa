/** Free places for new states among those that stay where they are, and room for those that grow. */
import { centre, contains, overlap } from "./geometry.js";

/** @typedef {import("./geometry.js").Box} Box @typedef {import("./geometry.js").Point} Point */

const MARGIN = { beside: 30, pushed: 24 };
const STEP = { x: 46, y: 38 };
const RINGS = 9;
const COST = { outOfView: 900, growth: 1.5 };
const MOST_PUSHES = 1000;

/**
 * A free place for a box, near others and in view.
 * @param {{width: number, height: number}} size
 * @param {Box[]} others that keep their places
 * @param {Box[]} near those of them that it belongs to
 * @param {Box|null} view what is seen
 * @param {boolean} isInner whether it is in a superstate, which shall not grow without need
 * @returns {Point}
 */
export function freePlace(size, others, near, view, isInner) {
  const right = Math.max(0, ...others.map(({ x, width }) => x + width));
  const bottom = Math.max(0, ...others.map(({ y, height }) => y + height));
  const anchor = anchorOf(size, others, near, view, { right, bottom });
  let best = { x: 0, y: bottom + (others.length > 0 ? MARGIN.beside + 10 : 0) }, least = Infinity;
  for (let row = -RINGS; row <= RINGS; row += 1) {
    for (let column = -RINGS; column <= RINGS; column += 1) {
      const box = { x: Math.round(anchor.x + column * STEP.x), y: Math.round(anchor.y + row * STEP.y), ...size };
      if (box.x < 0 || box.y < 0) continue;
      // Below is better than beside, and beside better than above: a chart is read downwards.
      let cost = Math.hypot(box.x - anchor.x, (box.y - anchor.y) * (row < 0 ? 1.3 : 1));
      if (isInner) cost += COST.growth * (Math.max(0, box.x + size.width - right) + Math.max(0, box.y + size.height - bottom));
      const isSeen = !view || (contains(view, box) && contains(view, { x: box.x + size.width, y: box.y + size.height }));
      if (!isSeen) cost += COST.outOfView;
      if (cost < least && others.every((other) => overlap(box, other, MARGIN.beside) === 0)) {
        best = { x: box.x, y: box.y };
        least = cost;
      }
    }
  }
  return best;
}

/**
 * Where a new box would be best: below those it belongs to, or in the middle of what is seen.
 * @param {{width: number, height: number}} size
 * @param {Box[]} others
 * @param {Box[]} near
 * @param {Box|null} view
 * @param {{right: number, bottom: number}} edges of all others
 * @returns {Point}
 */
function anchorOf(size, others, near, view, { right, bottom }) {
  if (near.length > 0) {
    const middles = near.map(centre);
    const x = middles.reduce((sum, each) => sum + each.x, 0) / near.length - size.width / 2;
    return { x: Math.max(0, x), y: Math.max(...near.map(({ y, height }) => y + height)) + 2 * MARGIN.beside };
  }
  const last = others.at(-1); // the one before it in the mission
  if (last && (!view || overlap(last, view) > 0)) return { x: last.x, y: last.y + last.height + 2 * MARGIN.beside };
  if (!view) return { x: 0, y: bottom + MARGIN.beside };
  /** @param {number} value @param {number} low @param {number} high */
  const clamp = (value, low, high) => Math.max(low, Math.min(value, high));
  return {
    x: clamp(view.x + (view.width - size.width) / 2, 0, right + MARGIN.beside),
    y: clamp(view.y + (view.height - size.height) / 2, 0, bottom + MARGIN.beside),
  };
}

/**
 * Push boxes to the right or downwards, so that those that have grown do not cover others.
 * @param {Map<string, Box>} boxes of one level; their places are changed
 * @param {Map<string, {width: number, height: number}>} before the sizes that they had
 */
export function makeRoom(boxes, before) {
  const queue = [];
  for (const [path, box] of boxes) {
    const size = before.get(path);
    if (size && (box.width > size.width || box.height > size.height)) queue.push({ path, old: { ...box, ...size } });
  }
  const pushed = new Set();
  for (let count = 0; queue.length > 0 && count < MOST_PUSHES; count += 1) {
    const { path, old } = /** @type {{path: string, old: Box}} */ (queue.shift());
    const box = /** @type {Box} */ (boxes.get(path));
    for (const [other, its] of boxes) {
      if (other === path || pushed.has(`${other} ${path}`) || overlap(box, its) === 0) continue;
      if (overlap(old, its) > 0) continue; // somebody wanted that
      const from = { ...its };
      const right = box.x + box.width + MARGIN.pushed - its.x, down = box.y + box.height + MARGIN.pushed - its.y;
      if (its.x >= old.x + old.width || right < down) its.x += right;
      else its.y += down;
      pushed.add(`${path} ${other}`); // they do not push each other for ever
      queue.push({ path: other, old: from });
    }
  }
}
