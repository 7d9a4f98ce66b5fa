/** Reads the diagram that an app sends: Mermaid's language as `framerunner mission show` writes it, and no more of it. */

/**
 * @typedef {import("../messages.js").Documents.Diagram} Diagram
 * @typedef {import("../messages.js").Documents.Node} StateNode
 */

const MOST_LINES = 4000; // a diagram comes from a drone, and is drawn at once
const AFTER_PAUSE = /^(also )?after a pause$/;

/** @param {string} text @returns {Diagram} throws an Error with the reason if it cannot be read */
export function readMermaid(text) {
  const [first, ...lines] = text.split("\n").map((line) => line.trim()).filter((line) => line && !line.startsWith("%%"));
  if (!/^stateDiagram(-v2)?$/.test(first ?? "")) throw new Error("it is no state diagram");
  if (lines.length > MOST_LINES) throw new Error("it is too long");
  /** @type {Map<string, StateNode>} */
  const nodes = new Map();
  const diagram = { name: "", initial: "", readable: true, nodes: /** @type {StateNode[]} */ ([]), edges: /** @type {import("../messages.js").Documents.Edge[]} */ ([]) };
  const superstates = new Set(lines.flatMap((line) => /^state ".*" as (\S+) \{$/.exec(line)?.[1] ?? []));
  /** @type {Map<string, number>} */
  const counts = new Map();
  const around = [""];
  /** @param {string} id @param {string} [name] @returns {StateNode} */
  const node = (id, name = id.split(".").at(-1) ?? id) => {
    const known = nodes.get(id);
    if (known) return known;
    const made = {
      id, name, parent: around.at(-1) ?? "", initial: "", final: false, finish: false, enter: [], during: [], exit: [],
      parameters: /** @type {[string, string][]} */ ([]), template: "", source: id, span: null, name_span: null,
    };
    nodes.set(id, made);
    return made;
  };
  /** @param {string} source @param {string} target @param {string} label */
  const join = (source, target, label) => {
    const [, , when = "", actions = ""] = /^(?:(\d+) )?(?:\[(.*)\])?(?: ?\/ (.*))?$/.exec(label) ?? ["", "", label];
    const event = AFTER_PAUSE.test(label) ? "resume" : label === "" && superstates.has(source) ? "done" : "tick";
    const order = counts.get(source) ?? 0;
    if (event === "tick") counts.set(source, order + 1);
    diagram.edges.push({
      id: `${source}/${event}/${order}/${diagram.edges.length}`, source, target, missing: false, event, order, when: event === "tick" ? when : "",
      actions: actions ? [actions] : [], source_state: source, source_index: order, span: null, when_span: null, to_span: null,
    });
  };
  for (const line of lines) {
    const [, from, to, label = ""] = /^(\S+) --> (\S+)(?: : (.*))?$/.exec(line) ?? [];
    const [, name, id, opens] = /^state "(.*)" as (\S+?)( \{)?$/.exec(line) ?? [];
    const [, of, what, words] = /^(\S+) : (enter|during|exit) \/ (.*)$/.exec(line) ?? [];
    const parent = around.at(-1) ?? "";
    if (id) {
      node(id, name);
      if (opens) around.push(id);
    } else if (line === "}" && around.length > 1) around.pop();
    else if (of) /** @type {any} */ (node(of))[what].push(words);
    else if (from === "[*]" && label === "after a pause") join(parent, to, label);
    else if (from === "[*]" && parent) node(parent).initial = to;
    else if (from === "[*]") diagram.initial = to;
    else if (to === "[*]") node(from).final = true;
    else if (from) join(from, to, label);
    else if (!/^(classDef|class|direction|click|note) ?/.test(line)) throw new Error(`it has the line "${line.slice(0, 40)}"`);
  }
  if (nodes.size === 0) throw new Error("it has no states");
  return { ...diagram, nodes: [...nodes.values()] };
}
