/** A diagram with some superstates closed: drawn as plain states, with the transitions of what is in them. */

/** @typedef {import("../messages.js").Documents.Diagram} Diagram */

/** The states around a state, from the outermost to itself. @param {Map<string, string>} parents @param {string} id @returns {string[]} */
export function chainOf(parents, id) {
  const found = [];
  for (let at = id; at && parents.has(at); at = parents.get(at) ?? "") found.unshift(at);
  return found;
}

/**
 * @param {Diagram} diagram
 * @param {Set<string>} closed superstates
 * @returns {Diagram} the same one if nothing is closed
 */
export function fold(diagram, closed) {
  if (closed.size === 0) return diagram;
  const parents = new Map(diagram.nodes.map(({ id, parent }) => [id, parent]));
  const shown = new Map(diagram.nodes.map(({ id }) => [id, chainOf(parents, id).find((each) => closed.has(each)) ?? id]));
  /** @param {string} id */
  const at = (id) => shown.get(id) ?? id;
  const edges = diagram.edges.map((edge) => ({ ...edge, source: at(edge.source), target: edge.missing ? edge.target : at(edge.target) }));
  return {
    ...diagram,
    nodes: diagram.nodes.filter(({ id }) => shown.get(id) === id),
    edges: edges.filter(({ source, target }, index) => source !== target || diagram.edges[index].source === diagram.edges[index].target),
  };
}
