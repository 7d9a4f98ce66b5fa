/** The parts of which the diagram is drawn, as elements of SVG. */
const SVG = "http://www.w3.org/2000/svg";
const LONGEST_LABEL = 34;

export const HANDLE = 6; // radius, in the drawing's units

/**
 * @template {keyof SVGElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Object<string, string|number>} [attributes]
 * @param {...(Node|string)} children
 * @returns {SVGElementTagNameMap[Tag]}
 */
export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

/** @param {string} text */
const shorten = (text) => (text.length > LONGEST_LABEL ? `${text.slice(0, LONGEST_LABEL - 1)}…` : text);

/**
 * The words beside a transition.
 * @param {import("../messages.js").Documents.Edge} edge
 * @param {{done: string, resume: string}} words for transitions of these events
 */
export function labelWords({ event, order, when }, words) {
  return event === "tick" ? `${order + 1}${when ? `: ${shorten(when)}` : ""}` : words[event];
}

/**
 * A state's box.
 * @param {import("../messages.js").Documents.Node} state
 * @param {import("./geometry.js").Box} box
 * @param {{isSuper: boolean, isClosed: boolean, isInitial: boolean, handleHeight: number, isEdited: boolean}} how isSuper: with its states in it
 * @returns {SVGGElement}
 */
export function stateShape({ id, name, template, final, source, enter, during, exit }, box, { isSuper, isClosed, isInitial, handleHeight, isEdited }) {
  const kinds = ["e-state", isSuper && "e-super", isClosed && "e-closed", final && "e-final", !source && "e-foreign"];
  const group = svg("g", {
    class: kinds.filter(Boolean).join(" "), "data-state": id, "aria-label": `state ${id}`, ...(isEdited ? { tabindex: 0, role: "button" } : {}),
  },
  svg("rect", { width: box.width, height: box.height, rx: 8 }),
  svg("text", { x: isSuper ? 24 : box.width / 2, y: isSuper ? 20 : 27, class: isSuper ? "e-name e-left" : "e-name" },
    template ? `${name} : ${template}` : name));
  if (isInitial) group.append(svg("circle", { cx: 0, cy: isSuper ? 15 : box.height / 2, r: 5, class: "e-initial" }));
  if (final) group.append(svg("rect", { x: 3, y: 3, width: box.width - 6, height: box.height - 6, rx: 6, class: "e-inner" }));
  if (isSuper || isClosed) {
    const y = isSuper ? 15 : box.height / 2;
    group.append(svg("g", { class: "e-fold", "data-fold": id },
      svg("rect", { x: 6, y: y - 10, width: 18, height: 22 }), svg("path", { d: isSuper ? `M7,${y - 3}h10l-5,7z` : `M9,${y - 5}v10l7,-5z` }),
      svg("title", {}, isSuper ? "close" : "open")));
  }
  if (isEdited) {
    group.append(svg("circle", { cx: box.width, cy: handleHeight, r: HANDLE, class: "e-handle" },
      svg("title", {}, "drag to another state: a new transition")));
  } else {
    const actions = Object.entries({ enter, during, exit }).filter(([, each]) => each.length > 0);
    group.append(svg("title", {}, actions.map(([when, each]) => `${when} / ${each.join(", ")}`).join("\n")));
  }
  return group;
}

/**
 * What stands for a state that is missing, at the end of a transition to it.
 * @param {import("../messages.js").Documents.Edge} edge
 * @param {import("./geometry.js").Box} box
 * @returns {SVGGElement}
 */
export function missingShape({ id, target }, { width, height }) {
  return svg("g", { class: "e-missing", "data-transition": id },
    svg("rect", { width, height, rx: 4 }), svg("text", { x: width / 2, y: height / 2 + 4 }, `${shorten(target)} ?`));
}
