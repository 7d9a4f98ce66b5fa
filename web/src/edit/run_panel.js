/** Flying the mission from its page: one flight with pause, step and breaks, or many on random layouts. */
import { make, number, setText } from "../lib/dom.js";
import { button, choice, textField } from "./fields.js";
import { Flights } from "./flights.js";
import { drawStrip } from "./state_strip.js";
import { TopView } from "./top_view.js";
import { word } from "./words.js";

/** @typedef {import("./flights.js").Now} Now @typedef {import("./flights.js").Flight} Flight */

const SPEEDS = /** @type {[string, string][]} */ ([["0.2", "0.2 ×"], ["1", "1 ×"], ["5", "5 ×"], ["", "max"]]);
const BATCH = 20;

export class RunPanel {
  #root;
  #listener;
  #flights;
  #run = "";
  #batch = "";
  #scenario = "test-case-1";
  #level = "calm";
  #speed = "1";
  /** @type {Set<string>} */
  #breaks = new Set();
  /** @type {Object<string, number>} */
  #counts = {};
  /** @type {{state: string, from_s: number, to_s: number}[]} */
  #spans = [];
  /** @type {Flight[]} */
  #rows = [];
  #line;
  #strip;
  #guards;
  #values;
  #table;
  #choices;
  #pause;
  #view;

