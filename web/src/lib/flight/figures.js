import { make, number, setAttribute, setText } from "../dom.js";

/** @import {Live} from "../messages.js" */
/** @typedef {{chip: HTMLElement, words: HTMLElement}} Chip */

const COLOURS = /** @type {const} */ (["red", "green", "blue"]);
const FINAL_WORDS = new Set(["wrong order", "timed out", "crashed"]); // nothing that comes can mend these

/** The Game Monitor's figures: times, penalty, crossings, verdict. Each number stands in full in `data-value`. */
export class Figures {
  #root;
  /** @type {Record<string, HTMLOutputElement>} */
  #numbers = {};
  #bar;
  #limit;
  #chips = /** @type {Record<"red"|"green"|"blue", Chip> & {list: HTMLElement}} */ ({});
  #next;
  #warning;
  #faults;
  #verdict;
  #reason;
  #source;

  /** @param {HTMLElement} element an empty box */
  constructor(element) {
    this.#warning = make("p", { class: "m-warning", role: "alert" });
    this.#faults = make("p", { class: "m-faults", "data-figure": "faults" });
    this.#bar = make("span");
    this.#limit = make("p", { class: "m-limit" });
    this.#next = make("p", { class: "m-next", "data-figure": "next_colour" });
    this.#verdict = make("p", { class: "m-verdict", "data-figure": "verdict" });
    this.#reason = make("p", { class: "m-reason" });
    this.#source = make("p", { class: "m-source" });
    const outcome = make("div", { class: "m-outcome", "aria-live": "polite" }, this.#verdict, this.#reason, this.#source);
    this.#root = make(
      "div", { class: "m-figures" },
      this.#warning,
      this.#faults,
      this.#number("try_time_s", "try time", "s", "m-first"),
      make("div", { class: "m-bar", "aria-hidden": "true" }, this.#bar),
      this.#limit,
      make(
        "div", { class: "m-three" },
        this.#number("penalty_s", "penalty", "s"), this.#number("total_time_s", "total", "s"), this.#number("contacts", "contacts", ""),
      ),
      this.#crossings(),
      this.#next,
      outcome,
    );
    element.append(this.#root);
    this.set(null);
  }

  /**
   * @param {Live.Figures|null} figures null: nobody judges
   * @param {Live.DroneStatus} [status] the drone's whole status, if there is one
   */
  set(figures, status) {
    setAttribute(this.#root, "data-empty", !figures);
    for (const [name, output] of Object.entries(this.#numbers)) {
      const value = /** @type {Record<string, any>|null} */ (figures)?.[name] ?? null;
      setAttribute(output, "data-value", value);
      setText(output, name === "contacts" ? number(value, 0) : number(value));
    }
    this.#setTime(figures);
    this.#setCrossings(figures);
    this.#setOutcome(figures, status);
    this.#setFaults(figures);
    const warnings = [];
    if (figures?.inside === false && figures.motors_on) warnings.push("outside the arena: every second costs one more");
    if (figures?.time_over) warnings.push(`time over: the limit of ${figures.limit_s} s has passed`);
    setText(this.#warning, warnings.join("; "));
    this.#warning.hidden = warnings.length === 0;
    setAttribute(this.#warning, "data-figure", warnings.length ? "warning" : null);
  }

  /** @param {string} name @param {string} title @param {string} unit @param {string} [look] */
  #number(name, title, unit, look = "") {
    const output = make("output", { "data-figure": name, "aria-live": "off" }, "–");
    this.#numbers[name] = output;
    const value = make("span", { class: "m-value" }, output, unit ? make("small", {}, ` ${unit}`) : null);
    return make("div", { class: `m-figure ${look}` }, make("span", { class: "m-title" }, title), value);
  }

  #crossings() {
    const list = make("ul", { class: "m-crossings", "data-figure": "crossed", "aria-label": "frames" });
    for (const colour of COLOURS) {
      const words = make("span", { class: "m-chip-words" });
      const chip = make("li", { "data-colour": colour }, make("span", { class: "m-chip-name" }, colour), words);
      this.#chips[colour] = { chip, words };
      list.append(chip);
    }
    this.#chips.list = list;
    return list;
  }

  /** @param {Live.Figures|null} figures */
  #setTime(figures) {
    const share = figures?.limit_s
      ? Math.min(1, /** @type {number} */ (figures.try_time_s) / figures.limit_s) : 0;
    this.#bar.style.transform = `scaleX(${Number.isFinite(share) ? share : 0})`;
    setAttribute(this.#bar, "data-over", Boolean(figures?.time_over));
    const left_s = figures
      ? /** @type {number} */ (figures.limit_s) - /** @type {number} */ (figures.try_time_s) : null;
    const words = left_s === null ? "no referee" : /** @type {Live.Figures} */ (figures).limit_s === null ? ""
      : `limit ${/** @type {Live.Figures} */ (figures).limit_s} s${left_s >= 0 ? "" : ", time over"}`;
    setText(this.#limit, words);
  }

  /** @param {Live.Figures|null} figures */
  #setCrossings(figures) {
    const crossed = figures?.crossed ?? [];
    setAttribute(this.#chips.list, "data-value", figures ? crossed.join(",") : null);
    for (const colour of COLOURS) {
      const { chip, words } = this.#chips[colour];
      const place = crossed.indexOf(colour);
      const state = place >= 0 ? "crossed" : figures?.next_colour === colour ? "next" : "open";
      setAttribute(chip, "data-state", state);
      const time_s = place >= 0
        ? /** @type {Live.Figures} */ (figures).crossing_times_s?.[place] ?? null : null;
      setAttribute(chip, "data-value", time_s);
      const told = { crossed: time_s === null ? "✓" : `✓ ${number(time_s)} s`, next: "next", open: "–" }[state];
      setText(words, told);
    }
    const next = figures?.next_colour ?? null;
    setAttribute(this.#next, "data-value", next);
    const crossedAll = crossed.length ? `all frames crossed${figures?.over ? "" : ", back to the base"}` : "";
    setText(this.#next, next ? `next frame: ${next}` : crossedAll); // an open field has none to cross
  }

  /** What has failed on purpose, and the autopilot's failsafe. @param {Live.Figures|null} figures */
  #setFaults(figures) {
    const faults = figures?.faults ?? [];
    const words = faults.map(({ fault, active }) => `fault: ${fault}${active ? "" : " (over)"}`);
    if (words.length && /** @type {Live.Figures} */ (figures).failsafe) {
      words.push(/** @type {Live.Figures} */ (figures).failsafe);
    }
    setText(this.#faults, words.join("; "));
    this.#faults.hidden = words.length === 0;
  }

  /** @param {Live.Figures|null} figures @param {Live.DroneStatus|undefined} status */
  #setOutcome(figures, status) {
    const decided = figures && (figures.over || figures.final || FINAL_WORDS.has(figures.verdict));
    let verdict = "not judged";
    if (decided) verdict = figures.verdict;
    else if (figures) {
      verdict = figures.motors_on ? "under way"
        : /** @type {number} */ (figures.try_time_s) > 0 ? "motors off" : "before the start";
    }
    setText(this.#verdict, verdict);
    setAttribute(this.#verdict, "data-value", figures?.verdict ?? null);
    const look = !decided ? "open" : ["clean", "completed"].includes(verdict) ? "good" : "bad";
    setAttribute(this.#verdict, "data-look", look);
    const without = status ? "this drone has no referee: start framerunner monitor --scenario NAME" : "";
    setText(this.#reason, decided ? figures.reason ?? "" : figures ? "" : without);
    const by = /** @type {Record<string, string|undefined>} */ ({
      truth: "judged by the simulator's truth", telemetry: "judged by telemetry",
    })[/** @type {string} */ (figures?.source)];
    const standing = figures?.final ? "final" : "so far";
    setText(this.#source, figures ? `${by ?? `judged by ${figures.source}`}, ${standing}` : "");
    setAttribute(this.#source, "data-value", figures?.source ?? null);
    setAttribute(this.#source, "data-final", figures ? Boolean(figures.final).toString() : null);
  }
}
