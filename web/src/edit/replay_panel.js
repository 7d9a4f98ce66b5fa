/** Replays a recorded flight on the chart: its active states, how often transitions were taken, values and track. */
import { make, number, setText } from "../lib/dom.js";
import { Bar } from "../lib/replay/bar.js";
import { Clock } from "../lib/replay/clock.js";
import { Run } from "../lib/replay/run.js";
import { reasonOf, request } from "../lib/request.js";
import { yawOf } from "../lib/yaw.js";
import { button } from "./fields.js";
import { FlightView } from "./flight_view.js";
import { withOuterStates } from "./flights.js";
import { drawStrip } from "./state_strip.js";
import { contactsOf } from "./verdict.js";
import { word } from "./words.js";

const MAX_LISTED = 100;
const RECENT_S = 0.5; // a transition is lit for so long after it was taken

/**
 * @import {RunInfo} from "../replay/list.js"
 * @typedef {{time_s: number, from: string, to: string, when: string, values: [string, any][], ids: string[]}} Taken
 */

export class ReplayPanel {
  #listener;
  #list = /** @type {HTMLSelectElement} */ (make("select", { "aria-label": word("flight") }));
  #line = make("p", { role: "status", class: "e-run-line" });
  #strip = make("div", { class: "e-strip", role: "img", "aria-label": word("time_line") });
  #bar = make("div", {});
  #values = make("dl", { class: "e-read" });
  #table = make("table", { class: "e-batch" });
  #view;
  /** @type {Clock|null} */
  #clock = null;
  /** @type {Run|null} */
  #run = null;
  #drawn = -1; // transitions that are shown
  #asked = 0;

