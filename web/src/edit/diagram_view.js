/** The diagram: states as boxes and transitions as lines, drawn in SVG. `diagram_mouse.js` has what the mouse does with it. */
import { contains, line, pathOf, pointOn } from "./geometry.js";
import { freePlace } from "./free_place.js";
import { layOut, placeWithin, renamed, textWidth } from "./layout.js";
import { Router } from "./routes.js";
import { HANDLE, labelWords, missingShape, stateShape, svg } from "./shapes.js";
import { takeMouse } from "./diagram_mouse.js";
import { Viewport } from "./viewport.js";

/**
 * @typedef {import("./session.js").Diagram} Diagram
 * @typedef {import("./session.js").Finding} Finding
 * @typedef {import("./session.js").Point} Point
 * @typedef {import("./geometry.js").Box} Box
 * @typedef {{kind: "mission"|"state"|"transition", id: string}} Selection id: of a state or transition of the diagram
 */

const END = 9; // how near to the end of a line the mouse takes it, in the drawing's units
const END_INWARDS = 17; // how far from its state
const MISSING_HEIGHT = 24;

export class DiagramView {
  root;
  viewport;
  #words;
  #superstates;
  #lines;
  #states;
  #labels;
  #draft;
  #ends;
  /** @type {Diagram} */
  #diagram = { initial: "", readable: true, nodes: [], edges: [] };
  /** @type {Map<string, Box>} */
  #boxes = new Map();
  /** @type {Map<string, Box>} what stands for missing targets, by id of the transition */
  #missing = new Map();
  /** @type {Map<string, Point>} where states were drawn, within their superstates; also of some that are gone */
  #places = new Map();
  /** @type {Object<string, Point>} what was drawn elsewhere than it is kept */
  #unkept = {};
  /** @type {Map<string, SVGGElement>} */
  #stateElements = new Map();
  /** @type {Map<string, {group: SVGGElement, path: SVGPathElement, hit: SVGPathElement, label: SVGTextElement, lane: number,
   *   curve: import("./geometry.js").Curve, missing: SVGGElement|null}>} */
  #transitionElements = new Map();
  /** @type {Map<string, string[]>} transitions at each state */
  #touching = new Map();
  /** @type {Map<string, string[]>} */
  #children = new Map();
  #parents = new Map();
  #initials = new Map();
  /** @type {Map<string, import("./session.js").Edge>} */
  #edges = new Map();
  /** @type {Selection} */
  #selection = { kind: "mission", id: "" };
  #isFresh = true;
  #hovered = "";
  /** @type {[Set<string>, Map<string, number>, Set<string>]} what flies, see `light` */
  #light = [new Set(), new Map(), new Set()];
  #lost = "";

