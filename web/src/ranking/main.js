/** The ranking, for a projector: follows the contest by itself. */

import "../lib/contest/contest.css";
import { ask, oneAtATime, watch } from "../lib/contest/channel.js";
import { nowLines } from "../lib/contest/now.js";
import { Pages } from "../lib/contest/pages.js";
import { nameOf, seconds } from "../lib/contest/words.js";
import { make, setText, wantsStillness } from "../lib/dom.js";
import { pageData, pageRoot } from "../lib/page_data.js";

/**
 * @import {RankingState, Row, Cell, Rule, RunningTry, Call, Queue} from "../competition/answers"
 * @typedef {Pick<HTMLElement, "getBoundingClientRect">} Placed
 */

const MOVE_MS = 700;
const WIDE = "(min-width: 44rem)"; // as in the style sheet: the window shows all of it
const LONGEST_GUESS_S = 1.5; // how long a clock goes on without news

class Ranking {
  #element;
  #title = make("h1", {}, "Ranking");
  #rounds = make("select", { "aria-label": "Round" });
  #line = make("p", { class: "line", role: "status", hidden: true });
  #now = make("div", { class: "now", "aria-live": "off" });
  #table = make("table", { class: "ranking", role: "table" });
  #head = make("tr", { role: "row" });
  #body = make("tbody", { role: "rowgroup" });
  #empty = make("p", { class: "empty", hidden: true }, "No team has been entered. Organisers enter teams on the page ",
    make("a", { href: "/competition" }, "Competition"), ".");
  #rule = make("p", { class: "hint" });
  #pages;
  /** @type {Map<number, HTMLElement>} of each team */
  #rows = new Map();
  #wanted = "";
  #linked = true;
  #problem = "";
  #heard_ms = 0;
  /** @type {[HTMLElement, number][]} */
  #clocks = [];
  /** @type {Call|null} */
  called = null;
  /** @type {Pick<Queue, "teams">} */
  queue = { teams: [] };

  /** @param {HTMLElement} element @param {boolean} join whether phones can open the monitor */
  constructor(element, join) {
    this.#element = element;
    this.#rounds.addEventListener("change", () => {
      this.#wanted = this.#rounds.value;
      refresh();
    });
    const wide = make("button", { type: "button" }, "Full screen");
    wide.addEventListener("click", () => this.#fill());
    document.addEventListener("fullscreenchange", () => {
      document.body.classList.toggle("projector", document.fullscreenElement !== null);
    });
    const note = make("button", { type: "button", class: "pages", title: "The next ones" });
    const box = make("div", { class: "rows" }, this.#table, this.#empty);
    this.#pages = new Pages(box, this.#body, note, () => matchMedia(WIDE).matches);
    this.#table.append(make("thead", { role: "rowgroup" }, this.#head), this.#body);
    element.append(
      make("div", { class: "bar" }, this.#title, note, this.#rounds, wide), this.#line,
      make("div", { class: "above" }, this.#now, join ? joinCode() : null), box, this.#rule,
    );
    const refresh = oneAtATime(() => this.#load(), (error) => this.#say(error.message));
    watch({
      changed: refresh,
      running: (tries) => this.#run(tries),
      link: (up) => {
        this.#linked = up;
        this.#say();
      },
    });
    requestAnimationFrame(() => this.#tick());
  }

  #fill() {
    if (document.fullscreenElement !== null) document.exitFullscreen();
    else document.documentElement.requestFullscreen?.().catch(() => {});
  }

  async #load() {
    /** @type {RankingState} */
    const state = await ask(`ranking${this.#wanted === "" ? "" : `?round=${this.#wanted}`}`);
    this.#problem = state.problem;
    this.#say();
    this.#showRounds(state);
    this.#showHead(state.ranking.scenarios);
    this.#showRows(state.ranking.rows);
    this.#showRule(state.rule);
    this.called = state.called;
    this.queue = state.queue;
    this.#run(state.running);
  }

  #say(trouble = "") {
    const words = trouble || (this.#linked ? this.#problem : "connection to the monitor lost, trying again");
    setText(this.#line, words);
    this.#line.hidden = words === "";
  }

  /** @param {RankingState} state */
  #showRounds(state) {
    const round = state.ranking.round;
    setText(this.#title, round === 0 ? "Ranking: before the draw" : `Ranking: round ${round}`);
    const known = [...this.#rounds.options].map((option) => Number(option.value));
    if (known.join() !== state.rounds.join()) {
      this.#rounds.replaceChildren(...state.rounds.map((number) =>
        make("option", { value: String(number) }, number === 0 ? "Before the draw" : `Round ${number}`)));
      this.#wanted = "";
    }
    this.#rounds.value = String(round);
    if (round === state.rounds[0]) this.#wanted = "";
    this.#rounds.hidden = state.rounds.length < 2;
  }

  /** @param {string[]} scenarios */
  #showHead(scenarios) {
    const titles = ["Rank", "Team", ...scenarios.map((name, index) => name || `Scenario ${index + 1}`), "Total"];
    const kinds = ["rank", "team", ...scenarios.map(() => "cell"), "total"];
    this.#element.style.setProperty("--columns", String(Math.max(2, scenarios.length)));
    this.#head.replaceChildren(...titles.map((title, index) =>
      make("th", { scope: "col", role: "columnheader", class: kinds[index] }, title)));
    /** @type {string[]} */
    this.titles = titles;
  }

  /** Put the rows in order; those that were there move from where they were. @param {Row[]} rows */
  #showRows(rows) {
    const before = new Map([...this.#rows].filter(([, row]) => !row.hidden).map(([team, row]) => [team, row.getBoundingClientRect().top]));
    const present = new Set(rows.map((row) => row.team));
    for (const [team, row] of this.#rows) {
      if (present.has(team)) continue;
      row.remove();
      this.#rows.delete(team);
    }
    rows.forEach((row, index) => {
      let element = this.#rows.get(row.team);
      if (element === undefined) {
        element = make("tr", { role: "row", "data-team": String(row.team) });
        this.#rows.set(row.team, element);
      }
      this.#fillRow(element, row);
      if (this.#body.children[index] !== element) this.#body.insertBefore(element, this.#body.children[index] ?? null);
    });
    this.#table.hidden = rows.length === 0;
    this.#empty.hidden = rows.length > 0;
    this.#pages.fit();
    if (!wantsStillness()) this.#move(before);
  }

  /** @param {Map<number, number>} before where each team's row was */
  #move(before) {
    for (const [team, row] of this.#rows) {
      if (row.hidden) continue;
      const way = (before.get(team) ?? row.getBoundingClientRect().top) - row.getBoundingClientRect().top;
      if (way === 0) continue;
      row.animate(
        [{ transform: `translateY(${way}px)` }, { transform: "none" }],
        { duration: MOVE_MS, easing: "ease-in-out" },
      );
    }
  }

  /** @param {HTMLElement} element @param {Row} row */
  #fillRow(element, row) {
    const text = JSON.stringify([row, this.titles]);
    if (element.dataset.shown === text) return;
    element.dataset.shown = text;
    element.replaceChildren(
      make("td", { class: "rank", role: "cell" }, String(row.rank ?? "–")),
      make("th", { class: "team", role: "rowheader", scope: "row" }, nameOf(row.name, { class: "name" })),
      ...row.cells.map((cell, index) => this.#cell(cell, this.titles?.[index + 2] ?? "")),
      make("td", { class: "total", role: "cell" }, row.flown ? seconds(row.total_s) : "–"),
    );
  }

  /** @param {Cell} cell @param {string} title */
  #cell(cell, title) {
    const flown = cell.state !== "not flown";
    const lacks = cell.missing === 0 ? "not completed" : `${cell.missing} missing`;
    const note = flown && cell.state !== "completed" ? lacks : "";
    return make("td", { class: "cell", role: "cell", "data-state": cell.state, "data-title": title },
      make("span", { class: "time" }, flown ? seconds(cell.counted_s) : "–"),
      make("span", { class: "note" }, flown ? note : `counts ${seconds(cell.counted_s)}`));
  }

  /** @param {Rule} rule */
  #showRule(rule) {
    setText(this.#rule, "Total: the sum over "
      + `${rule.scenarios} ${rule.scenarios === 1 ? "scenario" : "scenarios"} of try time and penalty, in seconds. `
      + `A try that is not completed counts ${rule.limit_s} s and ${rule.missing_frame_s} s for each frame missing; `
      + `a scenario not flown counts as if all were. Of several tries the ${rule.counting} counts.`);
  }

  /** @param {RunningTry[]} tries that are flown now */
  #run(tries) {
    this.#heard_ms = performance.now();
    const { lines, clocks } = nowLines({ running: tries, called: this.called, queue: this.queue });
    this.#clocks = clocks;
    this.#now.replaceChildren(...lines);
    this.#now.hidden = lines.length === 0;
    const flying = new Set(tries.map((each) => each.team));
    for (const [team, row] of this.#rows) row.toggleAttribute("data-flying", flying.has(team));
  }

  #tick() {
    const guess_s = Math.min(LONGEST_GUESS_S, (performance.now() - this.#heard_ms) / 1000);
    for (const [clock, from_s] of this.#clocks) setText(clock, (from_s + guess_s).toFixed(1));
    setTimeout(() => requestAnimationFrame(() => this.#tick()), 100);
  }
}

/** The code that opens this monitor on a phone. */
function joinCode() {
  const image = make("img", { src: "/join.svg", alt: "QR code with the address of this monitor" });
  return make("a", { class: "join-code", href: "/join" }, image, make("span", {}, "on your phone"));
}

new Ranking(pageRoot("ranking"), pageData().join === true);
