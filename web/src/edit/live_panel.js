/** Flies the mission in the real simulator, which the live channel shows: any page that is open sees it. */
import { make, setText } from "../lib/dom.js";
import { button, choice } from "./fields.js";
import { FlightView } from "./flight_view.js";
import { FIRST_SCENARIO, loadChoices, scenarioFields } from "./scenario_fields.js";
import { word } from "./words.js";

const SPEEDS = /** @type {[string, string][]} */ ([["0.5", "0.5 ×"], ["1", "1 ×"], ["2", "2 ×"], ["5", "5 ×"], ["10", "10 ×"]]);
const STEP_M = 0.03; // between two points of the track

/** @typedef {{state: "starting"|"flying"|"ended"|"stopped", scenario: string, speed: number, text: string}} Live */

/** @import {Answer, Request} from "./flights.js" */

export class LivePanel {
  #listener;
  #scenario = FIRST_SCENARIO;
  #speed = "1";
  #line = make("p", { role: "status", class: "e-run-line" }, word("live_idle"));
  #choices = make("div", { class: "e-row" });
  #start;
  #stop;
  #view;
  /** @type {number[][]} */
  #track = [];
  #isOver = false; // the flight of the track; its last places may come later

  /**
   * @param {HTMLElement} root
   * @param {{ask: (request: Request) => Promise<Answer>, text: () => Promise<string>}} listener
   *   ask: something of the server; text: of the mission
   */
  constructor(root, listener) {
    this.#listener = listener;
    const drawing = make("div", { class: "e-top-view" });
    this.#view = new FlightView(drawing);
    this.#start = button(word("live_start"), () => this.#fly(), { class: "e-first" });
    this.#stop = button(word("live_stop"), () => this.#do({ kind: "stop_live" }), { disabled: true });
    root.classList.add("e-fly");
    root.append(drawing, make("div", { class: "e-flying" },
      this.#choices,
      make("div", { class: "e-row" }, this.#start, this.#stop, make("a", { href: "/", target: "_blank" }, word("live_page"))),
      this.#line, make("p", { class: "hint" }, word("live_hint"))));
    this.#loadChoices();
  }

  async #loadChoices() {
    const choices = await loadChoices();
    if (!choices) return;
    this.#choices.replaceChildren(
      ...scenarioFields(choices, this.#scenario, (scenario) => { this.#scenario = scenario; }),
      choice(word("speed"), SPEEDS, this.#speed, (value) => { this.#speed = value; }));
  }

  async #fly() {
    this.#start.setAttribute("disabled", "");
    const text = await this.#listener.text();
    this.#clear();
    await this.#do({ kind: "start_live", text, scenario: this.#scenario, speed: Number(this.#speed) });
  }

  /** @param {Request} request */
  async #do(request) {
    const answer = await this.#listener.ask(request);
    if (answer.kind !== "refused") return;
    setText(this.#line, answer.text);
    this.#start.removeAttribute("disabled");
  }

  /** The server told how the flight stands. @param {Live} live */
  hear(live) {
    const isFlying = live.state === "starting" || live.state === "flying";
    this.#isOver = !isFlying;
    this.#start.toggleAttribute("disabled", isFlying);
    this.#stop.toggleAttribute("disabled", !isFlying);
    const values = { scenario: live.scenario, speed: String(live.speed), text: live.text };
    const state = word(/** @type {any} */ (`live_${live.state}`), values);
    setText(this.#line, live.text && live.state !== "stopped" ? live.text : state);
    if (live.state === "starting") this.#clear();
  }

  #clear() {
    this.#track = [];
    this.#view.setWorld(null);
  }

  /** The world is known. @param {any} scenario */
  setWorld(scenario) {
    if (scenario) this.#view.setWorld(scenario);
  }

  /** Where the drone is now, and its mission's state. @param {number[]} place @param {number} t @param {string} state */
  move(place, t, state) {
    const [x, y] = place;
    const last = this.#track.at(-1);
    if (last && t < last[0]) { // another flight
      this.#track = [];
      this.#isOver = false;
    }
    if (!last || Math.hypot(x - last[1], y - last[2]) > STEP_M) this.#track.push([t, x, y, place[2]]);
    this.#view.add(true, this.#track, place, []);
    if (state && !this.#isOver) setText(this.#line, state);
  }
}
