/** Automatic places of the states of one level: by dagre, or in rows if there are many. */
import dagre from "@dagrejs/dagre";

/**
 * @typedef {import("./geometry.js").Point} Point
 * @typedef {import("./geometry.js").Box} Box
 * @typedef {{from: string, to: string, width: number}} Join a transition between two states of a level, with its label's width
 */

const LABEL_HEIGHT = 16;
const GAP = { nodesep: 36, ranksep: 34, edgesep: 16 };
const ROW_GAP = 56;
const MOST_FOR_DAGRE = 80; // states and transitions of a level: it takes long if there are many
const MOST_KEPT = 100;
/** @type {Map<string, Map<string, Point>>} automatic places that were found before */
const arranged = new Map();

/**
 * Places of the states of one level, within their superstate.
 * @param {string[]} paths
 * @param {Join[]} joins
 * @param {Map<string, Box>} boxes with the states' sizes
 * @param {boolean} hasSuper whether there is a superstate
 * @returns {Map<string, Point>}
 */
export function arrange(paths, joins, boxes, hasSuper) {
  const sizes = paths.map((path) => [path, boxes.get(path)?.width, boxes.get(path)?.height]);
  const key = JSON.stringify([sizes, joins]);
  const found = arranged.get(key) ?? (paths.length + joins.length > MOST_FOR_DAGRE ? inRows(paths, joins, boxes) : byDagre(paths, joins, boxes, hasSuper));
  arranged.delete(key); // what is used last is kept longest
  arranged.set(key, found);
  if (arranged.size > MOST_KEPT) arranged.delete(arranged.keys().next().value ?? "");
  return found;
}

/** @param {string[]} paths @param {Join[]} joins @param {Map<string, Box>} boxes @param {boolean} hasSuper @returns {Map<string, Point>} */
function byDagre(paths, joins, boxes, hasSuper) {
  const graph = new dagre.graphlib.Graph();
  // Superstates follow each other to the right, so that a wide page is used.
  graph.setGraph({ rankdir: hasSuper ? "LR" : "TB", ranker: "network-simplex", ...GAP });
  graph.setDefaultEdgeLabel(() => ({}));
  for (const path of paths) graph.setNode(path, { ...boxes.get(path) });
  for (const { from, to, width } of joins) graph.setEdge(from, to, { width, height: LABEL_HEIGHT, labelpos: "c" });
  dagre.layout(graph);
  return new Map(paths.map((path) => {
    const { x, y, width, height } = graph.node(path);
    return [path, { x: x - width / 2, y: y - height / 2 }];
  }));
}

/**
 * In linear time: rows by distance from the first state, from above.
 * @param {string[]} paths @param {Join[]} joins @param {Map<string, Box>} boxes @returns {Map<string, Point>}
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
      const box = /** @type {Box} */ (boxes.get(path));
      places.set(path, { x, y });
      x += box.width + GAP.nodesep;
      height = Math.max(height, box.height);
    }
    y += height + ROW_GAP;
  }
  return places;
}
