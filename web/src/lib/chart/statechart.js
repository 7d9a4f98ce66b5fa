import { onBeat } from "../beat.js";
import { make, number, setAttribute, setText } from "../dom.js";
import { DiagramView } from "../diagram/diagram_view.js";
import { readMermaid } from "../diagram/from_mermaid.js";
import { lookAt } from "../diagram/look.js";
import { reasonOf } from "../request.js";

/** @import {Live} from "../messages.js" */
/**
 * @typedef {{name: string, mermaid: string, states: string[], source: string}} Chart
 * @typedef {Record<"follow"|"whole"|"out"|"nearer", HTMLButtonElement>} Buttons
 */

const NONE = "no mission yet; fly one: framerunner fly test-case-1";

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
  /** @type {Buttons|undefined} made by the constructor */
  #buttons;
  #view;
  /** @type {Chart|null} */
  #chart = null;
  /** @type {string|null} */
  #active = null;
  #entered = 0;

  /**
   * @param {HTMLElement} element an empty box
   * @param {{small?: boolean, live?: boolean}} [options] small: beside other things; live: seconds count on between
   *   two calls (default)
   */
  constructor(element, { small = false, live = true } = {}) {
    this.#title = make("span", { class: "m-mission" });
    this.#state = make("output", { class: "m-state", "aria-live": "off" });
    this.#seconds = make("span", { class: "m-state-seconds" });
    this.#words = make("p", { class: "m-chart-words" }, NONE);
    this.#picture = make("div", { class: "m-chart-picture", tabindex: "0", role: "group", "aria-label": "diagram of the mission" });
    this.#view = new DiagramView(this.#picture, { done: "when finished", resume: "after a pause" }, { isEdited: false, wheelNeeds: this.#picture });
    lookAt(this.#view, this.#picture);
    this.#view.viewport.onTouched = () => this.#setMode("free");
    this.#picture.append(this.#words);
    this.#picture.addEventListener("keydown", (event) => {
      if (event.key === "0" && !event.ctrlKey && !event.metaKey) this.#setMode("whole");
    });
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

  /** @param {Chart|null} chart */
  setChart(chart) {
    const same = chart && this.#chart && chart.mermaid === this.#chart.mermaid && chart.name === this.#chart.name;
    this.#chart = chart;
    setText(this.#title, chart?.name ?? "");
    setText(this.#source, chart?.source ?? "");
    if (same) return;
    this.#say(chart ? "" : NONE);
    if (!chart) return;
    try {
      this.#view.forget();
      this.#view.draw(readMermaid(chart.mermaid), {}, []);
      this.#light();
      this.#setMode("follow");
    } catch (error) {
      console.info(`the diagram cannot be drawn: ${reasonOf(error)}`);
      this.#say("the diagram cannot be drawn; the states and transitions stand below");
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

  /** @param {Live.Transition[]} list newest first */
  setTransitions(list) {
    this.#rows.replaceChildren(...list.slice(0, 10).map((each) => this.#row(each)));
    this.#table.hidden = list.length === 0;
  }

  /** Say something in place of the diagram; "": show the diagram. @param {string} words */
  #say(words) {
    setText(this.#words, words);
    this.#words.hidden = words === "";
    setAttribute(this.#view.root, "visibility", words === "" ? null : "hidden");
  }

  /** Light the active state and all that it lies in. */
  #light() {
    const parts = this.#active?.split(".") ?? [];
    this.#view.light(new Set(parts.map((_, index) => parts.slice(0, index + 1).join("."))), new Map(), new Set());
  }

  /** @param {"follow"|"whole"|"free"} mode follow: the active state with as much around it as can be read; free: as somebody moved it */
  #setMode(mode) {
    for (const name of /** @type {const} */ (["follow", "whole"])) {
      setAttribute(/** @type {Buttons} */ (this.#buttons)[name], "aria-pressed", String(mode === name));
    }
    if (mode === "free") this.#view.hold();
    else if (mode === "whole") this.#view.whole();
    else this.#view.fit();
  }

  #makeButtons() {
    const bar = make("span", { class: "m-chart-buttons small-buttons", role: "toolbar", "aria-label": "view of the diagram" });
    /** @param {string} name @param {string} words @param {string} label @param {() => void} act */
    const add = (name, words, label, act) => {
      const button = make("button", { type: "button", "aria-label": label, title: label }, words);
      button.addEventListener("click", act);
      bar.append(button);
      return button;
    };
    /** @param {number} factor */
    const zoom = (factor) => {
      this.#setMode("free");
      this.#view.viewport.zoom(factor);
    };
    this.#buttons = {
      follow: add(
        "follow", "Follow", "follow the active state, with as much around it as can be read",
        () => this.#setMode(/** @type {Buttons} */ (this.#buttons).follow.getAttribute("aria-pressed") === "true"
          ? "free" : "follow")),
      whole: add("whole", "Whole", "show the whole diagram", () => this.#setMode("whole")),
      out: add("out", "−", "go away", () => zoom(1 / 1.35)),
      nearer: add("nearer", "+", "come nearer", () => zoom(1.35)),
    };
    setAttribute(this.#buttons.follow, "aria-pressed", "true");
    return bar;
  }

  #makeTable() {
    const names = ["time", "from", "to", "because", "values", "was in it"];
    const row = make("tr", {}, ...names.map((name) => make("th", { scope: "col" }, name)));
    const caption = make("caption", {}, "last transitions");
    const table = make("table", { hidden: true }, caption, make("thead", {}, row), this.#rows);
    return table;
  }

  /** @param {Live.Transition} transition */
  #row({ time_s, from, to, when, values, seconds }) {
    const told = (values ?? []).map(([name, value]) => `${name} = ${written(value)}`).join(", ");
    /** @param {string} name @param {string} text */
    const cell = (name, text) => make("td", { "data-name": name }, text);
    return make(
      "tr", {}, cell("time", `${number(time_s)} s`), cell("from", from || "start"), cell("to", to),
      cell("because", when || "at once"), cell("values", told), cell("was in it", `${number(seconds)} s`),
    );
  }

  #count(seconds = (performance.now() - this.#entered) / 1000) {
    setText(this.#seconds, this.#active === null ? "" : `for ${number(seconds)} s`);
  }
}

/** @param {number|boolean|string|null} value */
function written(value) {
  if (value === null) return "∞";
  if (typeof value === "number" && !Number.isInteger(value)) return String(Number(value.toPrecision(4)));
  return String(value);
}
