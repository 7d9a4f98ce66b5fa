/** The diagram: states as boxes and transitions as lines, drawn in SVG, moved and joined with the mouse. */
import { contains, line } from "./geometry.js";
import { layOut, placeWithin } from "./layout.js";

/**
 * @typedef {import("./session.js").Diagram} Diagram
 * @typedef {import("./session.js").Finding} Finding
 * @typedef {import("./session.js").Point} Point
 * @typedef {import("./layout.js").Box} Box
 * @typedef {{kind: "mission"|"state"|"transition", id: string}} Selection id: of a state or transition of the diagram
 */

const SVG = "http://www.w3.org/2000/svg";
const LONGEST_LABEL = 34;
const CLICK_PX = 4;
const HANDLE = 6; // radius, in the drawing's units
const ZOOM = { least: 0.15, most: 3, step: 1.0015 };

/** @param {string} tag @param {Object<string, string|number>} [attributes] @returns {any} */
function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

const shorten = (text) => (text.length > LONGEST_LABEL ? `${text.slice(0, LONGEST_LABEL - 1)}…` : text);

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
  /** @type {Diagram} */
  #diagram = { initial: "", readable: true, nodes: [], edges: [] };
  /** @type {Map<string, Box>} */
  #boxes = new Map();
  /** @type {Map<string, SVGGElement>} */
  #stateElements = new Map();
  /** @type {Map<string, {group: SVGGElement, path: SVGPathElement, hit: SVGPathElement, label: SVGTextElement, lane: number}>} */
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

  /**
   * @param {HTMLElement} parent
   * @param {{selected: (selection: Selection) => void, placed: (places: Object<string, Point>) => void,
   *   joined: (from: string, to: string) => void, moved: (state: string, parent: string) => void,
   *   opened: (selection: Selection) => void}} listener told what the mouse has done
   * @param {{done: string, resume: string}} words for transitions of these events
   */
  constructor(parent, listener, words) {
    this.#listener = listener;
    this.#words = words;
    const arrow = svg("marker", {
      id: "e-arrow", viewBox: "0 0 10 10", refX: 9, refY: 5, markerWidth: 8, markerHeight: 8, orient: "auto-start-reverse",
    }, svg("path", { d: "M0,0L10,5L0,10z", class: "e-arrow" }));
    this.#superstates = svg("g");
    this.#states = svg("g"); // in front of the lines, which would keep the mouse from a state that they pass
    this.#lines = svg("g");
    this.#labels = svg("g");
    this.#draft = svg("path", { class: "e-draft", visibility: "hidden" });
    this.#world = svg("g", {}, this.#superstates, this.#lines, this.#states, this.#labels, this.#draft);
    this.#svg = svg("svg", { class: "e-diagram", role: "group", "aria-label": "diagram" }, svg("defs", {}, arrow), this.#world);
    parent.append(this.#svg);
    this.#svg.addEventListener("pointerdown", (event) => this.#press(event));
    this.#svg.addEventListener("dblclick", (event) => this.#open(event));
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
   * Draw a diagram.
   * @param {Diagram} diagram
   * @param {Object<string, Point>} kept places, by path
   * @param {Finding[]} findings
   */
  draw(diagram, kept, findings) {
    this.#diagram = diagram;
    this.#boxes = layOut(diagram, kept);
    this.#index();
    this.#stateElements.clear();
    this.#transitionElements.clear();
    const plain = [], around = [];
    for (const state of diagram.nodes) (this.#children.has(state.id) ? around : plain).push(this.#state(state));
    this.#superstates.replaceChildren(...around);
    this.#states.replaceChildren(...plain);
    this.#makeTransitions();
    for (const id of this.#transitionElements.keys()) this.#drawLine(id);
    this.#mark(findings);
    this.select(this.#selection);
    if (this.#isFresh && diagram.nodes.length > 0) {
      this.#isFresh = false;
      this.fit();
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
  #state({ id, name, parent, template, final, source }) {
    const box = this.#boxes.get(id);
    const isSuper = this.#children.has(id);
    const initial = parent === "" ? this.#diagram.initial : this.#initials.get(parent);
    const kinds = ["e-state", isSuper && "e-super", final && "e-final", !source && "e-foreign"];
    const group = svg("g", {
      class: kinds.filter(Boolean).join(" "), "data-state": id, tabindex: 0, role: "button", "aria-label": `state ${id}`,
    },
    svg("rect", { width: box.width, height: box.height, rx: 8 }),
    svg("text", { x: isSuper ? 12 : box.width / 2, y: isSuper ? 20 : 27, class: isSuper ? "e-name e-left" : "e-name" },
      template ? `${name} : ${template}` : name));
    if (initial === id) group.append(svg("circle", { cx: 0, cy: isSuper ? 15 : box.height / 2, r: 5, class: "e-initial" }));
    if (final) group.append(svg("rect", { x: 3, y: 3, width: box.width - 6, height: box.height - 6, rx: 6, class: "e-inner" }));
    group.append(svg("circle", {
      cx: box.width, cy: this.#handleHeight(id), r: HANDLE, class: "e-handle",
    }, svg("title", {}, "drag to another state: a new transition")));
    this.#stateElements.set(id, group);
    this.#place(id);
    return group;
  }

  #makeTransitions() {
    this.#touching.clear();
    const lanes = new Map();
    const lines = [], labels = [];
    for (const { id, source: state, target: to, event, order, when } of this.#diagram.edges) {
      if (!this.#boxes.has(state) || !this.#boxes.has(to)) continue;
      const pair = [state, to].sort().join(" ");
      const count = lanes.get(pair) ?? 0;
      lanes.set(pair, count + 1);
      const bent = Math.ceil(count / 2) * (count % 2 === 1 ? 1 : -1) + 0.5;
      const lane = state < to ? bent : -bent;
      const kind = event === "tick" ? "" : ` e-${event}`;
      const path = svg("path", { class: "e-line", "marker-end": "url(#e-arrow)" });
      const hit = svg("path", { class: "e-hit" });
      const group = svg("g", { class: `e-transition${kind}`, "data-transition": id, tabindex: 0, role: "button",
        "aria-label": `transition from ${state} to ${to}${when ? ` when ${when}` : ""}` }, hit, path);
      const words = event === "tick" ? `${order + 1}${when ? `: ${shorten(when)}` : ""}` : this.#words[event];
      const label = svg("text", { class: "e-label", "data-transition": id, "data-words": words }, words);
      lines.push(group);
      labels.push(label);
      this.#transitionElements.set(id, { group, path, hit, label, lane });
      for (const end of new Set([state, to])) this.#touching.set(end, [...(this.#touching.get(end) ?? []), id]);
    }
    this.#lines.replaceChildren(...lines);
    this.#labels.replaceChildren(...labels);
  }

  /** @param {string} path */
  #place(path) {
    const { x, y } = this.#boxes.get(path);
    this.#stateElements.get(path).setAttribute("transform", `translate(${x},${y})`);
  }

  /** @param {string} id */
  #drawLine(id) {
    const elements = this.#transitionElements.get(id);
    const { source, target } = this.#edges.get(id);
    const drawn = line(this.#boxes.get(source), this.#boxes.get(target), elements.lane);
    elements.path.setAttribute("d", drawn.path);
    elements.hit.setAttribute("d", drawn.path);
    elements.label.setAttribute("x", drawn.label.x.toFixed(1));
    elements.label.setAttribute("y", drawn.label.y.toFixed(1));
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
  }

  /**
   * Show what flies.
   * @param {Set<string>} active states
   * @param {Map<string, number>} counts how often each transition was taken
   * @param {Set<string>} taken transitions that were taken just now
   */
  light(active, counts, taken) {
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
    for (const [path, group] of this.#stateElements) group.classList.toggle("e-lost", path === id);
  }

  /** Show all of it. */
  fit() {
    const { width, height } = this.#svg.getBoundingClientRect();
    let right = 1, bottom = 1;
    for (const box of this.#boxes.values()) {
      right = Math.max(right, box.x + box.width + 40);
      bottom = Math.max(bottom, box.y + box.height + 24);
    }
    const scale = Math.min(1.2, Math.max(ZOOM.least, Math.min(width / right, height / bottom)));
    this.#view = { x: Math.max(0, (width - right * scale) / 2), y: 0, scale };
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
    const handle = this.#handleAt(this.#point(event));
    if (handle !== null) this.#drag(event, this.#joining(handle));
    else {
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
    const lines = new Set(family.flatMap((each) => this.#touching.get(each) ?? []));
    const moveBy = (dx, dy) => {
      for (const each of family) {
        const box = before.get(each), now = this.#boxes.get(each);
        if (!now) continue; // it was deleted in another window meanwhile
        Object.assign(now, { x: box.x + dx, y: box.y + dy });
        this.#place(each);
      }
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
          this.#listener.moved(path, around);
          return;
        }
        const siblings = this.#children.get(parent) ?? [];
        const outer = parent ? this.#boxes.get(parent) : null;
        // All states of the level are kept, so that none of them jumps when this one has a place of its own.
        this.#listener.placed(Object.fromEntries(
          siblings.map((each) => [each, placeWithin(this.#boxes.get(each), outer)])));
      },
    };
  }

  /** @param {string} from */
  #joining(from) {
    const box = this.#boxes.get(from);
    const target = (event) => this.#stateAt(this.#point(event));
    return {
      move: (event) => {
        const { x, y } = this.#point(event);
        this.#draft.setAttribute("visibility", "visible");
        this.#draft.setAttribute("d", `M${box.x + box.width},${box.y + Math.min(box.height / 2, 22)}L${x},${y}`);
        const over = target(event);
        for (const [path, group] of this.#stateElements) group.classList.toggle("e-target", path === over);
      },
      end: (event, wasMoved) => {
        this.#draft.setAttribute("visibility", "hidden");
        for (const group of this.#stateElements.values()) group.classList.remove("e-target");
        const to = wasMoved ? target(event) : null;
        if (to !== null) this.#listener.joined(from, to);
      },
    };
  }
}
