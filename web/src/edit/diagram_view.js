/** The diagram: states as boxes and transitions as lines, drawn in SVG, moved and joined with the mouse. */
import { contains, line, pathOf, pointOn } from "./geometry.js";
import { freePlace } from "./free_place.js";
import { layOut, placeWithin, renamed, textWidth } from "./layout.js";
import { Router } from "./routes.js";
import { HANDLE, labelWords, missingShape, stateShape, svg } from "./shapes.js";

/**
 * @typedef {import("./session.js").Diagram} Diagram
 * @typedef {import("./session.js").Finding} Finding
 * @typedef {import("./session.js").Point} Point
 * @typedef {import("./geometry.js").Box} Box
 * @typedef {{kind: "mission"|"state"|"transition", id: string}} Selection id: of a state or transition of the diagram
 */

const CLICK_PX = 4;
const END = 9; // how near to the end of a line the mouse takes it, in the drawing's units
const END_INWARDS = 17; // how far from its state
const MISSING_HEIGHT = 24;
const ZOOM = { least: 0.05, most: 3, step: 1.0015 };
const MARGIN = 24; // around what is brought into view, in pixels

export class DiagramView {
  #listener;
  #words;
  #svg;
  #world;
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
  /** @type {Object<string, Point|null>} what was drawn elsewhere than it is kept */
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
  #view = { x: 0, y: 0, scale: 1 };
  #isFresh = true;
  #hovered = ""; // the transition under the mouse
  #grasped = ""; // the one whose end is dragged
  /** @type {[Set<string>, Map<string, number>, Set<string>]} what flies, see `light` */
  #light = [new Set(), new Map(), new Set()];
  #lost = "";

  /**
   * @param {HTMLElement} parent
   * @param {{selected: (selection: Selection) => void, placed: (places: Object<string, Point>) => void,
   *   joined: (from: string, to: string) => void, moved: (state: string, parent: string, place: Point) => void,
   *   led: (transition: string, end: "source"|"target", state: string) => void,
   *   opened: (selection: Selection) => void}} listener told what the mouse has done
   * @param {{done: string, resume: string}} words for transitions of these events
   */
  constructor(parent, listener, words) {
    this.#listener = listener;
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
    this.#world = svg("g", {}, this.#superstates, this.#lines, this.#labels, this.#states, this.#ends.source, this.#ends.target, this.#draft);
    this.#svg = svg("svg", { class: "e-diagram", role: "group", "aria-label": "diagram" }, svg("defs", {}, arrow), this.#world);
    parent.append(this.#svg);
    this.#svg.addEventListener("pointerdown", (event) => this.#press(event));
    this.#svg.addEventListener("dblclick", (event) => this.#open(event));
    this.#svg.addEventListener("pointerover", (event) => {
      const found = this.#at(event.target);
      if (event.buttons === 0) this.#hover(found.kind === "transition" ? found.id : "");
    });
    this.#svg.addEventListener("wheel", (event) => this.#zoom(event), { passive: false });
    this.#svg.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      const found = this.#at(event.target);
      if (found.kind !== "mission") {
        event.preventDefault();
        this.#listener.selected(found);
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
      places: (id) => kept[id] ?? this.#places.get(id), boxes: this.#boxes, view: this.#isFresh ? null : this.#seen(),
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

  /** Places as drawn that are not those that were kept. @returns {Object<string, Point|null>} null: not used any more */
  get unkept() {
    return this.#unkept;
  }

  /** The place of a state within its superstate. @param {string} id */
  placeOf(id) {
    return this.#places.get(id);
  }

  #remember(kept) {
    this.#unkept = {};
    for (const { id, parent } of this.#diagram.nodes) {
      const place = placeWithin(/** @type {Box} */ (this.#boxes.get(id)), this.#boxes.get(parent));
      this.#places.set(id, place);
      if (kept[id]?.x !== place.x || kept[id]?.y !== place.y) this.#unkept[id] = place;
    }
  }

  /** The part of the drawing that is seen. @returns {Box} */
  #seen() {
    const { width, height } = this.#svg.getBoundingClientRect();
    const { x, y, scale } = this.#view;
    return { x: -x / scale, y: -y / scale, width: width / scale, height: height / scale };
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
      const kind = `${event === "tick" ? "" : ` e-${event}`}${edge.missing ? " e-astray" : ""}`;
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
      this.#missing.set(id, { ...freePlace(size, others, [box], this.#isFresh ? null : this.#seen(), false), ...size });
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

  /** @param {string} id */
  #hover(id) {
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
  #endAt({ x, y }, id) {
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
    const { width, height } = this.#svg.getBoundingClientRect();
    let right = 1, bottom = 1;
    for (const box of [...this.#boxes.values(), ...this.#missing.values()]) {
      right = Math.max(right, box.x + box.width + 40);
      bottom = Math.max(bottom, box.y + box.height + 24);
    }
    const scale = Math.min(1.2, Math.max(ZOOM.least, Math.min(width / right, height / bottom)));
    this.#view = { x: Math.max(0, (width - right * scale) / 2), y: 0, scale };
    this.#showView();
  }

  /** Bring a state or transition into view, if it is not. @param {Selection} selection */
  reveal({ kind, id }) {
    const curve = kind === "transition" ? this.#transitionElements.get(id)?.curve : undefined;
    const point = curve && pointOn(curve, 0.5);
    const box = kind === "state" ? this.#boxes.get(id) : point && { ...point, width: 0, height: 0 };
    if (!box) return;
    const { width, height } = this.#svg.getBoundingClientRect();
    const { x, y, scale } = this.#view;
    const moved = (offset, start, size, whole) => {
      const from = start * scale + offset, to = from + Math.min(size * scale, whole - 2 * MARGIN);
      return offset + (from < MARGIN ? MARGIN - from : to > whole - MARGIN ? whole - MARGIN - to : 0);
    };
    const isSeen = (start, size, whole) => start >= 0 && start + size <= whole;
    if (isSeen(box.x * scale + x, box.width * scale, width) && isSeen(box.y * scale + y, box.height * scale, height)) return;
    this.#view = { x: moved(x, box.x, box.width, width), y: moved(y, box.y, box.height, height), scale };
    this.#showView();
  }

  #showView() {
    const { x, y, scale } = this.#view;
    this.#world.setAttribute("transform", `translate(${x},${y}) scale(${scale})`);
  }

  /** @param {WheelEvent} event */
  #zoom(event) {
    event.preventDefault();
    const { x, y, scale } = this.#view;
    const next = Math.min(ZOOM.most, Math.max(ZOOM.least, scale * ZOOM.step ** -event.deltaY));
    const frame = this.#svg.getBoundingClientRect();
    const at = { x: event.clientX - frame.x, y: event.clientY - frame.y };
    this.#view = { x: at.x - (at.x - x) * next / scale, y: at.y - (at.y - y) * next / scale, scale: next };
    this.#showView();
  }

