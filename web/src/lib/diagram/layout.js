/** Where the diagram's states are drawn: what has a place keeps it, what is new gets a free one, level by level. */
import { arrange } from "./arrange.js";
import { freePlace, makeRoom } from "./free_place.js";
import { overlap } from "./geometry.js";

/**
 * @typedef {import("../messages.js").Documents.Diagram} Diagram
 * @typedef {import("./geometry.js").Point} Point
 * @typedef {import("./geometry.js").Box} Box
 * @typedef {import("./arrange.js").Join} Join
 * @typedef {{places: (id: string) => Point|undefined, boxes: Map<string, Box>, view: Box|null}} Before places: of
 *   a state within its superstate; boxes: as they were drawn last; view: the part of the drawing that is seen
 */

const LETTER = 7.2; // mean width of a letter
const LEAF = { width: 110, height: 44 };
const HEADER = 30; // of a superstate, with its name
const PADDING = 18;
const LABEL = { letter: 6, longest: 34, words: 84 };
const MOST_SINGLE = 8; // new states of a level that get a place one by one; more are arranged together

/** The room for a transition's label. @param {string} event @param {string} when */
const labelWidth = (event, when) => (event === "tick" ? (Math.min(when.length, LABEL.longest) + 3) * LABEL.letter : LABEL.words);

/** The width of a state's name. @param {string} text */
export const textWidth = (text) => Math.max(LEAF.width, Math.ceil(text.length * LETTER) + 34);

/**
 * Place all states.
 * @param {Diagram} diagram
 * @param {Before} before
 * @returns {Map<string, Box>} by id
 */
export function layOut(diagram, before) {
  const { children, parents, names } = family(diagram);
  const levels = joinsOfLevels(diagram, parents);
  /** @type {Map<string, Box>} */
  const boxes = new Map();
  /** @param {string} path */
  const measure = (path) => {
    const inner = children.get(path) ?? [];
    for (const child of inner) measure(child);
    const size = inner.length > 0 ? placeLevel(path, inner, levels.get(path) ?? [], boxes, before) : null;
    if (path === "") return;
    const width = textWidth(names.get(path) ?? "");
    boxes.set(path, size === null ? { x: 0, y: 0, width, height: LEAF.height } : {
      x: 0, y: 0, width: Math.max(width, size.width + 2 * PADDING), height: size.height + HEADER + PADDING,
    });
  };
  measure("");
  /** @param {string} path @param {number} x @param {number} y */
  const shift = (path, x, y) => {
    const box = boxes.get(path);
    if (box) {
      box.x += x;
      box.y += y;
      ({ x, y } = originOf(box));
    }
    for (const child of children.get(path) ?? []) shift(child, x, y);
  };
  shift("", PADDING, PADDING);
  return boxes;
}

/** @param {Diagram} diagram */
function family(diagram) {
  /** @type {Map<string, string[]>} */
  const children = new Map();
  /** @type {Map<string, string>} */
  const parents = new Map();
  /** @type {Map<string, string>} */
  const names = new Map();
  for (const { id: path, name, parent, template } of diagram.nodes) {
    parents.set(path, parent);
    names.set(path, template ? `${name} : ${template}` : name);
    const siblings = children.get(parent);
    if (siblings) siblings.push(path);
    else children.set(parent, [path]);
  }
  return { children, parents, names };
}

/** The transitions of each level, between its states. @param {Diagram} diagram @param {Map<string, string>} parents @returns {Map<string, Join[]>} */
function joinsOfLevels(diagram, parents) {
  /** @param {string} path */
  const chain = (path) => {
    const found = [];
    for (let at = path; at; at = parents.get(at) ?? "") found.unshift(at);
    return found;
  };
  /** @type {Map<string, Join[]>} */
  const levels = new Map();
  for (const { source, target, event, when, missing } of diagram.edges) {
    if (source === target || missing) continue;
    const from = chain(source), into = chain(target);
    let depth = 0;
    while (depth < from.length - 1 && depth < into.length - 1 && from[depth] === into[depth]) depth += 1;
    if (from[depth] === into[depth]) continue;
    const level = depth === 0 ? "" : from[depth - 1];
    const join = { from: from[depth], to: into[depth], width: labelWidth(event, when) };
    const joins = levels.get(level);
    if (joins) joins.push(join);
    else levels.set(level, [join]);
  }
  return levels;
}

