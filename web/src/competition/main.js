/** The page of a contest: who flies and who is next, teams, draw, tries, rule. Organisers have controls, judges correct tries; all others look. */

import "../lib/contest/contest.css";
import { ask, oneAtATime, watch } from "../lib/contest/channel.js";
import { Draw, Rule } from "./draw.js";
import { Calls, Queue } from "./queue.js";
import { Teams } from "./teams.js";
import { gateMarks, moment, nameOf, notCounted, orDash, seconds, standing } from "../lib/contest/words.js";
import { make, setText } from "../lib/dom.js";
import { pageData, pageRoot } from "../lib/page_data.js";
import { reasonOf } from "../lib/request.js";

/** @import {Board, RunningTry, State, Try} from "./answers" */

/**
 * What the parts of the page have it do.
 * @typedef {object} Page
 * @property {boolean} judge whether there are controls
 * @property {(words: string) => void} say something under the title
 * @property {(work: () => Promise<unknown>) => Promise<boolean>} attempt what is asked; whether it was done
 */

class Desk {
  #line = make("p", { class: "line", role: "status", hidden: true });
  #tries = make("tbody");
  #none = make("p", { class: "hint" }, "No try has been flown. Each flight is one: ", make("code", {}, "framerunner fly test-case-1"));
  /** @type {Board|null} */
  #board = null;
  /** @type {Map<number, HTMLElement>} */
  #clocks = new Map();

  /** @param {HTMLElement} element @param {boolean} judge */
  constructor(element, judge) {
    this.judge = judge;
    this.calls = new Calls(this);
    this.queue = new Queue(this);
    this.teams = new Teams(this);
    this.draw = new Draw(this);
    this.rule = new Rule(this);
    element.append(
      make("div", { class: "bar" }, make("h1", {}, "Competition"), exports()), this.#line,
      make("div", { class: "contest" },
        make("div", { class: "column" }, this.calls.element, this.queue.element, this.#triesPanel()),
        make("div", { class: "column" }, this.draw.element, this.teams.element, this.rule.element)),
    );
    this.refresh = oneAtATime(() => this.#load(), (error) => this.say(reasonOf(error)));
    watch({
      changed: this.refresh,
      running: (tries) => this.#run(tries),
      link: (up) => this.say(up ? "" : "connection to the monitor lost, trying again"),
    });
  }

  /** Say something in the line under the title; "" takes it away. @param {string} words */
  say(words) {
    setText(this.#line, words);
    this.#line.hidden = words === "";
  }

  /**
   * Do what somebody asks, and say why if it was refused.
   * @param {() => Promise<unknown>} work
   * @returns {Promise<boolean>} whether it was done
   */
  async attempt(work) {
    try {
      await work();
    } catch (error) {
      this.say(reasonOf(error));
      this.#line.scrollIntoView({ block: "nearest" });
      return false;
    }
    this.say("");
    await this.refresh();
    return true;
  }

  #triesPanel() {
    const titles = ["Try", "Team", "Scenario", "Result", "Counts", ""];
    const head = make("tr", {}, ...titles.map((title) => make("th", { scope: "col" }, title)));
    return make("section", { class: "panel", "aria-labelledby": "tries-title" },
      make("h2", { id: "tries-title" }, "Tries"), this.#none,
      make("table", { class: "tries" }, make("thead", {}, head), this.#tries));
  }

  async #load() {
    const state = /** @type {State} */ (await ask("state"));
    const key = document.activeElement instanceof HTMLElement ? document.activeElement.dataset.key : undefined;
    this.#board = state.board;
    this.say(state.problem);
    this.calls.show(state.board);
    this.queue.show(state.board);
    this.teams.show(state.board, state.running);
    this.draw.show(state.board, state.scenarios);
    this.rule.show(state.board);
    this.#showTries(state.board.tries);
    this.#run(state.running);
    if (!key) return;
    /** @type {HTMLElement|null} */ (document.querySelector(`[data-key="${CSS.escape(key)}"]`))?.focus();
  }

  /** @param {Try[]} tries */
  #showTries(tries) {
    this.#none.hidden = tries.length > 0;
    /** @type {HTMLElement} */ (this.#tries.parentElement).hidden = tries.length === 0;
    this.#clocks.clear();
    this.#tries.replaceChildren(...tries.map((each) => this.#row(each)));
  }

  /** @param {Try} each */
  #row(each) {
    const running = each.state === "running";
    const counts = make("td", { class: "number" },
      each.judged ? seconds(each.result.counted_s) : running ? `${each.result.try_time_s.toFixed(1)} s` : "–");
    if (running) this.#clocks.set(each.id, counts);
    const open = !running && (!each.judged || each.team === null);
    const words = pageData().mayCorrect ? (open ? "Judge" : "Correct") : "Look";
    const team = each.team === null ? make("span", { class: "tag warn" }, "no team") : nameOf(each.team_name);
    return make("tr", { "data-try": String(each.id), "data-state": each.state, "data-open": String(open) },
      make("td", {}, `${each.id}`, make("span", { class: "when" }, moment(each.started))),
      make("td", { class: "team" }, team),
      make("td", {}, orDash(each.scenario), make("span", { class: "when" }, each.round === 0 ? "before the draw" : `round ${each.round}`), notCounted(each)),
      make("td", {}, standing(each), " ", running ? null : gateMarks(each.frames, each.result.crossed),
        each.corrected_by === "" ? null : make("span", { class: "when" }, "corrected by ", nameOf(each.corrected_by))),
      counts,
      make("td", {}, make("a", {
        href: `/competition/try/${each.id}`, class: "button", "data-key": `try-${each.id}`,
        "aria-label": `${words} try ${each.id}`,
      }, words)));
  }

  /** @param {RunningTry[]} tries that are flown now */
  #run(tries) {
    if (this.#board === null) return;
    for (const each of tries) {
      const clock = this.#clocks.get(each.id);
      if (clock) setText(clock, `${each.try_time_s.toFixed(1)} s`);
    }
    this.calls.run(tries);
  }
}

function exports() {
  return make("span", { class: "exports" },
    make("a", { href: "/join" }, "QR code"),
    make("a", { href: "/api/competition/ranking.csv", download: true }, "ranking.csv"),
    make("a", { href: "/api/competition/tries.csv", download: true }, "tries.csv"));
}

const element = pageRoot("competition");
new Desk(element, pageData().judge === true);
