/** The list of flights to choose from. */
import { make, number, setText } from "../lib/dom.js";

const SHOWN = 200;

/**
 * @typedef {object} RunInfo as in /api/runs
 * @property {string} name
 * @property {string} scenario
 * @property {string} mission "" if unknown
 * @property {string} verdict "" if it was not judged
 * @property {number|null} total_time_s
 * @property {string} started ISO 8601; "" if unknown
 * @property {boolean} session flown from a page of this program
 */

/** When a flight began, in the reader's own time. @param {string} started */
function when(started) {
  const time = new Date(started);
  return started && !Number.isNaN(time.getTime()) ? time.toLocaleString([], { dateStyle: "medium", timeStyle: "short" }) : "";
}

/**
 * The address of the page that shows one or two flights.
 * @param {string} a name @param {string|null} [b] name
 */
export function pageOf(a, b = null) {
  const query = new URLSearchParams(b === null ? { a } : { a, b });
  return `/replay?${query}`;
}

export class RunList {
  #runs;
  #chosen;
  #rows;
  #search;
  #words;

  /**
   * @param {HTMLElement} element where it goes
   * @param {RunInfo[]} runs
   * @param {string[]} chosen names of the one or two that are shown
   */
  constructor(element, runs, chosen) {
    this.#runs = runs;
    this.#chosen = chosen;
    this.#search = make("input", { type: "search", id: "r-search", autocomplete: "off", placeholder: "scenario, mission, verdict, date", maxlength: "100" });
    this.#search.addEventListener("input", () => this.#show());
    this.#words = make("span", { class: "r-count", role: "status" });
    this.#rows = make("tbody");
    const names = ["flight", "scenario", "mission", "verdict", "total", "flown", ""];
    const head = make("tr", {}, ...names.map((name) => make("th", { scope: "col" }, name)));
    const table = make("table", { class: "r-runs" }, make("thead", {}, head), this.#rows);
    const search = make("div", { class: "r-search" }, make("label", { for: "r-search" }, "Search"), this.#search, this.#words);
    element.append(search, make("div", { class: "r-scroll", tabindex: "0", role: "group", "aria-label": "flights" }, table));
    this.#show();
  }

  #show() {
    const wanted = this.#search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const found = this.#runs.filter((run) => {
      const text = [run.name, run.scenario, run.mission, run.verdict, when(run.started)].join(" ").toLowerCase();
      return wanted.every((word) => text.includes(word));
    });
    this.#rows.replaceChildren(...found.slice(0, SHOWN).map((run) => this.#row(run)));
    const more = found.length > SHOWN ? `, the first ${SHOWN} are shown` : "";
    setText(this.#words, `${found.length} of ${this.#runs.length} flights${more}`);
  }

  /** @param {RunInfo} run */
  #row(run) {
    /** @param {string} name @param {...(Node|string|null)} content */
    const cell = (name, ...content) => make("td", { "data-name": name }, ...content);
    const place = this.#chosen.indexOf(run.name);
    const link = make("a", { href: pageOf(run.name), "aria-current": place >= 0 ? "true" : null }, run.name);
    const isReadable = run.verdict !== "unreadable";
    const total = run.total_time_s === null ? "" : `${number(run.total_time_s)} s`;
    return make(
      "tr", { "data-run": run.name, "data-verdict": run.verdict },
      cell("flight", isReadable ? link : run.name), cell("scenario", run.scenario), cell("mission", run.mission.replaceAll("_", " ")),
      cell("verdict", run.verdict || "not judged"), cell("total", total), cell("flown", when(run.started)),
      cell("beside", isReadable ? this.#beside(run, place) : null),
    );
  }

  /**
   * The way to see it beside the one that is shown.
   * @param {RunInfo} run @param {number} place among those shown; -1: it is not
   */
  #beside(run, place) {
    if (place >= 0) return `shown${this.#chosen.length > 1 ? ` as ${"AB"[place]}` : ""}`;
    if (this.#chosen.length === 0) return null;
    return make("a", { href: pageOf(this.#chosen[0], run.name) }, "beside");
  }
}
