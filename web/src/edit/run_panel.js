/** Flying the mission from its page: one flight with pause, step and breaks, or many on random layouts. */
import { make, number, setText } from "../lib/dom.js";
import { button, choice } from "./fields.js";
import { FlightView } from "./flight_view.js";
import { Flights } from "./flights.js";
import { FIRST_SCENARIO, loadChoices, options, scenarioFields } from "./scenario_fields.js";
import { drawStrip } from "./state_strip.js";
import { contactsOf, hitWords, shortVerdict, verdictWords } from "./verdict.js";
import { waitingWords, word } from "./words.js";

/**
 * @import {Answer, Flight, Now, Request} from "./flights.js"
 * @import {Flights as Messages} from "../lib/messages.js"
 * @typedef {Extract<Request, {run: string}>} ToRun what is asked of a run
 * @typedef {ToRun extends infer Each ? Each extends any ? Omit<Each, "run"> : never : never} Order
 * @typedef {Messages.Ended & {result: import("./verdict.js").Result|null}} Judged
 */

const SPEEDS = /** @type {[string, string][]} */ ([["0.2", "0.2 ×"], ["1", "1 ×"], ["5", "5 ×"], ["", word("fastest")]]);
const BATCH = 20;

export class RunPanel {
  #root;
  #listener;
  #flights;
  #waits = ""; // id of a flight or batch whose turn it is not yet
  #run = "";
  #batch = "";
  #scenario = FIRST_SCENARIO;
  #level = "calm";
  #speed = "1";
  #isStopped = false; // by the button
  /** @type {any} */
  #layout = null;
  /** @type {Set<string>} */
  #breaks = new Set();
  /** @type {Object<string, number>} */
  #counts = {};
  /** @type {{state: string, from_s: number, to_s: number}[]} */
  #spans = [];
  /** @type {{name: string, time_s: number}[]} since the motors started */
  #contacts = [];
  /** @type {Flight[]} */
  #rows = [];
  #line = make("p", { role: "status", class: "e-run-line" }, word("not_flying"));
  #hit = make("p", { role: "status", class: "e-touched" });
  #strip = make("div", { class: "e-strip", role: "img", "aria-label": word("time_line") });
  #guards = make("ul", { class: "e-guards" });
  #values = make("dl", { class: "e-read" });
  #table = make("table", { class: "e-batch" });
  #progress = make("progress", { class: "e-progress", hidden: true, "aria-label": word("fly") });
  #choices = make("div", { class: "e-row" });
  #pause;
  #stop;
  #view;

