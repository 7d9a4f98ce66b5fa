/** The diagram: states as boxes and transitions as lines, drawn in SVG. What the mouse does with it is elsewhere: it is edited, or looked at. */
import "./diagram.css";
import { chainOf, fold } from "./fold.js";
import { contains, line, pathOf, pointOn } from "./geometry.js";
import { freePlace } from "./free_place.js";
import { layOut, placeWithin, renamed, textWidth } from "./layout.js";
import { Router } from "./routes.js";
import { HANDLE, labelWords, missingShape, stateShape, svg } from "./shapes.js";
import { Viewport } from "./viewport.js";

/**
 * @typedef {import("../messages.js").Documents.Diagram} Diagram
 * @typedef {import("../messages.js").Documents.Finding} Finding
 * @typedef {{x: number, y: number}} Point
 * @typedef {import("./geometry.js").Box} Box
 * @typedef {{kind: "mission"|"state"|"transition", id: string}} Selection id: of a state or transition of the diagram
 */

const END = 9; // how near to the end of a line the mouse takes it, in the drawing's units
const END_INWARDS = 17; // how far from its state
const MISSING_HEIGHT = 24;
const LARGEST = { edited: 1.2, lookedAt: 1.8 }; // scale by itself
const READABLE = 10 / 11; // the least scale by itself: the letters of labels have 11 pixels, and shall have 10 on the page
const BESIDE = { right: 40, bottom: 24 }; // of all states, for lines
/** @type {Diagram} */
const EMPTY = { name: "", initial: "", readable: true, nodes: [], edges: [], settings: {}, variables: {}, templates: {} };

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
  #isEdited;
  /** @type {Diagram} with all superstates open */
  #whole = EMPTY;
  /** @type {Map<string, Box>} of all states, as they are without anything closed */
  #wholeBoxes = new Map();
  /** @type {Set<string>} superstates whose inside is not drawn */
  #closed = new Set();
  /** Whether it opens, closes and shows what there is room for; not once somebody has done so by hand. */
  #isAuto = true;
  #focus = "";
  /** @type {Finding[]} */
  #findings = [];
  /** @type {Diagram} as drawn */
  #diagram = EMPTY;
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
  /** @type {Map<string, string>} */
  #parents = new Map();
  /** @type {Map<string, string>} */
  #initials = new Map();
  /** @type {Map<string, import("../messages.js").Documents.Edge>} */
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
   * @param {{done: string, resume: string}} words for transitions of these events
   * @param {{isEdited?: boolean, wheelNeeds?: HTMLElement|null}} [options] isEdited: states can be taken and joined; wheelNeeds: what must
   *   have the focus before the wheel zooms
   */
  constructor(parent, words, { isEdited = true, wheelNeeds = null } = {}) {
    this.#words = words;
    this.#isEdited = isEdited;
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
    this.root.classList.toggle("e-looked-at", !isEdited);
    this.viewport = new Viewport(this.root, world, wheelNeeds, isEdited ? LARGEST.edited : LARGEST.lookedAt);
    this.viewport.onTouched = () => this.hold();
    new ResizeObserver(() => this.#isAuto && this.#look()).observe(this.root);
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
    for (const [now, before] of renamed(this.#whole, diagram)) {
      const place = this.#places.get(before);
      if (place && !kept[now]) this.#places.set(now, place);
      this.#places.delete(before);
      const box = this.#wholeBoxes.get(before);
      if (box) this.#wholeBoxes.set(now, box);
    }
    this.#whole = diagram;
    this.#wholeBoxes = layOut(diagram, {
      places: (id) => kept[id] ?? this.#places.get(id), boxes: this.#wholeBoxes,
      view: this.#isFresh || this.#closed.size > 0 ? null : this.viewport.seen,
    });
    this.#remember(kept);
    this.#findings = findings;
    const isFirst = this.#isFresh && diagram.nodes.length > 0;
    this.#render();
    if (isFirst) {
      this.#isFresh = false;
      this.fit();
    }
  }

  /** Draw what is not closed. */
  #render() {
    this.#diagram = fold(this.#whole, this.#closed);
    this.#boxes = this.#diagram === this.#whole ? this.#wholeBoxes : this.#folded(this.#diagram);
    this.#index();
    this.#stateElements.clear();
    this.#transitionElements.clear();
    const plain = /** @type {SVGGElement[]} */ ([]), around = /** @type {SVGGElement[]} */ ([]);
    for (const state of this.#diagram.nodes) (this.#children.has(state.id) ? around : plain).push(this.#state(state));
    this.#superstates.replaceChildren(...around);
    this.#states.replaceChildren(...plain);
    this.#makeTransitions();
    this.#mark(this.#findings);
    this.select(this.#selection);
    this.#showLight();
    this.markLost(this.#lost);
  }

  /** Places of a diagram with closed superstates: where there are superstates it is arranged anew. @param {Diagram} diagram */
  #folded(diagram) {
    return layOut(diagram, { places: (id) => (this.#isAmongLeaves(id) ? this.#places.get(id) : undefined), boxes: new Map(), view: null });
  }

  /** Whether no state beside this one is a superstate. @param {string} id */
  #isAmongLeaves(id) {
    const { nodes } = this.#whole;
    const parent = nodes.find((each) => each.id === id)?.parent;
    const around = new Set(nodes.map((each) => each.parent));
    return !nodes.some((each) => each.parent === parent && around.has(each.id));
  }

  /** Whether a state's place is as it is kept, so that it can be moved. @param {string} id */
  isMovable(id) {
    return this.#closed.size === 0 || this.#isAmongLeaves(id);
  }

  /** Forget all places: the next drawing is arranged anew. */
  forget() {
    this.#places.clear();
    this.#wholeBoxes.clear();
  }

  /** Places as drawn that are not those that were kept. */
  get unkept() {
    return this.#unkept;
  }

  /** @param {Object<string, Point>} kept */
  #remember(kept) {
    this.#unkept = {};
    for (const { id, parent } of this.#whole.nodes) {
      const place = placeWithin(/** @type {Box} */ (this.#wholeBoxes.get(id)), this.#wholeBoxes.get(parent));
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

  /** @param {import("../messages.js").Documents.Node} state @returns {SVGGElement} */
  #state(state) {
    const { id, parent } = state;
    const initial = parent === "" ? this.#diagram.initial : this.#initials.get(parent);
    const group = stateShape(state, /** @type {Box} */ (this.#boxes.get(id)), {
      isSuper: this.#children.has(id), isClosed: this.#closed.has(id), isInitial: initial === id,
      handleHeight: this.#handleHeight(id), isEdited: this.#isEdited,
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
      const group = svg("g", { class: `e-transition${kind}`, "data-transition": id, ...(this.#isEdited ? { tabindex: 0, role: "button" } : {}),
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
    for (const [id, { curve }] of this.#transitionElements) router.pass(curve, id);
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

  /** Where a state that is drawn is. @param {string} path */
  #box(path) {
    return /** @type {Box} */ (this.#boxes.get(path));
  }

  /** @param {string} path */
  #place(path) {
    const { x, y } = this.#box(path);
    this.#stateElements.get(path)?.setAttribute("transform", `translate(${x},${y})`);
  }

  /** Draw a line, its label in the middle. @param {string} id */
  #drawLine(id) {
    const elements = this.#transitionElements.get(id), edge = this.#edges.get(id);
    if (!elements || !edge) return;
    const box = this.#missing.get(id);
    elements.curve = line(this.#box(edge.source), box ?? this.#box(edge.target), elements.lane);
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
      /**
       * @type {{setAttribute(name: string, value: string|number): void}} which takes a number for its text
       */
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
    /** @type {Record<string, number>} */
    const worst = { advice: 1, warning: 2, error: 3 };
    /** @type {Map<string, Finding["severity"]>} */
    const found = new Map();
    /** @param {string} key @param {Finding["severity"]} severity */
    const note = (key, severity) => {
      if ((worst[/** @type {string} */ (found.get(key))] ?? 0) < worst[severity]) found.set(key, severity);
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
    this.#showLight();
    const leaf = [...active].reduce((longest, id) => (id.length > longest.length ? id : longest), "");
    if (leaf && this.#isAuto) this.focus(leaf);
  }

  #showLight() {
    const [active, counts, taken] = this.#light;
    /** @param {string} path */
    const inside = (path) => this.#closed.has(path) && [...active].some((id) => id.startsWith(`${path}.`));
    for (const [path, group] of this.#stateElements) group.classList.toggle("e-active", active.has(path) || inside(path));
    for (const [id, { group, label }] of this.#transitionElements) {
      const count = counts.get(id) ?? 0;
      const plain = label.dataset.words ?? "";
      const words = count > 0 ? `${plain} (${count}×)` : plain;
      if (label.textContent !== words) label.textContent = words;
      group.classList.toggle("e-taken", taken.has(id));
    }
  }

  /** Mark the state in which a flight was lost. @param {string} id empty: none */
  markLost(id) {
    this.#lost = id;
    for (const [path, group] of this.#stateElements) group.classList.toggle("e-lost", path === id);
  }

  /** Show all of it with letters that can be read: with superstates closed that are not looked at, and at least the one that is. */
  fit() {
    this.#isAuto = true;
    this.#look();
  }

  /** Show all of it with all superstates open, however small. */
  whole() {
    this.#isAuto = false;
    this.#close(new Set());
    this.viewport.fit(sizeOf(this.#boxes));
  }

  /** Leave all as it is now shown. */
  hold() {
    this.#isAuto = false;
  }

  /** Look at a state. @param {string} id */
  focus(id) {
    if (id === this.#focus) return;
    this.#focus = id;
    if (this.#isAuto) this.#look();
    else this.#open(id);
  }

  #look() {
    if (this.#whole.nodes.length === 0) return;
    /** @param {Map<string, Box>} boxes */
    const fits = (boxes) => this.viewport.scaleOf(...sizeOf(boxes)) >= READABLE;
    const isThere = this.#whole.nodes.some(({ id }) => id === this.#focus);
    const around = this.#chain(isThere ? this.#focus : this.#whole.initial);
    const isOpen = fits(this.#wholeBoxes);
    this.#close(new Set(isOpen ? [] : this.#allSuperstates.filter((id) => !around.includes(id))));
    if (isOpen || fits(this.#boxes)) return this.viewport.fit(sizeOf(this.#boxes));
    const boxes = around.flatMap((id) => this.#boxes.get(id) ?? []);
    const whole = boxes.find((box) => this.viewport.scaleOf(box.width, box.height) >= READABLE);
    const leaf = boxes.at(-1);
    if (whole && whole !== leaf) this.viewport.show(whole, sizeOf(this.#boxes), [READABLE, LARGEST.edited]);
    else if (leaf) this.viewport.show(leaf, sizeOf(this.#boxes), [READABLE, READABLE]); // and as much as there is room for
  }

  get #allSuperstates() {
    return [...new Set(this.#whole.nodes.map(({ parent }) => parent))].filter(Boolean);
  }

  /** @param {string} id @returns {string[]} */
  #chain(id) {
    return chainOf(new Map(this.#whole.nodes.map((each) => [each.id, each.parent])), id);
  }

  /** @param {Set<string>} closed superstates */
  #close(closed) {
    if (closed.size === this.#closed.size && [...closed].every((id) => this.#closed.has(id))) return;
    this.#closed = closed;
    this.#render();
  }

  /** Open what is around a state. @param {string} id */
  #open(id) {
    const around = this.#chain(id);
    this.#close(new Set([...this.#closed].filter((each) => each === id || !around.includes(each))));
  }

  /** Open a superstate, or close it. @param {string} id */
  toggle(id) {
    this.#isAuto = false;
    const closed = new Set(this.#closed);
    if (!closed.delete(id)) closed.add(id);
    this.#close(closed);
    this.reveal({ kind: "state", id });
  }

  /** The superstate that is opened or closed at an element. @param {EventTarget|null} target */
  foldAt(target) {
    const element = target instanceof Element ? target.closest("[data-fold]") : null;
    return element instanceof SVGElement ? element.dataset.fold ?? "" : "";
  }

  /** Bring a state or transition into view, if it is not. @param {Selection} selection */
  reveal({ kind, id }) {
    const states = kind === "state" ? [id] : this.#whole.edges.filter((edge) => edge.id === id).flatMap(({ source, target }) => [source, target]);
    for (const each of states) this.#open(each);
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
      if (!except.has(path) && contains(this.#box(path), point)) found = path; // inner ones come later
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
    return this.#children.has(path) ? 15 : this.#box(path).height / 2;
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
    return /** @type {string} */ (this.#parents.get(id));
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
    const before = new Map(family.map((each) => [each, { ...this.#box(each) }]));
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

/** The room that a drawing needs. @param {Map<string, Box>} boxes @returns {[number, number]} */
function sizeOf(boxes) {
  let right = 1, bottom = 1;
  for (const box of boxes.values()) {
    right = Math.max(right, box.x + box.width + BESIDE.right);
    bottom = Math.max(bottom, box.y + box.height + BESIDE.bottom);
  }
  return [right, bottom];
}

/** @param {SVGTextElement} label @param {Point} foot */
function placeLabel(label, { x, y }) {
  label.setAttribute("x", x.toFixed(1));
  label.setAttribute("y", y.toFixed(1));
}