  /**
   * @param {HTMLElement} root
   * @param {{lit: (active: string[], counts: Object<string, number>, taken: string[]) => void,
   *   lost: (state: string) => void, mission: () => string}} listener mission: name of the one that is edited
   */
  constructor(root, listener) {
    this.#listener = listener;
    const drawing = make("div", { class: "e-top-view" });
    this.#view = new FlightView(drawing);
    root.classList.add("e-fly", "e-replay");
    this.#list.addEventListener("change", () => this.show(this.#list.value));
    root.append(drawing, make("div", { class: "e-flying" },
      make("div", { class: "e-row" },
        make("label", { class: "e-field" }, make("span", {}, word("flight")), this.#list),
        button(word("list_again"), () => this.load())),
      this.#line, this.#bar, this.#strip, make("div", { class: "e-run-columns" }, this.#values), this.#table));
  }

  /** List the flights anew: those of this session, and those of the folder of runs. */
  async load() {
    try {
      const runs = /** @type {RunInfo[]} */ (await request("/api/runs"))
        .filter(({ verdict }) => verdict !== "unreadable").slice(0, MAX_LISTED);
      const chosen = this.#run?.name ?? "";
      /** @param {boolean} isOfSession @param {string} label */
      const group = (isOfSession, label) => {
        const own = runs.filter(({ session }) => session === isOfSession);
        const made = make("optgroup", { label }, ...own.map((run) => make("option", { value: run.name }, title(run))));
        return own.length > 0 ? made : null;
      };
      const groups = [group(true, word("of_session")), group(false, word("of_folder"))].filter((each) => each !== null);
      this.#list.replaceChildren(make("option", { value: "" }, runs.length > 0 ? word("choose_flight") : word("no_flights")), ...groups);
      this.#list.value = runs.some(({ name }) => name === chosen) ? chosen : "";
    } catch (error) {
      setText(this.#line, reasonOf(error));
    }
  }

  /** Stop: another panel lights the chart. */
  pause() {
    this.#clock?.pause();
  }

  /** Show a flight from its start. @param {string} name in the list */
  async show(name) {
    this.#asked += 1;
    const asked = this.#asked;
    this.#forget();
    if (!name) return;
    setText(this.#line, word("reading"));
    try {
      const run = await Run.fetch(name);
      if (asked !== this.#asked) return; // another was chosen meanwhile
      if (run.poses.length === 0) setText(this.#line, word("nothing_recorded"));
      else this.#take(run);
    } catch (error) {
      if (asked === this.#asked) setText(this.#line, reasonOf(error));
    }
  }

  #forget() {
    this.#clock?.pause();
    this.#clock = this.#run = null;
    this.#drawn = -1;
    for (const part of [this.#bar, this.#strip, this.#values, this.#table]) part.replaceChildren();
    setText(this.#line, "");
    this.#view.setWorld(null);
    this.#listener.lit([], {}, []);
    this.#listener.lost("");
  }

  /** @param {Run} run */
  #take(run) {
    this.#run = run;
    const clock = new Clock();
    clock.setSpan(run.begin, run.end);
    clock.seek(run.begin);
    this.#clock = clock;
    new Bar(this.#bar, clock, [run], { keys: false });
    drawStrip(this.#strip, spansOf(run), { end_s: run.end, seek: (t) => clock.seek(t) });
    this.#view.setWorld(run.world.scenario);
    clock.listen(({ t }) => {
      if (this.#clock === clock) this.#showTime(t);
    });
    this.#showTime(clock.t);
  }

  /** @param {number} t seconds since motors on */
  #showTime(t) {
    const run = /** @type {Run} */ (this.#run);
    const [state, seconds] = run.stateAt(t);
    const [last, count] = run.transitionsAt(t);
    const recent = last.filter((/** @type {Taken} */ { time_s }) => t - time_s < RECENT_S);
    this.#listener.lit(withOuterStates(state ?? ""), countsUntil(run, count), recent.flatMap((/** @type {Taken} */ { ids }) => ids));
    const trail = run.poses.slice(0, run.posesUntil(t)).map(({ t: time_s, p }) => [time_s, ...p]);
    const pose = run.poseAt(t);
    const hits = run.result ? contactsOf(run.result).filter(({ time_s }) => time_s <= t) : [];
    if (pose) this.#view.add(true, trail, [...pose.p, yawOf(pose.q)], hits);
    const notes = [`${number(t, 1)} s: ${state ?? "–"} (${number(seconds, 1)} s)`];
    if (run.chart && run.chart.name !== this.#listener.mission()) notes.push(word("other_mission", { name: run.chart.name }));
    if (run.result && t >= run.end) notes.push(run.result.reason ?? "");
    setText(this.#line, notes.filter(Boolean).join(" – "));
    if (count === this.#drawn) return;
    this.#drawn = count;
    this.#showTransitions(last);
  }

  /** @param {Taken[]} last newest first */
  #showTransitions(last) {
    this.#values.replaceChildren(...(last[0]?.values ?? []).flatMap(([name, value]) => [
      make("dt", {}, name), make("dd", {}, typeof value === "number" ? number(value, 2) : String(value))]));
    const head = make("tr", {}, ...["seconds", "from_state", "to", "guard_word"].map((key) => make("th", {}, word(/** @type {any} */ (key)))));
    this.#table.replaceChildren(...(last.length > 0 ? [head] : []), ...last.slice(0, 5).map(({ time_s, from, to, when }) => make("tr", {},
      make("td", { class: "e-number" }, number(time_s, 1)), make("td", {}, from), make("td", {}, to), make("td", {}, when || word("always")))));
  }
}

/** @param {RunInfo} run */
function title({ name, scenario, mission, verdict, started }) {
  const time = new Date(started);
  const when = Number.isNaN(time.getTime()) ? name
    : `${time.toLocaleDateString()} ${time.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit" })}`;
  return [when, scenario, mission, verdict].filter(Boolean).join(" · ");
}

/** How often each of the first transitions was taken. @param {Run} run @param {number} count */
function countsUntil(run, count) {
  /** @type {Object<string, number>} */
  const counts = {};
  for (const { ids } of run.transitions.slice(0, count)) for (const id of ids) counts[id] = (counts[id] ?? 0) + 1;
  return counts;
}

/** When each state was active. @param {Run} run @returns {import("./state_strip.js").Span[]} */
function spansOf(run) {
  /** @type {import("./state_strip.js").Span[]} */
  const spans = [];
  for (const { t, s } of run.poses) {
    const state = run.states[s] ?? "";
    const last = spans.at(-1);
    if (last) last.to_s = t;
    if (last?.state !== state) spans.push({ state, from_s: t, to_s: t });
  }
  return spans;
}
