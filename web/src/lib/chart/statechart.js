import { onBeat } from "../beat.js";
import { make, number, setAttribute, setText } from "../dom.js";
import { drawDiagram, forget } from "./diagram.js";
import { PanZoom } from "./panzoom.js";

/** A mission's diagram with its active state lit, and its last transitions. */
export class Statechart {
  #root;
  #title;
  #state;
  #seconds;
  #picture;
  #words;
  #rows;
  #table;
  #source;
  #buttons;
  #pan = null;
  #nodes = new Map();
  #lit = [];
  #chart = null;
  #active = null;
  #entered = 0;
  #mode;
  #shown = null;
  #diagram = null;

  /**
   * @param {HTMLElement} element an empty box
   * @param {{small?: boolean, live?: boolean}} [options] small: beside other things, it follows the active state
   *   from the start; live: seconds count on between two calls (default)
   */
  constructor(element, { small = false, live = true } = {}) {
    this.#mode = small || innerWidth < 700 ? "follow" : "whole";
    this.#title = make("span", { class: "m-mission" });
    this.#state = make("output", { class: "m-state", "aria-live": "off" });
    this.#seconds = make("span", { class: "m-state-seconds" });
    this.#words = make("p", { class: "m-chart-words" }, "no mission is heard of");
    this.#picture = make("div", { class: "m-chart-picture", tabindex: "0", role: "group", "aria-label": "diagram of the mission" });
    this.#picture.append(this.#words);
    this.#picture.addEventListener("keydown", (event) => this.#key(event));
    const head = make("div", { class: "m-chart-head" }, this.#title, this.#state, this.#seconds, this.#makeButtons());
    this.#rows = make("tbody");
    this.#table = this.#makeTable();
    this.#source = make("pre", { class: "m-source-text", tabindex: "0", "aria-label": "the mission as written" });
    const written = make("details", { class: "m-written" }, make("summary", {}, "the mission as written (YAML)"), this.#source);
    const past = make("div", { class: "m-transitions" }, this.#table);
    this.#root = make("div", { class: small ? "m-chart m-small" : "m-chart", "data-state": "" }, head, this.#picture, past, written);
    element.append(this.#root);
    if (live) setInterval(() => onBeat(this.#seconds, () => this.#count()), 200);
  }

  /** @param {{name: string, mermaid: string, states: string[], source: string}|null} chart */
  async setChart(chart) {
    const same = chart && this.#chart && chart.mermaid === this.#chart.mermaid && chart.name === this.#chart.name;
    this.#chart = chart;
    setText(this.#title, chart?.name ?? "");
    setText(this.#source, chart?.source ?? "");
    if (same) return;
    this.#nodes.clear();
    this.#lit = [];
    this.#pan = null;
    this.#shown = null;
    if (!chart) return this.#say("no mission is heard of");
    this.#say("drawing the diagram");
    try {
      const { clientWidth: wide, clientHeight: high } = this.#picture;
      const diagram = await drawDiagram(chart.mermaid, wide > 1.2 * high ? "LR" : "TB");
      if (this.#chart !== chart) return forget(diagram); // another came meanwhile
      this.#take(diagram);
    } catch (error) {
      console.info(`the diagram cannot be drawn: ${error.message}`);
      if (this.#chart === chart) this.#say("the diagram cannot be drawn; the states and transitions stand below");
    }
  }

  /** Id of the state that is lit; null if there is none. */
  get active() {
    return this.#active;
  }

  /**
   * @param {string|null} id of the active state
   * @param {number} [seconds] in it so far; it counts on by itself
   */
  setState(id, seconds = 0) {
    const isNew = id !== this.#active;
    this.#active = id;
    this.#entered = performance.now() - 1000 * (seconds ?? 0);
    if (!isNew) return onBeat(this.#seconds, () => this.#count(seconds));
    this.#count(seconds);
    setAttribute(this.#root, "data-state", id ?? "");
    setText(this.#state, id ?? "");
    this.#light();
  }

  /** @param {object[]} list as in the message "transitions", newest first */
  setTransitions(list) {
    this.#rows.replaceChildren(...list.slice(0, 10).map((each) => this.#row(each)));
    this.#table.hidden = list.length === 0;
  }

  #say(words) {
    setText(this.#words, words);
    this.#picture.replaceChildren(this.#words);
  }

  /** @param {import("./diagram.js").Diagram} diagram */
  #take(diagram) {
    forget(this.#diagram);
    this.#diagram = diagram;
    const { svg } = diagram;
    this.#picture.replaceChildren(svg);
    // Mermaid names a state's node SVG-state-ID-NUMBER and a superstate's carries its id as data-id.
    const head = `${svg.id}-state-`;
    for (const node of /** @type {NodeListOf<SVGGElement>} */ (svg.querySelectorAll("g.statediagram-state"))) {
      const isSuper = node.classList.contains("statediagram-cluster");
      const id = isSuper ? node.dataset.id : node.id.replace(head, "").replace(/-\d+$/, "");
      if (id) this.#nodes.set(id, node);
    }
    this.#pan = new PanZoom(this.#picture, svg, () => this.#setMode("free"));
    this.#light();
    if (this.#mode === "whole") this.#pan.whole();
  }

  /** Light the active state and all that it lies in. */
  #light() {
    for (const node of this.#lit) node.classList.remove("m-active", "m-around");
    this.#lit = [];
    if (this.#active === null) return;
    const parts = this.#active.split(".");
    for (let length = parts.length; length > 0; length -= 1) {
      const node = this.#nodes.get(parts.slice(0, length).join("."));
      if (!node) continue;
      node.classList.add(length === parts.length ? "m-active" : "m-around");
      this.#lit.push(node);
    }
    this.#follow();
  }

  /** Show the superstate that the active state lies in; in a narrow box, the state itself and its neighbours. */
  #follow() {
    if (this.#mode !== "follow" || !this.#pan || this.#lit.length === 0) return;
    const [leaf, around] = [this.#lit[0], this.#lit[1] ?? this.#lit[0]];
    const wide = this.#picture.clientWidth;
    const part = boxOf(around);
    const scale = Math.min(wide / part.width, this.#picture.clientHeight / part.height);
    const target = scale < 0.55 ? nearby(boxOf(leaf), part, wide / 0.62, this.#picture.clientHeight / 0.62) : part;
    const name = JSON.stringify([target.x, target.y, target.width, target.height].map(Math.round));
    if (name === this.#shown) return;
    this.#shown = name;
    this.#pan.show(target);
  }

  /** @param {"follow"|"whole"|"free"} mode free: as somebody moved it */
  #setMode(mode) {
    this.#mode = mode;
    this.#shown = null;
    for (const name of ["follow", "whole"]) setAttribute(this.#buttons[name], "aria-pressed", String(mode === name));
    if (mode === "whole") this.#pan?.whole();
    this.#follow();
  }

  #makeButtons() {
    const bar = make("span", { class: "m-chart-buttons small-buttons", role: "toolbar", "aria-label": "view of the diagram" });
    const add = (name, words, label, act) => {
      const button = make("button", { type: "button", "aria-label": label, title: label }, words);
      button.addEventListener("click", act);
      bar.append(button);
      return button;
    };
    const zoom = (factor) => { this.#setMode("free"); this.#pan?.zoom(factor); };
    this.#buttons = {
      follow: add("follow", "Follow", "follow the active state", () => this.#setMode(this.#mode === "follow" ? "free" : "follow")),
      whole: add("whole", "Whole", "show the whole diagram", () => this.#setMode("whole")),
      out: add("out", "−", "go away", () => zoom(1 / 1.35)),
      nearer: add("nearer", "+", "come nearer", () => zoom(1.35)),
    };
    for (const name of ["follow", "whole"]) setAttribute(this.#buttons[name], "aria-pressed", String(this.#mode === name));
    return bar;
  }

  #makeTable() {
    const names = ["time", "from", "to", "because", "values", "was in it"];
    const row = make("tr", {}, ...names.map((name) => make("th", { scope: "col" }, name)));
    const caption = make("caption", {}, "last transitions");
    const table = make("table", { hidden: true }, caption, make("thead", {}, row), this.#rows);
    return table;
  }

  #row({ time_s, from, to, when, values, seconds }) {
    const told = (values ?? []).map(([name, value]) => `${name} = ${written(value)}`).join(", ");
    const cell = (name, text) => make("td", { "data-name": name }, text);
    return make(
      "tr", {}, cell("time", `${number(time_s)} s`), cell("from", from || "start"), cell("to", to),
      cell("because", when || "at once"), cell("values", told), cell("was in it", `${number(seconds)} s`),
    );
  }

  #count(seconds = (performance.now() - this.#entered) / 1000) {
    setText(this.#seconds, this.#active === null ? "" : `for ${number(seconds)} s`);
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.#pan) return;
    if (event.key === "0") this.#setMode("whole");
    else if (!this.#pan.key(event.key)) return;
    event.preventDefault();
  }
}

/** Where a node is in the drawing's own measure. */
function boxOf(node) {
  const box = node.getBBox();
  const turn = node.ownerSVGElement.getScreenCTM().inverse().multiply(node.getScreenCTM());
  const [from, to] = [new DOMPoint(box.x, box.y), new DOMPoint(box.x + box.width, box.y + box.height)].map(
    (point) => point.matrixTransform(turn));
  return new DOMRect(from.x, from.y, to.x - from.x, to.y - from.y);
}

/** A window about a leaf, no larger than its superstate. */
function nearby(leaf, around, width, height) {
  const along = (middle, low, size, wanted) => {
    if (size <= wanted) return [low, size];
    return [Math.min(Math.max(low, middle - wanted / 2), low + size - wanted), wanted];
  };
  const [x, w] = along(leaf.x + leaf.width / 2, around.x, around.width, width);
  const [y, h] = along(leaf.y + leaf.height / 2, around.y, around.height, height);
  return new DOMRect(x, y, w, h);
}

function written(value) {
  if (value === null) return "∞";
  if (typeof value === "number" && !Number.isInteger(value)) return String(Number(value.toPrecision(4)));
  return String(value);
}