/**
 * Place the states of one level.
 * @param {string} parent
 * @param {string[]} paths
 * @param {Join[]} joins
 * @param {Map<string, Box>} boxes with the states' sizes; their places are set
 * @param {Before} before
 * @returns {{width: number, height: number}} what they need
 */
function placeLevel(parent, paths, joins, boxes, before) {
  const level = new Map(paths.map((path) => [path, /** @type {Box} */ (boxes.get(path))]));
  const hasSuper = [...level.values()].some(({ height }) => height > LEAF.height);
  /** @type {string[]} */
  const fresh = [];
  /** @type {Map<string, Box>} */
  const placed = new Map();
  for (const [path, box] of level) {
    const point = before.places(path);
    if (point) {
      Object.assign(box, { x: point.x, y: point.y });
      placed.set(path, box);
    } else fresh.push(path);
  }
  for (const [path, box] of placed) {
    // One that comes back has its place again, unless that has been taken.
    const isBack = before.boxes.size > 0 && !before.boxes.has(path);
    if (!isBack || ![...placed].some(([other, its]) => other !== path && overlap(box, its) > 0)) continue;
    placed.delete(path);
    fresh.push(path);
  }
  makeRoom(placed, before.boxes);
  if (fresh.length === paths.length || fresh.length > MOST_SINGLE) {
    const below = Math.max(0, ...[...placed.values()].map(({ y, height }) => y + height + 40));
    for (const [path, { x, y }] of arrange(fresh, joins.filter(({ from, to }) => fresh.includes(from) && fresh.includes(to)), boxes, hasSuper)) {
      Object.assign(/** @type {Box} */ (boxes.get(path)), { x, y: y + below });
    }
  } else {
    const outer = before.boxes.get(parent);
    const origin = outer ? originOf(outer) : { x: PADDING, y: PADDING };
    const view = before.view && { ...before.view, x: before.view.x - origin.x, y: before.view.y - origin.y };
    for (const path of fresh) {
      const box = /** @type {Box} */ (boxes.get(path));
      const near = joins.flatMap(({ from, to }) => (from === path ? [to] : to === path ? [from] : []))
        .flatMap((each) => placed.get(each) ?? []);
      Object.assign(box, freePlace({ width: box.width, height: box.height }, [...placed.values()], near, view, parent !== ""));
      placed.set(path, box);
    }
  }
  const all = [...level.values()];
  return { width: Math.max(...all.map(({ x, width }) => x + width)), height: Math.max(...all.map(({ y, height }) => y + height)) };
}

/** Where a superstate's own states begin. @param {Box} box @returns {Point} */
const originOf = (box) => ({ x: box.x + PADDING, y: box.y + HEADER });

/** The place of a state within its parent, as it is kept. @param {Box} box @param {Box|null|undefined} parent @returns {Point} */
export function placeWithin(box, parent) {
  const origin = parent ? originOf(parent) : { x: PADDING, y: PADDING };
  return { x: Math.max(0, Math.round(box.x - origin.x)), y: Math.max(0, Math.round(box.y - origin.y)) };
}

/**
 * States that were renamed in the text: one of a level is gone and another one is there in its place.
 * @param {Diagram} before
 * @param {Diagram} after
 * @returns {Map<string, string>} ids as they were, by the ids now, those of inner states included
 */
export function renamed(before, after) {
  const old = new Map(before.nodes.map(({ id, parent }) => [id, parent])), now = new Set(after.nodes.map(({ id }) => id));
  /** @type {Map<string, string[]>} */
  const gone = new Map();
  /** @type {Map<string, string[]>} */
  const come = new Map();
  /** @param {Map<string, string[]>} map @param {string} key @param {string} value */
  const add = (map, key, value) => map.set(key, [...(map.get(key) ?? []), value]);
  for (const [id, parent] of old) if (!now.has(id) && (parent === "" || now.has(parent))) add(gone, parent, id);
  for (const { id, parent } of after.nodes) if (!old.has(id) && (parent === "" || old.has(parent))) add(come, parent, id);
  /** @type {Map<string, string>} */
  const found = new Map();
  for (const [parent, ids] of come) {
    const left = gone.get(parent) ?? [];
    if (ids.length !== 1 || left.length !== 1) continue;
    for (const { id } of after.nodes) {
      if (id === ids[0] || id.startsWith(`${ids[0]}.`)) found.set(id, left[0] + id.slice(ids[0].length));
    }
  }
  return found;
}