  /**
   * @param {HTMLElement} root
   * @param {{text: () => Promise<string>, mistake: () => string, lit: (active: string[], counts: Object<string, number>, taken: string[]) => void,
   *   lost: (state: string) => void, selected: () => string, live: (message: any) => void}} listener text: of the mission; mistake: that
   *   keeps it from flying, "" if there is none, asked after the text; selected: id of the selected state; live: told how the flight in
   *   the real simulator stands
   * @param {boolean} isSimple without what a beginner does not need
   */
  constructor(root, listener, isSimple) {
    this.#root = root;
    this.#listener = listener;
    this.#pause = button(word("pause"), () => this.#togglePause(), { disabled: true });
    this.#stop = button(word("stop"), () => this.#stopFlight(), { disabled: true });
    const drawing = make("div", { class: "e-top-view" });
    this.#view = new FlightView(drawing);
    const speed = choice(word("speed"), SPEEDS, this.#speed, (value) => {
      this.#speed = value;
      if (this.#run) this.#order({ kind: "speed", speed: value ? Number(value) : null });
    });
    root.classList.add("e-fly");
    root.classList.toggle("e-simple", isSimple);
    root.append(drawing, make("div", { class: "e-flying" },
      make("div", { class: "e-controls" },
        make("div", { class: "e-row" },
          button(word("fly_once"), () => this.#start(false), { class: "e-first", title: word("fly_hint") }),
          this.#pause, button(word("step"), () => this.#step(), { title: word("step_hint") }), this.#stop, speed),
        this.#line, this.#progress, this.#hit),
      this.#strip,
      make("div", { class: "e-run-columns" },
        make("section", {}, make("h3", {}, word("goes_on")), this.#guards), make("section", {}, make("h3", {}, word("reads")), this.#values)),
      make("section", { class: "e-more" }, make("h3", {}, word("more")), this.#choices,
        make("div", { class: "e-row" },
          button(word("fly_many", { count: String(BATCH) }), () => this.#startBatch()),
          button(word("break_here"), () => this.#toggleBreak()), button(word("take_changes"), () => this.#change()))),
      this.#table));
    this.#flights = new Flights({ heard: (message) => this.#hear(message), lost: () => this.#forget() });
    this.#loadChoices();
  }

  async #loadChoices() {
    const choices = await loadChoices();
    if (!choices) return;
    this.#choices.replaceChildren(
      ...scenarioFields(choices, this.#scenario, (scenario) => { this.#scenario = scenario; }),
      choice(word("level"), options(choices.levels), this.#level, (value) => { this.#level = value; }));
  }

  /** Fly in a scenario from now on. @param {string} scenario @param {boolean} isSimple without what a beginner does not need */
  choose(scenario, isSimple) {
    this.#scenario = scenario;
    this.#root.classList.toggle("e-simple", isSimple);
    this.#loadChoices();
  }

  /** Show a flight that is over; what it was worth, in words. @param {Flight} flight @returns {string} */
  showFlight(flight) {
    const result = /** @type {import("./verdict.js").Result} */ (flight.result);
    const contacts = contactsOf(result);
    this.#view.show(flight.layout, flight.track, contacts);
    this.#listener.lit([], flight.counts, []);
    const words = verdictWords(result, flight.layout, this.#view.places);
    setText(this.#line, words);
    setText(this.#hit, hitWords(contacts));
    return [words, hitWords(contacts)].filter(Boolean).join(" ");
  }

  /** @param {string} run its id; "": none */
  #setRun(run) {
    this.#run = run;
    this.#waits = "";
    this.#pause.toggleAttribute("disabled", !run);
    this.#stop.toggleAttribute("disabled", !run);
    if (run) return;
    this.#root.classList.remove("e-paused");
    setText(this.#pause, word("pause"));
  }

  /** The mission's text, if it can fly; otherwise says why not. @returns {Promise<string>} */
  async #text() {
    const text = await this.#listener.text();
    const mistake = this.#listener.mistake();
    setText(this.#line, mistake ? word("mistake", { mistake }) : word("starting"));
    setText(this.#hit, "");
    return mistake ? "" : text;
  }

  /** @param {boolean} paused */
  async #start(paused) {
    if (this.#waits) return; // the line tells its place in the queue
    const text = await this.#text();
    if (!text) return;
    if (this.#run) await this.#flights.ask({ kind: "stop", run: this.#run });
    this.#counts = {};
    this.#spans = [];
    this.#contacts = [];
    this.#isStopped = false;
    const answer = await this.#flights.ask({
      kind: "start", text, scenario: this.#scenario, seed: 0, speed: this.#speed ? Number(this.#speed) : null, paused, break_on: [...this.#breaks],
    });
    if (answer.kind === "started") {
      this.#setRun(answer.run);
      this.#layout = answer.layout;
      this.#view.setWorld(answer.layout);
    } else {
      this.#setRun("");
      if (answer.kind === "refused") setText(this.#line, answer.text);
    }
  }

  /** Let one tick pass; a flight that is not yet there begins with a pause. */
  #step() {
    return this.#run ? this.#order({ kind: "step", ticks: 1 }) : this.#start(true);
  }

  #stopFlight() {
    if (this.#waits) return this.#flights.ask({ kind: "cancel", batch: this.#waits });
    this.#isStopped = true;
    return this.#order({ kind: "stop" });
  }

  /** @param {Order} request */
  async #order(request) {
    if (!this.#run) {
      setText(this.#line, word("not_flying"));
      return;
    }
    const answer = await this.#flights.ask({ ...request, run: this.#run });
    if (answer.kind === "refused") setText(this.#line, answer.text);
  }

  #togglePause() {
    return this.#order({ kind: this.#root.classList.contains("e-paused") ? "go_on" : "pause" });
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
    if (this.#run) this.#order({ kind: "break_on", states: [...this.#breaks] });
  }

  async #change() {
    await this.#order({ kind: "change", text: await this.#listener.text() });
  }

  async #startBatch() {
    const text = await this.#text();
    if (!text) return;
    this.#rows = [];
    this.#table.replaceChildren();
    const answer = await this.#flights.ask({ kind: "start_batch", text, level: this.#level, count: BATCH, first_seed: 1 });
    if (this.#waits) this.#setRun("");
    if (answer.kind === "batch_started") {
      this.#batch = answer.batch;
      this.#progress.max = answer.count;
      this.#showBatch();
      this.#table.scrollIntoView({ block: "nearest" });
    } else if (answer.kind === "refused") setText(this.#line, answer.text);
  }

  #forget() {
    this.#setRun("");
    this.#batch = "";
    this.#progress.hidden = true;
  }

  /**
   * Ask for something that is no flight of this panel.
   * @param {Request} request
   * @returns {Promise<Answer>}
   */
  ask(request) {
    return this.#flights.ask(request);
  }

  /** @param {Messages.ToPage} message */
  #hear(message) {
    if (message.kind === "live") this.#listener.live(message);
    else if (message.kind === "waiting") this.#wait(message);
    if (message.kind === "now" && message.run === this.#run) this.#showNow(message);
    else if (message.kind === "ended" && message.run === this.#run) {
      this.#setRun("");
      this.#showEnd(/** @type {Judged} */ (message));
      this.#listener.lit([], message.counts, []);
      this.#listener.lost(message.lost_in);
    } else if (message.kind === "flight" && message.batch === this.#batch) this.#showFlight(message);
    else if (message.kind === "batch_ended" && message.batch === this.#batch) {
      this.#progress.hidden = true;
      if (message.text) setText(this.#line, message.text);
    }
  }

  /** Others fly before. @param {import("../lib/course.js").Place & {run: string}} waiting */
  #wait(waiting) {
    this.#waits = waiting.run;
    this.#stop.toggleAttribute("disabled", false);
    setText(this.#line, waitingWords(waiting));
  }

  /** @param {Judged} ended */
  #showEnd({ text, result, spans }) {
    this.#showStrip(spans);
    if (this.#isStopped) setText(this.#line, word("stopped"));
    else setText(this.#line, result ? verdictWords(result, this.#layout, this.#view.places) : word("fault", { text }));
    if (result) setText(this.#hit, hitWords(contactsOf(result)));
  }

  /** @param {Now} now */
  #showNow(now) {
    const began_s = now.began_s ?? now.time_s;
    const contacts = now.contacts.map(({ name, time_s }) => ({ name, time_s: time_s - began_s }));
    this.#contacts = now.full ? contacts : [...this.#contacts, ...contacts];
    this.#counts = now.full ? now.counts : { ...this.#counts, ...now.counts };
    this.#spans = now.full ? now.spans : [...this.#spans, ...now.spans];
    this.#root.classList.toggle("e-paused", now.paused);
    setText(this.#pause, word(now.paused ? "go_on" : "pause"));
    const since_s = now.seconds_in_state || now.time_s - (this.#spans.at(-1)?.to_s ?? now.time_s); // a finished chart counts no seconds
    const seconds = { time: number(now.time_s - began_s, 1), state: now.state, since: number(since_s, 1) };
    setText(this.#line, word(!now.state ? "starting" : now.paused ? "paused_in" : "flying_in", seconds));
    setText(this.#hit, hitWords(this.#contacts));
    this.#listener.lit(now.active, this.#counts, now.taken.flatMap(({ ids }) => ids));
    this.#view.add(now.full, now.trail, now.pose, now.contacts);
    const sign = { true: "✓", false: "✗", null: "?" };
    this.#guards.replaceChildren(...now.guards.map(({ to, when, holds }) => make("li", { "data-holds": String(holds) },
      `${sign[/** @type {"true"|"false"|"null"} */ (String(holds))]} ${when || word("always")} → ${to}`)));
    this.#values.replaceChildren(...now.values.flatMap(({ name, value, unit }) => [
      make("dt", {}, name), make("dd", {}, typeof value === "number" ? `${number(value, 2)} ${unit}` : said(value))]));
    if (now.state) {
      this.#showStrip([...this.#spans, { state: now.state, from_s: this.#spans.at(-1)?.to_s ?? now.time_s - now.seconds_in_state, to_s: now.time_s }]);
    }
  }

  /** @param {{state: string, from_s: number, to_s: number}[]} all */
  #showStrip(all) {
    if (all.length > 0) drawStrip(this.#strip, all, { end_s: all[all.length - 1].to_s });
  }

  /** @param {Flight} flight */
  #showFlight(flight) {
    this.#rows.push(flight);
    this.#rows.sort((a, b) => a.rank - b.rank);
    this.#showBatch();
    this.#table.scrollIntoView({ block: "nearest" });
  }

  /** How many of the layouts are flown, and the table of those. */
  #showBatch() {
    this.#progress.hidden = false;
    this.#progress.value = this.#rows.length;
    const head = make("tr", {}, ...["scenario", "verdict", "lost_in", "seconds"].map((key) => make("th", {}, word(/** @type {any} */ (key)))));
    this.#table.replaceChildren(make("caption", {}, word("of_many")), head, ...this.#rows.map((each) => {
      const show = button(each.scenario, () => {
        this.showFlight(each);
        this.#listener.lost(each.lost_in);
      }, { class: "e-link" });
      return make("tr", { "data-completed": String(each.completed) },
        make("td", {}, show), make("td", {}, shortVerdict(each.verdict)), make("td", {}, each.lost_in), make("td", { class: "e-number" }, number(each.total_time_s, 1)));
    }));
    setText(this.#line, word("flown_many", {
      flown: String(this.#rows.length), count: String(this.#progress.max), completed: String(this.#rows.filter(({ completed }) => completed).length),
    }));
  }
}

/** A value that is no number, in words. @param {any} value */
function said(value) {
  if (value === null) return "–";
  return typeof value === "boolean" ? word(value ? "yes" : "no") : String(value);
}