  /**
   * @param {HTMLElement} root
   * @param {{text: () => Promise<string>, lit: (active: string[], counts: Object<string, number>, taken: string[]) => void,
   *   lost: (state: string) => void, selected: () => string, live: (message: any) => void}} listener live: told how the flight
   *   in the real simulator stands; text: of the mission; selected: id of the selected state
   */
  constructor(root, listener) {
    this.#root = root;
    this.#listener = listener;
    this.#line = make("p", { role: "status", class: "e-run-line" }, word("not_flying"));
    this.#strip = make("div", { class: "e-strip", role: "img", "aria-label": word("time_line") });
    this.#guards = make("ul", { class: "e-guards" });
    this.#values = make("dl", { class: "e-read" });
    this.#table = make("table", { class: "e-batch" });
    this.#choices = make("div", { class: "e-row" });
    this.#pause = button(word("pause"), () => this.#togglePause());
    const drawing = make("div", { class: "e-top-view" });
    this.#view = new TopView(drawing);
    root.classList.add("e-fly");
    root.append(drawing, make("div", {},
      this.#choices,
      make("div", { class: "e-row" },
        button(word("fly_once"), () => this.#start(false), { class: "e-first" }),
        button(word("fly_paused"), () => this.#start(true)),
        this.#pause, button(word("step"), () => this.#order({ do: "step", ticks: 1 })),
        button(word("break_here"), () => this.#toggleBreak()),
        button(word("take_changes"), () => this.#change()),
        button(word("stop"), () => this.#order({ do: "stop" })),
        button(word("fly_many", { count: String(BATCH) }), () => this.#startBatch())),
      this.#line, this.#strip, make("div", { class: "e-run-columns" }, this.#guards, this.#values), this.#table));
    this.#flights = new Flights({ heard: (message) => this.#hear(message), lost: () => this.#forget() });
    this.#loadChoices();
  }

  async #loadChoices() {
    const answer = await fetch("/api/editing/choices");
    if (!answer.ok) return;
    const { scenarios, lessons, levels } = await answer.json();
    const words = (list) => list.map((each) => /** @type {[string, string]} */ ([each, each]));
    this.#choices.replaceChildren(
      choice(word("scenario"), words([...scenarios, ...lessons]), this.#scenario, (value) => { this.#scenario = value; }),
      textField(word("or_layout"), "", (value) => { this.#scenario = value || "test-case-1"; }, { placeholder: "calm-17" }),
      choice(word("speed"), SPEEDS, this.#speed, (value) => {
        this.#speed = value;
        if (this.#run) this.#order({ do: "speed", speed: value ? Number(value) : null });
      }),
      choice(word("level"), words(levels), this.#level, (value) => { this.#level = value; }));
  }

  /** Fly in a scenario from now on. @param {string} scenario */
  choose(scenario) {
    this.#scenario = scenario;
    this.#loadChoices();
  }

  /** Show a flight that is over. @param {Flight} flight */
  showFlight(flight) {
    this.#view.show(flight.layout, flight.track);
    this.#listener.lit([], flight.counts, []);
    setText(this.#line, flight.reason);
  }

  async #start(paused) {
    setText(this.#line, word("starting"));
    const text = await this.#listener.text();
    if (this.#run) await this.#flights.ask({ do: "stop", run: this.#run });
    this.#counts = {};
    this.#spans = [];
    this.#view.clear();
    const answer = await this.#flights.ask({
      do: "start", text, scenario: this.#scenario, seed: 0, speed: this.#speed ? Number(this.#speed) : null, paused, break_on: [...this.#breaks],
    });
    if (answer.kind === "started") {
      this.#run = answer.run;
      setText(this.#line, word("starting"));
    } else setText(this.#line, answer.text);
  }

  async #order(request) {
    if (!this.#run) {
      setText(this.#line, word("not_flying"));
      return;
    }
    const answer = await this.#flights.ask({ ...request, run: this.#run });
    if (answer.kind === "refused") setText(this.#line, answer.text);
  }

  #togglePause() {
    return this.#order({ do: this.#root.classList.contains("e-paused") ? "go_on" : "pause" });
  }

  #toggleBreak() {
    const id = this.#listener.selected();
    if (!id) {
      setText(this.#line, word("select_state"));
      return;
    }
    if (this.#breaks.has(id)) this.#breaks.delete(id);
    else this.#breaks.add(id);
    setText(this.#line, this.#breaks.size > 0 ? word("breaks", { states: [...this.#breaks].join(", ") }) : word("no_breaks"));
    if (this.#run) this.#order({ do: "break_on", states: [...this.#breaks] });
  }

  async #change() {
    await this.#order({ do: "change", text: await this.#listener.text() });
  }

  async #startBatch() {
    setText(this.#line, word("starting"));
    const text = await this.#listener.text();
    this.#rows = [];
    this.#table.replaceChildren();
    const answer = await this.#flights.ask({ do: "start_batch", text, level: this.#level, count: BATCH, first_seed: 1 });
    if (answer.kind === "batch_started") {
      this.#batch = answer.batch;
      setText(this.#line, word("flying_many", { count: String(answer.count) }));
    } else setText(this.#line, answer.text);
  }

  #forget() {
    this.#run = "";
    this.#batch = "";
    this.#root.classList.remove("e-paused");
  }

  /** Ask for something that is no flight of this panel. @param {object} request @returns {Promise<any>} the answer */
  ask(request) {
    return this.#flights.ask(request);
  }

  #hear(message) {
    if (message.kind === "live") this.#listener.live(message);
    if (message.kind === "now" && message.run === this.#run) this.#showNow(message);
    else if (message.kind === "ended" && message.run === this.#run) {
      this.#run = "";
      this.#root.classList.remove("e-paused");
      setText(this.#line, message.text);
      this.#listener.lit([], message.counts, []);
      this.#listener.lost(message.lost_in);
    } else if (message.kind === "flight" && message.batch === this.#batch) this.#showFlight(message);
    else if (message.kind === "batch_ended" && message.batch === this.#batch && message.text) setText(this.#line, message.text);
  }

  /** @param {Now} now */
  #showNow(now) {
    this.#counts = now.full ? now.counts : { ...this.#counts, ...now.counts };
    this.#spans = now.full ? now.spans : [...this.#spans, ...now.spans];
    this.#root.classList.toggle("e-paused", now.paused);
    setText(this.#pause, word(now.paused ? "go_on" : "pause"));
    const where = `${number(now.time_s, 1)} s: ${now.state} (${number(now.seconds_in_state, 1)} s)`;
    setText(this.#line, now.paused ? word("paused_in", { where }) : where);
    this.#listener.lit(now.active, this.#counts, now.taken.flatMap(({ ids }) => ids));
    this.#view.add(now.full, now.trail, now.pose);
    const sign = { true: "✓", false: "✗", null: "?" };
    this.#guards.replaceChildren(...now.guards.map(({ to, when, holds }) => make("li", { "data-holds": String(holds) },
      `${sign[String(holds)]} ${when || word("always")} → ${to}`)));
    this.#values.replaceChildren(...now.values.flatMap(({ name, value, unit }) => [
      make("dt", {}, name), make("dd", {}, typeof value === "number" ? `${number(value, 2)} ${unit}` : String(value))]));
    this.#showStrip(now);
  }

  /** @param {Now} now */
  #showStrip(now) {
    const all = [...this.#spans, { state: now.state, from_s: now.time_s - now.seconds_in_state, to_s: now.time_s }];
    drawStrip(this.#strip, all, { end_s: now.time_s });
  }

  /** @param {Flight} flight */
  #showFlight(flight) {
    this.#rows.push(flight);
    this.#rows.sort((a, b) => a.rank - b.rank);
    const head = make("tr", {}, ...["scenario", "verdict", "lost_in", "seconds"].map((key) => make("th", {}, word(/** @type {any} */ (key)))));
    this.#table.replaceChildren(head, ...this.#rows.map((each) => {
      const show = button(each.scenario, () => {
        this.showFlight(each);
        this.#listener.lost(each.lost_in);
      }, { class: "e-link" });
      return make("tr", { "data-completed": String(each.completed) },
        make("td", {}, show), make("td", {}, each.verdict), make("td", {}, each.lost_in), make("td", {}, number(each.total_time_s, 1)));
    }));
    setText(this.#line, word("flown_many", {
      flown: String(this.#rows.length), completed: String(this.#rows.filter(({ completed }) => completed).length),
    }));
  }
}
