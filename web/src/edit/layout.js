/** Where the diagram's states are drawn: kept places, and automatic ones for the rest, level by level. */
import dagre from "@dagrejs/dagre";

/**
 * @typedef {import("./session.js").Diagram} Diagram
 * @typedef {import("./session.js").Point} Point
 * @typedef {{x: number, y: number, width: number, height: number}} Box in the drawing's units, from its upper left
 * @typedef {{from: string, to: string, width: number}} Join a transition between two states of a level, with its label's width
 */

const LETTER = 7.2; // mean width of a letter
const LEAF = { width: 110, height: 44 };
const HEADER = 30; // of a superstate, with its name
const PADDING = 18;
const LABEL = { letter: 6, height: 16, longest: 34, words: 84 };
const GAP = { nodesep: 36, ranksep: 34, edgesep: 16 };
const ROW_GAP = 56;
const MOST_FOR_DAGRE = 80; // states and transitions of a level: it takes long if there are many
const MOST_KEPT = 100;
/** @type {Map<string, Map<string, Point>>} automatic places that were found before: most edits leave them as they are */
const arranged = new Map();

/** The room for a transition's label. @param {string} event @param {string} when */
const labelWidth = (event, when) => (event === "tick" ? (Math.min(when.length, LABEL.longest) + 3) * LABEL.letter : LABEL.words);

/** The width of a state's name. @param {string} text */
const textWidth = (text) => Math.max(LEAF.width, Math.ceil(text.length * LETTER) + 34);

/**
 * Place all states.
 * @param {Diagram} diagram
 * @param {Object<string, Point>} kept places within the parent, by id of the state
 * @returns {Map<string, Box>} by id
 */
export function layOut(diagram, kept) {
  /** @type {Map<string, string[]>} */
  const children = new Map();
  const parents = new Map();
  const names = new Map();
  for (const { id: path, name, parent, template } of diagram.nodes) {
    parents.set(path, parent);
    names.set(path, template ? `${name} : ${template}` : name);
    const siblings = children.get(parent);
    if (siblings) siblings.push(path);
    else children.set(parent, [path]);
  }
  const chain = (path) => {
    const found = [];
    for (let at = path; at; at = parents.get(at)) found.unshift(at);
    return found;
  };
  /** @type {Map<string, Join[]>} the transitions of each level, between its states */
  const levels = new Map();
  for (const { source, target, event, when } of diagram.edges) {
    if (source === target) continue;
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
  /** @type {Map<string, Box>} */
  const boxes = new Map();
  const measure = (path) => {
    const inner = children.get(path) ?? [];
    for (const child of inner) measure(child);
    const size = inner.length > 0 ? arrange(inner, levels.get(path) ?? [], boxes, kept) : null;
    if (path === "") return;
    const width = textWidth(names.get(path));
    boxes.set(path, size === null ? { x: 0, y: 0, width, height: LEAF.height } : {
      x: 0, y: 0, width: Math.max(width, size.width + 2 * PADDING), height: size.height + HEADER + PADDING,
    });
  };
  measure("");
  const shift = (path, x, y) => {
    const box = boxes.get(path);
    if (box) {
      box.x += x;
      box.y += y;
      [x, y] = [box.x + PADDING, box.y + HEADER];
    }
    for (const child of children.get(path) ?? []) shift(child, x, y);
  };
  shift("", PADDING, PADDING);
  return boxes;
}

/**
 * Place the states of one level.
 * @param {string[]} paths
 * @param {Join[]} joins
 * @param {Map<string, Box>} boxes with the states' sizes; their places are set
 * @param {Object<string, Point>} kept
 * @returns {{width: number, height: number}} what they need
 */
function arrange(paths, joins, boxes, kept) {
  const isPlaced = (path) => kept[path] !== undefined;
  if (!paths.every(isPlaced)) {
    const key = JSON.stringify([paths.map((path) => [path, boxes.get(path).width, boxes.get(path).height]), joins]);
    const found = arranged.get(key) ?? (paths.length + joins.length > MOST_FOR_DAGRE ? inRows : byDagre)(paths, joins, boxes);
    arranged.delete(key); // what is used last is kept longest
    arranged.set(key, found);
    if (arranged.size > MOST_KEPT) arranged.delete(arranged.keys().next().value ?? "");
    for (const [path, point] of found) Object.assign(boxes.get(path), point);
  }
  let width = 0, height = 0;
  for (const path of paths) {
    const box = boxes.get(path);
    if (isPlaced(path)) Object.assign(box, { x: kept[path].x, y: kept[path].y });
    width = Math.max(width, box.x + box.width);
    height = Math.max(height, box.y + box.height);
  }
  return { width, height };
}

/**
 * Automatic places of the states of one level, by dagre.
 * @param {string[]} paths
 * @param {Join[]} joins
 * @param {Map<string, Box>} boxes
 * @returns {Map<string, Point>}
 */
function byDagre(paths, joins, boxes) {
  const graph = new dagre.graphlib.Graph();
  // Superstates follow each other to the right, so that a wide page is used.
  const hasSuper = paths.some((path) => boxes.get(path).height > LEAF.height);
  graph.setGraph({ rankdir: hasSuper ? "LR" : "TB", ranker: "network-simplex", ...GAP });
  graph.setDefaultEdgeLabel(() => ({}));
  for (const path of paths) graph.setNode(path, { ...boxes.get(path) });
  for (const { from, to, width } of joins) graph.setEdge(from, to, { width, height: LABEL.height, labelpos: "c" });
  dagre.layout(graph);
  return new Map(paths.map((path) => {
    const { x, y, width, height } = graph.node(path);
    return [path, { x: x - width / 2, y: y - height / 2 }];
  }));
}

/**
 * Automatic places of many states, in linear time: rows by distance from the first state, from above.
 * @param {string[]} paths
 * @param {Join[]} joins
 * @param {Map<string, Box>} boxes
 * @returns {Map<string, Point>}
 */
function inRows(paths, joins, boxes) {
  /** @type {Map<string, string[]>} */
  const next = new Map(paths.map((path) => [path, []]));
  for (const { from, to } of joins) next.get(from)?.push(to);
  const order = [], seen = new Set();
  for (const start of paths) { // those that the first one does not reach follow
    const queue = seen.has(start) ? [] : [start];
    seen.add(start);
    for (let head = 0; head < queue.length; head += 1) {
      order.push(queue[head]);
      for (const to of next.get(queue[head]) ?? []) {
        if (!seen.has(to)) queue.push(to);
        seen.add(to);
      }
    }
  }
  const columns = Math.ceil(Math.sqrt(paths.length));
  const places = new Map();
  for (let row = 0, y = 0; row < order.length; row += columns) {
    let x = 0, height = 0;
    for (const path of order.slice(row, row + columns)) {
      const box = boxes.get(path);
      places.set(path, { x, y });
      x += box.width + GAP.nodesep;
      height = Math.max(height, box.height);
    }
    y += height + ROW_GAP;
  }
  return places;
}

/** The place of a state within its parent, as it is kept. @param {Box} box @param {Box|null} parent @returns {Point} */
export function placeWithin(box, parent) {
  const origin = parent ? { x: parent.x + PADDING, y: parent.y + HEADER } : { x: PADDING, y: PADDING };
  return { x: Math.max(0, Math.round(box.x - origin.x)), y: Math.max(0, Math.round(box.y - origin.y)) };
}