  /**
   * @param {HTMLElement} parent
   * @param {import("./diagram_mouse.js").Listener} listener told what the user has done
   * @param {{done: string, resume: string}} words for transitions of these events
   */
  constructor(parent, listener, words) {
    this.#words = words;
    const arrow = svg("marker", {
      id: "e-arrow", viewBox: "0 0 10 10", refX: 9, refY: 5, markerWidth: 11, markerHeight: 11,
      markerUnits: "userSpaceOnUse", orient: "auto-start-reverse",
    }, svg("path", { d: "M0,0L10,5L0,10z", class: "e-arrow" }));
    this.#superstates = svg("g");
    this.#states = svg("g"); // in front of lines and labels, which would keep the mouse from a state that they pass
    this.#lines = svg("g");
    this.#labels = svg("g");
    this.#draft = svg("path", { class: "e-draft", visibility: "hidden" });
    this.#ends = {
      source: svg("circle", { r: HANDLE, class: "e-end", visibility: "hidden" }),
      target: svg("circle", { r: HANDLE, class: "e-end", visibility: "hidden" }),
    };
    const world = svg("g", {}, this.#superstates, this.#lines, this.#labels, this.#states, this.#ends.source, this.#ends.target, this.#draft);
    this.root = svg("svg", { class: "e-diagram", role: "group", "aria-label": "diagram" }, svg("defs", {}, arrow), world);
    parent.append(this.root);
    this.viewport = new Viewport(this.root, world);
    takeMouse(this, listener);
    this.root.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      const found = this.at(event.target);
      if (found.kind !== "mission") {
        event.preventDefault();
        listener.selected(found);
      }
    });
  }

  get selection() {
    return this.#selection;
  }

  /**
   * Draw a diagram. States keep the places that they had; new ones get free places.
   * @param {Diagram} diagram
   * @param {Object<string, Point>} kept places, by path
   * @param {Finding[]} findings
   */
  draw(diagram, kept, findings) {
    for (const [now, before] of renamed(this.#diagram, diagram)) {
      const place = this.#places.get(before);
      if (place && !kept[now]) this.#places.set(now, place);
      this.#places.delete(before);
      const box = this.#boxes.get(before);
      if (box) this.#boxes.set(now, box);
    }
    this.#diagram = diagram;
    this.#boxes = layOut(diagram, {
      places: (id) => kept[id] ?? this.#places.get(id), boxes: this.#boxes, view: this.#isFresh ? null : this.viewport.seen,
    });
    this.#index();
    this.#remember(kept);
    this.#stateElements.clear();
    this.#transitionElements.clear();
    const plain = [], around = [];
    for (const state of diagram.nodes) (this.#children.has(state.id) ? around : plain).push(this.#state(state));
    this.#superstates.replaceChildren(...around);
    this.#states.replaceChildren(...plain);
    this.#makeTransitions();
    this.#mark(findings);
    this.select(this.#selection);
    this.light(...this.#light);
    this.markLost(this.#lost);
    if (this.#isFresh && diagram.nodes.length > 0) {
      this.#isFresh = false;
      this.fit();
    }
  }

  /** Forget all places: the next drawing is arranged anew. */
  forget() {
    this.#places.clear();
    this.#boxes.clear();
  }

  /** Places as drawn that are not those that were kept. */
  get unkept() {
    return this.#unkept;
  }

  #remember(kept) {
    this.#unkept = {};
    for (const { id, parent } of this.#diagram.nodes) {
      const place = placeWithin(/** @type {Box} */ (this.#boxes.get(id)), this.#boxes.get(parent));
      this.#places.set(id, place);
      if (kept[id]?.x !== place.x || kept[id]?.y !== place.y) this.#unkept[id] = place;
    }
  }

  #index() {
    this.#children.clear();
    this.#parents.clear();
    this.#initials = new Map(this.#diagram.nodes.map(({ id, initial }) => [id, initial]));
    this.#edges = new Map(this.#diagram.edges.map((edge) => [edge.id, edge]));
    for (const { id: path, parent } of this.#diagram.nodes) {
      this.#parents.set(path, parent);
      const siblings = this.#children.get(parent);
      if (siblings) siblings.push(path);
      else this.#children.set(parent, [path]);
    }
  }

  /** @param {import("./session.js").StateNode} state @returns {SVGGElement} */
  #state(state) {
    const { id, parent } = state;
    const initial = parent === "" ? this.#diagram.initial : this.#initials.get(parent);
    const group = stateShape(state, /** @type {Box} */ (this.#boxes.get(id)), {
      isSuper: this.#children.has(id), isInitial: initial === id, handleHeight: this.#handleHeight(id),
    });
    this.#stateElements.set(id, group);
    this.#place(id);
    return group;
  }

  #makeTransitions() {
    this.#touching.clear();
    this.#placeMissing();
    const router = new Router(new Map([...this.#boxes, ...this.#missing]), new Set(this.#children.keys()), this.#diagram.edges.length);
    const lanes = new Map();
    const lines = [], labels = [], missing = [], routes = [];
    for (const edge of this.#diagram.edges) {
      const { id, source: state, event, when } = edge;
      const to = edge.missing ? id : edge.target;
      if (!this.#boxes.has(state) || !(this.#boxes.has(to) || this.#missing.has(to))) continue;
      const pair = [state, to].sort().join(" ");
      const count = lanes.get(pair) ?? 0;
      lanes.set(pair, count + 1);
      const bent = Math.ceil(count / 2) * (count % 2 === 1 ? 1 : -1) + 0.5;
      const kind = `${event === "tick" ? "" : ` e-${event}`}${edge.missing ? " e-dangling" : ""}`;
      const path = svg("path", { class: "e-line", "marker-end": "url(#e-arrow)" });
      const hit = svg("path", { class: "e-hit" });
      const group = svg("g", { class: `e-transition${kind}`, "data-transition": id, tabindex: 0, role: "button",
        "aria-label": `transition from ${state} to ${edge.target}${when ? ` when ${when}` : ""}` }, hit, path);
      const words = labelWords(edge, this.#words);
      const label = svg("text", { class: "e-label", "data-transition": id, "data-words": words }, words);
      const box = this.#missing.get(to);
      const shape = box ? missingShape(edge, box) : null;
      if (shape) missing.push(shape);
      lines.push(group);
      labels.push(label);
      const route = { id, from: state, to, words };
      const lane = router.lane(route, state < to ? bent : -bent);
      this.#transitionElements.set(id, { group, path, hit, label, lane, curve: [], missing: shape });
      for (const end of new Set([state, to])) this.#touching.set(end, [...(this.#touching.get(end) ?? []), id]);
      this.#drawLine(id);
      routes.push(route);
    }
    for (const route of routes) {
      const { label, curve } = /** @type {any} */ (this.#transitionElements.get(route.id));
      placeLabel(label, router.label(curve, route));
    }
    this.#lines.replaceChildren(...lines);
    this.#labels.replaceChildren(...missing, ...labels);
  }

  /** Find places for what stands for missing targets, beside the states that lead to them. */
  #placeMissing() {
    this.#missing.clear();
    for (const { id, source, target, missing } of this.#diagram.edges) {
      const box = this.#boxes.get(source);
      if (!missing || !box) continue;
      const size = { width: textWidth(`${target} ?`) - 24, height: MISSING_HEIGHT };
      const others = [...this.#boxes, ...this.#missing].filter(([other]) => !source.startsWith(`${other}.`)).map(([, each]) => each);
      this.#missing.set(id, { ...freePlace(size, others, [box], this.#isFresh ? null : this.viewport.seen, false), ...size });
    }
  }

  /** @param {string} path */
  #place(path) {
    const { x, y } = this.#boxes.get(path);
    this.#stateElements.get(path).setAttribute("transform", `translate(${x},${y})`);
  }

  /** Draw a line, its label in the middle. @param {string} id */
  #drawLine(id) {
    const elements = this.#transitionElements.get(id);
    const { source, target } = this.#edges.get(id);
    const box = this.#missing.get(id);
    elements.curve = line(this.#boxes.get(source), box ?? this.#boxes.get(target), elements.lane);
    const drawn = pathOf(elements.curve);
    elements.path.setAttribute("d", drawn);
    elements.hit.setAttribute("d", drawn);
    if (box) elements.missing?.setAttribute("transform", `translate(${box.x},${box.y})`);
    placeLabel(elements.label, pointOn(elements.curve, 0.5));
  }

  /** The transition whose ends can be dragged. */
  get #held() {
    const { kind, id } = this.#selection;
    return this.#hovered || (kind === "transition" ? id : "");
  }

  /** The transition under the mouse, whose ends are shown; "": none. */
  get hovered() {
    return this.#hovered;
  }

  /** @param {string} id */
  hover(id) {
    this.#hovered = id;
    this.#showEnds();
  }

  #showEnds() {
    const [source, target] = this.#endsOf(this.#held);
    for (const [end, point] of /** @type {const} */ ([["source", source], ["target", target]])) {
      const circle = this.#ends[end];
      circle.setAttribute("visibility", point ? "visible" : "hidden");
      circle.setAttribute("cx", point?.x ?? 0);
      circle.setAttribute("cy", point?.y ?? 0);
    }
  }

  /** Where the ends of a line are taken with the mouse: beside the handles of the states. @param {string} id @returns {Point[]} */
  #endsOf(id) {
    const curve = this.#transitionElements.get(id)?.curve;
    if (!curve) return [];
    const t = Math.min(0.3, END_INWARDS / (2 * Math.hypot(pointOn(curve, 0.5).x - curve[0].x, pointOn(curve, 0.5).y - curve[0].y) || 1));
    return [pointOn(curve, t), pointOn(curve, 1 - t)];
  }

  /** The end of a line that is at a point. @param {Point} point @param {string} id of the transition @returns {"source"|"target"|null} */
  endAt({ x, y }, id) {
    const [start = Infinity, end = Infinity] = this.#endsOf(id).map((each) => Math.hypot(each.x - x, each.y - y));
    return Math.min(start, end) > END ? null : end <= start ? "target" : "source";
  }

  /** @param {Finding[]} findings */
  #mark(findings) {
    const worst = { advice: 1, warning: 2, error: 3 };
    const found = new Map();
    const note = (key, severity) => {
      if ((worst[found.get(key)] ?? 0) < worst[severity]) found.set(key, severity);
    };
    for (const { nodes, event, index, severity } of findings) {
      for (const node of nodes) note(event === null ? `s ${node}` : `t ${node}/${event}/${index}`, severity);
    }
    for (const [path, group] of this.#stateElements) group.dataset.finding = found.get(`s ${path}`) ?? "";
    for (const [id, { group }] of this.#transitionElements) group.dataset.finding = found.get(`t ${id}`) ?? "";
  }

  /** Show what is selected. @param {Selection} selection */
  select(selection) {
    this.#selection = selection;
    for (const [path, group] of this.#stateElements) {
      group.classList.toggle("e-selected", selection.kind === "state" && selection.id === path);
    }
    for (const [id, { group, label }] of this.#transitionElements) {
      const isSelected = selection.kind === "transition" && selection.id === id;
      group.classList.toggle("e-selected", isSelected);
      label.classList.toggle("e-selected", isSelected);
    }
    this.#showEnds();
  }

  /**
   * Show what flies.
   * @param {Set<string>} active states
   * @param {Map<string, number>} counts how often each transition was taken
   * @param {Set<string>} taken transitions that were taken just now
   */
  light(active, counts, taken) {
    this.#light = [active, counts, taken];
    for (const [path, group] of this.#stateElements) group.classList.toggle("e-active", active.has(path));
    for (const [id, { group, label }] of this.#transitionElements) {
      const count = counts.get(id) ?? 0;
      const words = count > 0 ? `${label.dataset.words} (${count}×)` : label.dataset.words;
      if (label.textContent !== words) label.textContent = words;
      group.classList.toggle("e-taken", taken.has(id));
    }
  }

  /** Mark the state in which a flight was lost. @param {string} id empty: none */
  markLost(id) {
    this.#lost = id;
    for (const [path, group] of this.#stateElements) group.classList.toggle("e-lost", path === id);
  }

  /** Show all of it. */
  fit() {
    let right = 1, bottom = 1;
    for (const box of [...this.#boxes.values(), ...this.#missing.values()]) {
      right = Math.max(right, box.x + box.width + 40);
      bottom = Math.max(bottom, box.y + box.height + 24);
    }
    this.viewport.fit(right, bottom);
  }

  /** Bring a state or transition into view, if it is not. @param {Selection} selection */
  reveal({ kind, id }) {
    const curve = kind === "transition" ? this.#transitionElements.get(id)?.curve : undefined;
    const point = curve && pointOn(curve, 0.5);
    const box = kind === "state" ? this.#boxes.get(id) : point && { ...point, width: 0, height: 0 };
    if (box) this.viewport.reveal(box);
  }

  /** What an element of the drawing belongs to. @param {EventTarget|null} target @returns {Selection} */
  at(target) {
    const element = target instanceof Element ? target.closest("[data-state], [data-transition]") : null;
    if (!(element instanceof SVGElement)) return { kind: "mission", id: "" };
    const { state, transition } = element.dataset;
    return state !== undefined ? { kind: "state", id: state } : { kind: "transition", id: transition ?? "" };
  }

  /** The innermost state at a point, but none of some. @param {Point} point @param {Set<string>} [except] */
  stateAt(point, except = new Set()) {
    let found = null;
    for (const { id: path } of this.#diagram.nodes) {
      if (!except.has(path) && contains(this.#boxes.get(path), point)) found = path; // inner ones come later
    }
    return found;
  }

  /** The state whose handle is at a point, also below a line. @param {Point} point */
  handleAt({ x, y }) {
    for (const [path, box] of this.#boxes) {
      if (Math.hypot(x - box.x - box.width, y - box.y - this.#handleHeight(path)) <= HANDLE) return path;
    }
    return null;
  }

  /** @param {string} path */
  #handleHeight(path) {
    return this.#children.has(path) ? 15 : this.#boxes.get(path).height / 2;
  }

  /** @param {string} path @returns {string[]} it and all states in it */
  #family(path) {
    return [path, ...(this.#children.get(path) ?? []).flatMap((child) => this.#family(child))];
  }

  /** The superstate in which a state is at a point; "": none. @param {string} id @param {Point} point */
  superstateAt(id, point) {
    const over = this.stateAt(point, new Set(this.#family(id))) ?? "";
    return over === "" || this.#children.has(over) ? over : this.parentOf(over);
  }

  /** @param {string} id @returns {string} "" of a state at the top */
  parentOf(id) {
    return this.#parents.get(id);
  }

  /** Where a state is drawn within another one; null: the state is not there any more. @param {string} id @param {string} parent */
  placeIn(id, parent) {
    const box = this.#boxes.get(id);
    return box ? placeWithin(box, this.#boxes.get(parent)) : null;
  }

  /**
   * Move a state, with those in it and their lines.
   * @param {string} id
   * @returns {(dx: number, dy: number) => void} called with how far it is from where it was
   */
  mover(id) {
    const family = this.#family(id);
    const before = new Map(family.map((each) => [each, { ...this.#boxes.get(each) }]));
    const dangling = new Map([...this.#missing].filter(([each]) => family.includes(this.#edges.get(each)?.source ?? "")).map(([each, box]) => [each, { ...box }]));
    const lines = new Set(family.flatMap((each) => this.#touching.get(each) ?? []));
    return (dx, dy) => {
      for (const [each, box] of before) {
        const now = this.#boxes.get(each);
        if (!now) continue; // it was deleted in another window meanwhile
        Object.assign(now, { x: box.x + dx, y: box.y + dy });
        this.#place(each);
      }
      for (const [each, box] of dangling) Object.assign(this.#missing.get(each) ?? {}, { x: box.x + dx, y: box.y + dy });
      for (const each of lines) if (this.#transitionElements.has(each)) this.#drawLine(each);
    };
  }

  /** The middle of a state's handle. @param {string} id @returns {Point} */
  handleOf(id) {
    const { x, y, width } = /** @type {Box} */ (this.#boxes.get(id));
    return { x: x + width, y: y + this.#handleHeight(id) };
  }

  /** The end of a transition's line that is not dragged. @param {string} id @param {"source"|"target"} dragged @returns {Point} */
  otherEndOf(id, dragged) {
    const { curve } = /** @type {any} */ (this.#transitionElements.get(id));
    return dragged === "target" ? curve[0] : curve.at(-1);
  }

  /**
   * Draw a line that is being dragged, and the state that it would lead to.
   * @param {Point} start @param {Point} end
   * @param {string} pulled id of the transition whose end is dragged; "": a new one
   */
  drawDraft(start, end, pulled) {
    this.#draft.setAttribute("visibility", "visible");
    this.#draft.setAttribute("d", `M${start.x},${start.y}L${end.x},${end.y}`);
    this.#transitionElements.get(pulled)?.group.classList.add("e-pulled");
    const over = this.stateAt(end);
    for (const [id, group] of this.#stateElements) group.classList.toggle("e-target", id === over);
  }

  removeDraft() {
    this.#draft.setAttribute("visibility", "hidden");
    for (const group of this.#stateElements.values()) group.classList.remove("e-target");
    for (const { group } of this.#transitionElements.values()) group.classList.remove("e-pulled");
  }
}

/** @param {SVGTextElement} label @param {Point} foot */
function placeLabel(label, { x, y }) {
  label.setAttribute("x", x.toFixed(1));
  label.setAttribute("y", y.toFixed(1));
}
