/** What the mouse does to the chart, as edits of the mission. */

/**
 * @typedef {import("./session.js").EditSession} EditSession
 * @typedef {import("../lib/diagram/diagram_view.js").Selection} Selection
 * @typedef {{span: import("../lib/messages.js").Documents.Span|null}} Written
 */

/**
 * Lead a transition to another state, or let it come from another one.
 * @param {EditSession} session
 * @param {string} id @param {"source"|"target"} end @param {string} to
 * @returns {Promise<Selection|"foreign"|null>} what is selected then; "foreign": it cannot be changed here; null: nothing was done
 */
export async function leadTransition(session, id, end, to) {
  const { nodes, edges } = session.diagram;
  const edge = edges.find((each) => each.id === id);
  if (!edge || to === edge[end]) return null;
  if (!edge.source_state) return "foreign";
  const transition = { state: edge.source_state, event: edge.event, index: edge.source_index };
  if (end === "target") {
    const isLed = await session.edit({ kind: "redirect_transition", transition, to: session.target(edge.source, to) });
    return isLed ? { kind: "transition", id } : null;
  }
  const source = nodes.find((node) => node.id === to)?.source;
  if (!source) return "foreign";
  const count = edge.event === "tick" ? edges.filter(({ source: from, event }) => from === to && event === "tick").length : 0;
  const isMoved = await session.edit({ kind: "set_source", transition, state: source, to: session.target(to, edge.target) });
  return isMoved ? { kind: "transition", id: `${to}/${edge.event}/${count}` } : null;
}

/**
 * Move a state into another superstate.
 * @param {EditSession} session
 * @param {string} moved @param {string} parent @param {{x: number, y: number}} place in the new superstate
 * @returns {Promise<Selection|null>} what is selected then; null: it was not moved
 */
export async function moveState(session, moved, parent, place) {
  const { nodes } = session.diagram;
  const source = (/** @type {string} */ id) => nodes.find((node) => node.id === id)?.source ?? "";
  if (!await session.edit({ kind: "move_state", state: source(moved), parent: source(parent) })) return null;
  const id = [parent, moved.split(".").at(-1)].filter(Boolean).join(".");
  session.place({ [id]: place }, true);
  return { kind: "state", id };
}

/**
 * What is written at an offset of the text; of the uses of a template, the one that is selected.
 * @param {EditSession["diagram"]} diagram
 * @param {number} offset
 * @param {string} selected id
 * @returns {Selection}
 */
export function writtenAt({ nodes, edges }, offset, selected) {
  const isAt = (/** @type {Written} */ { span }) => span !== null && span.start <= offset && offset <= span.end;
  /** @param {{id: string}[]} found */
  const kept = (found) => found.find(({ id }) => id === selected) ?? found.find(({ id }) => selected.startsWith(id.replace(/\/.*/, ""))) ?? found[0];
  const at = edges.filter(isAt);
  if (at.length > 0) return { kind: "transition", id: kept(at).id };
  const around = nodes.filter(isAt);
  const length = (/** @type {Written} */ { span }) => (span ? span.end - span.start : 0);
  const least = Math.min(...around.map(length));
  const inmost = around.filter((node) => length(node) === least);
  return inmost.length > 0 ? { kind: "state", id: kept(inmost).id } : { kind: "mission", id: "" };
}