  /** @param {PointerEvent} event @returns {Point} in the drawing's units */
  #point(event) {
    const frame = this.#svg.getBoundingClientRect();
    const { x, y, scale } = this.#view;
    return { x: (event.clientX - frame.x - x) / scale, y: (event.clientY - frame.y - y) / scale };
  }

  /** @param {EventTarget|null} target @returns {Selection} */
  #at(target) {
    const element = target instanceof Element ? target.closest("[data-state], [data-transition]") : null;
    if (!(element instanceof SVGElement)) return { kind: "mission", id: "" };
    const { state, transition } = element.dataset;
    return state !== undefined ? { kind: "state", id: state } : { kind: "transition", id: transition ?? "" };
  }

  /** The innermost state at a point, but none of some. @param {Point} point @param {Set<string>} [except] */
  #stateAt(point, except = new Set()) {
    let found = null;
    for (const { id: path } of this.#diagram.nodes) {
      if (!except.has(path) && contains(this.#boxes.get(path), point)) found = path; // inner ones come later
    }
    return found;
  }

  /** The state whose handle is at a point, also below a line. @param {Point} point */
  #handleAt({ x, y }) {
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

  /** @param {MouseEvent} event */
  #open(event) {
    // While the mouse is captured the event's target is the drawing.
    const found = this.#at(document.elementFromPoint(event.clientX, event.clientY));
    if (found.kind !== "mission") this.#listener.opened(found);
  }

  /** @param {PointerEvent} event */
  #press(event) {
    if (event.button !== 0) return;
    const target = event.target instanceof Element ? event.target : null;
    const point = this.#point(event);
    const { kind, id } = this.#selection;
    const handle = this.#handleAt(point);
    const own = handle === null && kind === "transition" ? this.#endAt(point, id) : null;
    const pulled = own ? id : this.#hovered;
    const end = own ?? (handle === null ? this.#endAt(point, pulled) : null);
    if (handle !== null) this.#drag(event, this.#joining(handle));
    else if (end !== null) {
      this.#listener.selected({ kind: "transition", id: pulled });
      this.#drag(event, this.#leading(pulled, end));
    } else {
      const found = this.#at(target);
      this.#listener.selected(found);
      if (found.kind === "state") this.#drag(event, this.#moving(found.id, this.#point(event)));
      else if (found.kind === "mission") this.#drag(event, this.#panning(event));
    }
  }

  /**
   * Follow the mouse until its button is released.
   * @param {PointerEvent} pressed
   * @param {{move: (event: PointerEvent) => void, end: (event: PointerEvent, wasMoved: boolean) => void}} action
   */
  #drag(pressed, action) {
    let isMoved = false;
    /** @type {PointerEvent|null} */
    let latest = null;
    let frame = 0;
    const move = (event) => {
      isMoved ||= Math.hypot(event.clientX - pressed.clientX, event.clientY - pressed.clientY) > CLICK_PX;
      if (!isMoved) return;
      latest = event;
      frame ||= requestAnimationFrame(() => {
        frame = 0;
        if (latest) action.move(latest);
      });
    };
    const end = (event) => {
      this.#svg.removeEventListener("pointermove", move);
      this.#svg.removeEventListener("pointerup", end);
      this.#svg.removeEventListener("pointercancel", end);
      cancelAnimationFrame(frame);
      if (isMoved) action.move(event);
      action.end(event, isMoved && event.type === "pointerup");
    };
    this.#svg.setPointerCapture(pressed.pointerId);
    this.#svg.addEventListener("pointermove", move);
    this.#svg.addEventListener("pointerup", end);
    this.#svg.addEventListener("pointercancel", end);
  }

  #panning(pressed) {
    const before = { ...this.#view };
    return {
      move: (event) => {
        this.#view = { ...before, x: before.x + event.clientX - pressed.clientX, y: before.y + event.clientY - pressed.clientY };
        this.#showView();
      },
      end: () => {},
    };
  }

  /** @param {string} path @param {Point} start */
  #moving(path, start) {
    const family = this.#family(path);
    const before = new Map(family.map((each) => [each, { ...this.#boxes.get(each) }]));
    const astray = new Map([...this.#missing].filter(([id]) => family.includes(this.#edges.get(id)?.source ?? "")).map(([id, box]) => [id, { ...box }]));
    const lines = new Set(family.flatMap((each) => this.#touching.get(each) ?? []));
    const moveBy = (dx, dy) => {
      for (const each of family) {
        const box = before.get(each), now = this.#boxes.get(each);
        if (!now) continue; // it was deleted in another window meanwhile
        Object.assign(now, { x: box.x + dx, y: box.y + dy });
        this.#place(each);
      }
      for (const [id, box] of astray) Object.assign(this.#missing.get(id) ?? {}, { x: box.x + dx, y: box.y + dy });
      for (const id of lines) if (this.#transitionElements.has(id)) this.#drawLine(id);
    };
    return {
      move: (event) => {
        const { x, y } = this.#point(event);
        moveBy(x - start.x, y - start.y);
      },
      end: (event, wasMoved) => {
        if (!wasMoved || !this.#boxes.has(path)) return;
        const parent = this.#parents.get(path);
        const over = this.#stateAt(this.#point(event), new Set(family)) ?? "";
        const around = over === "" || this.#children.has(over) ? over : this.#parents.get(over);
        if (event.shiftKey && around !== parent) {
          this.#listener.moved(path, around, placeWithin(this.#boxes.get(path), this.#boxes.get(around)));
          return;
        }
        this.#listener.placed({ [path]: placeWithin(this.#boxes.get(path), this.#boxes.get(parent)) });
      },
    };
  }

  /** A line from a state to the mouse, which becomes a transition. @param {string} from */
  #joining(from) {
    const box = this.#boxes.get(from);
    return this.#pulling({ x: box.x + box.width, y: box.y + this.#handleHeight(from) }, (to) => this.#listener.joined(from, to));
  }

  /** An end of a transition follows the mouse, to another state. @param {string} id @param {"source"|"target"} end */
  #leading(id, end) {
    this.#grasped = id;
    const { curve, group } = /** @type {any} */ (this.#transitionElements.get(id));
    group.classList.add("e-pulled");
    return this.#pulling(end === "target" ? curve[0] : curve.at(-1), (state) => this.#listener.led(id, end, state));
  }

  /** @param {Point} start @param {(state: string) => void} dropped */
  #pulling(start, dropped) {
    const target = (event) => this.#stateAt(this.#point(event));
    return {
      move: (event) => {
        const { x, y } = this.#point(event);
        this.#draft.setAttribute("visibility", "visible");
        this.#draft.setAttribute("d", `M${start.x},${start.y}L${x},${y}`);
        const over = target(event);
        for (const [path, group] of this.#stateElements) group.classList.toggle("e-target", path === over);
      },
      end: (event, wasMoved) => {
        this.#draft.setAttribute("visibility", "hidden");
        for (const group of this.#stateElements.values()) group.classList.remove("e-target");
        const to = wasMoved ? target(event) : null;
        this.#transitionElements.get(this.#grasped)?.group.classList.remove("e-pulled");
        this.#grasped = "";
        if (to !== null) dropped(to);
      },
    };
  }
}

/** @param {SVGTextElement} label @param {Point} foot */
function placeLabel(label, { x, y }) {
  label.setAttribute("x", x.toFixed(1));
  label.setAttribute("y", y.toFixed(1));
}
