/** Which way the lines of transitions take, and where their labels stand: beside the states and each other, if there is room. */
import { contains, isLoop, line, overlap, pointOn } from "./geometry.js";

/**
 * @typedef {import("./geometry.js").Box} Box
 * @typedef {import("./geometry.js").Curve} Curve
 * @typedef {import("./geometry.js").Point} Point
 * @typedef {{id: string, from: string, to: string, words: string}} Route from, to: keys of boxes
 */

const CELL = 160;
const ALONG = [0.5, 0.4, 0.6, 0.3, 0.7, 0.22, 0.78];
const ASIDE = [0, -9, 9, -18, 18];
const TRIED_LANES = [0, 1, -1, 2, -2, 3, -3.5];
const LABEL = { letter: 6.1, above: 11, height: 15, margin: 2 };
const COST = { along: 60, aside: 0.8, onBox: 3, crossed: 1, bent: 0.22, struck: 6 };
const MANY = 150; // transitions; with more of them, there is no room to look for
const QUICK = { along: [0.5, 0.35, 0.65], aside: [0], lanes: [0] };
const THOROUGH = { along: ALONG, aside: ASIDE, lanes: TRIED_LANES };
const SAMPLES = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];

/** Boxes by place, so that those at a point are found without looking at all of them. */
class Index {
  /** @type {Map<number, {box: Box, key: string}[]>} */
  #cells = new Map();

  /** @param {Box} box @param {string} key */
  add(box, key) {
    const entry = { box, key };
    this.#each(box, (cell) => {
      const found = this.#cells.get(cell);
      if (found) found.push(entry);
      else this.#cells.set(cell, [entry]);
    });
  }

  /** @param {Box} box @param {(cell: number) => void} act */
  #each({ x, y, width, height }, act) {
    for (let row = Math.floor(y / CELL); row <= Math.floor((y + height) / CELL); row += 1) {
      for (let column = Math.floor(x / CELL); column <= Math.floor((x + width) / CELL); column += 1) act(row * 4096 + column);
    }
  }

  /** What may be at a point. @param {Point} point */
  at({ x, y }) {
    return this.#cells.get(Math.floor(y / CELL) * 4096 + Math.floor(x / CELL)) ?? [];
  }

  /** The area of a box that others cover. @param {Box} box @param {(key: string) => boolean} counts */
  covered(box, counts) {
    let area = 0;
    this.#each(box, (cell) => {
      for (const { box: other, key } of this.#cells.get(cell) ?? []) if (counts(key)) area += overlap(box, other);
    });
    return area;
  }
}

export class Router {
  #boxes;
  #tries;
  #states = new Index();
  #labels = new Index();
  #passing = new Index();
  /** @type {Map<string, Set<number>>} bends that are taken, by pair of states */
  #lanes = new Map();

  /**
   * @param {Map<string, Box>} boxes of states, and of what stands for missing ones
   * @param {Set<string>} superstates
   * @param {number} count of transitions
   */
  constructor(boxes, superstates, count) {
    this.#boxes = boxes;
    this.#tries = count > MANY ? QUICK : THOROUGH;
    for (const [id, box] of boxes) {
      this.#states.add(box, id);
      if (superstates.has(id)) this.#states.add({ ...box, width: Math.min(box.width, 130), height: 26 }, ""); // its name
    }
  }

  /** Whether a state is in the way of a transition: not those that are around its ends. @param {Route} route @returns {(key: string) => boolean} */
  #isInTheWay({ from, to }) {
    /** @param {string} outer @param {string} inner */
    const isAround = (outer, inner) => outer.length < inner.length && inner.startsWith(`${outer}.`);
    return (key) => key === "" || !(isAround(key, from) || isAround(key, to));
  }

  /**
   * How far a line is bent aside.
   * @param {Route} route
   * @param {number} usual if nothing is in the way
   */
  lane(route, usual) {
    const from = /** @type {Box} */ (this.#boxes.get(route.from)), to = /** @type {Box} */ (this.#boxes.get(route.to));
    if (isLoop(from, to) || this.#tries.lanes.length === 1) return usual;
    const pair = [route.from, route.to].sort().join(" ");
    const sign = route.from < route.to ? 1 : -1; // the other direction bends to the other side
    const taken = this.#lanes.get(pair) ?? new Set();
    this.#lanes.set(pair, taken);
    const isInTheWay = this.#isInTheWay(route);
    let best = usual, least = Infinity;
    for (const more of this.#tries.lanes) {
      const lane = usual + more;
      if (taken.has(lane * sign)) continue;
      const cost = COST.bent * Math.abs(more) + COST.crossed * this.#crossed(line(from, to, lane), route, isInTheWay);
      if (cost < least) [best, least] = [lane, cost];
      if (cost === 0) break;
    }
    taken.add(best * sign);
    return best;
  }

  /** How many states a line passes. @param {Curve} curve @param {Route} route @param {(key: string) => boolean} isInTheWay */
  #crossed(curve, route, isInTheWay) {
    const crossed = new Set();
    for (const t of SAMPLES) {
      const point = pointOn(curve, t);
      for (const { box, key } of this.#states.at(point)) {
        if (key !== route.from && key !== route.to && key !== "" && contains(box, point) && isInTheWay(key)) crossed.add(key);
      }
    }
    return crossed.size;
  }

  /** Note where a line passes, so that no other one's label is put there. @param {Curve} curve @param {string} id of the transition */
  pass(curve, id) {
    if (this.#tries.lanes.length === 1) return;
    for (let t = 0.04; t < 1; t += 0.04) {
      const { x, y } = pointOn(curve, t);
      this.#passing.add({ x: x - 1, y: y - 1, width: 2, height: 2 }, id);
    }
  }

  /**
   * Where the label of a line stands: the middle of its foot.
   * @param {Curve} curve
   * @param {Route} route
   * @returns {Point}
   */
  label(curve, route) {
    const isInTheWay = this.#isInTheWay(route);
    const all = () => true;
    const width = route.words.length * LABEL.letter + 2 * LABEL.margin;
    let best = pointOn(curve, 0.5), least = Infinity;
    for (const t of this.#tries.along) {
      const point = pointOn(curve, t);
      for (const dy of this.#tries.aside) {
        let cost = COST.along * Math.abs(t - 0.5) + COST.aside * Math.abs(dy);
        if (cost >= least) continue;
        const box = labelBox({ x: point.x, y: point.y + dy }, width);
        cost += this.#labels.covered(box, all);
        if (cost < least) cost += COST.struck * this.#passing.covered(box, (id) => id !== route.id);
        if (cost < least) cost += COST.onBox * this.#states.covered(box, isInTheWay);
        if (cost < least) [best, least] = [{ x: point.x, y: point.y + dy }, cost];
      }
    }
    this.#labels.add(labelBox(best, width), route.id);
    return best;
  }
}

/** @param {Point} foot @param {number} width @returns {Box} */
const labelBox = ({ x, y }, width) => ({ x: x - width / 2, y: y - LABEL.above, width, height: LABEL.height });
