/** The desk of a contest: who flies next, teams, draw, tries, rule. Judges have controls; all others look. */

import { ask, oneAtATime, send, watch } from "./competition_channel.js";
import { Draw, Rule } from "./competition_draw.js";
import { Teams } from "./competition_teams.js";
import { frameMarks, moment, nameOf, orDash, seconds, standing } from "./competition_words.js";
import { make, setText, whenThere } from "./dom.js";
import { pageData } from "./start.js";

class Desk {
  #line = make("p", { class: "line", role: "status", hidden: true });
  #now = make("div", { class: "now" });
  #call = make("form", { class: "call" });
  #team = make("select", { id: "next-team" });
  #scenario = make("select", { id: "next-scenario" });
  #tries = make("tbody");
  #none = make("p", { class: "hint" }, "No try has been flown yet.");
  #board = null;
  #running = [];
  #clocks = new Map();

  /** @param {HTMLElement} element @param {boolean} judge */
  constructor(element, judge) {
    this.judge = judge;
    this.teams = new Teams(this);
    this.draw = new Draw(this);
    this.rule = new Rule(this);
    element.append(
      make("div", { class: "bar" }, make("h1", {}, "Competition"), exports()), this.#line,
      make("div", { class: "desk" },
        make("div", { class: "column" }, this.#nextPanel(), this.#triesPanel()),
        make("div", { class: "column" }, this.draw.element, this.teams.element, this.rule.element)),
    );
    this.refresh = oneAtATime(() => this.#load(), (error) => this.say(error.message));
    watch({
      changed: this.refresh,
      running: (tries) => this.#run(tries),
      link: (up) => this.say(up ? "" : "connection to the monitor lost, trying again"),
    });
  }

  /** Say something in the line under the title; "" takes it away. */
  say(words) {
    setText(this.#line, words);
    this.#line.hidden = words === "";
  }

  /** Do what a judge asks, and say why if it was refused. @returns {Promise<boolean>} whether it was done */
  async attempt(work) {
    try {
      await work();
    } catch (error) {
      this.say(error.message);
      this.#line.scrollIntoView({ block: "nearest" });
      return false;
    }
    this.say("");
    await this.refresh();
    return true;
  }

  #nextPanel() {
    const panel = make("section", { class: "panel", "aria-labelledby": "next-title" },
      make("h2", { id: "next-title" }, "Now and next"), this.#now);
    if (!this.judge) return panel;
    const clear = make("button", { type: "button" }, "Nobody");
    clear.addEventListener("click", () => this.attempt(() => send("next", { team: null })));
    this.#call.append(
      make("label", { for: "next-team" }, "Team"), this.#team,
      make("label", { for: "next-scenario" }, "Scenario"), this.#scenario,
      make("div", { class: "buttons" }, make("button", { type: "submit", class: "main" }, "Call"), clear));
    this.#call.addEventListener("submit", (event) => {
      event.preventDefault();
      const team = Number(this.#team.value);
      if (team > 0) this.attempt(() => send("next", { team, scenario: this.#scenario.value }));
      else this.say("no team is chosen; enter or choose one");
    });
    panel.append(this.#call);
    return panel;
  }

  #triesPanel() {
    const titles = ["Try", "Team", "Scenario", "Result", "Counts", ""];
    const head = make("tr", {}, ...titles.map((title) => make("th", { scope: "col" }, title)));
    return make("section", { class: "panel", "aria-labelledby": "tries-title" },
      make("h2", { id: "tries-title" }, "Tries"), this.#none,
      make("table", { class: "tries" }, make("thead", {}, head), this.#tries));
  }

  async #load() {
    const state = await ask("state");
    const key = document.activeElement?.dataset?.key;
    this.#board = state.board;
    this.say(state.problem);
    this.teams.show(state.board);
    this.draw.show(state.board, state.scenarios);
    this.rule.show(state.board);
    this.#showChoices(state.board);
    this.#showTries(state.board.tries);
    this.#run(state.running);
    if (key) document.querySelector(`[data-key="${CSS.escape(key)}"]`)?.focus();
  }

  #showChoices(board) {
    if (!this.judge) return;
    const draw = board.draws.find((each) => each.round === board.round);
    const choose = (select, options) => {
      const chosen = select.value;
      const text = JSON.stringify(options);
      if (select.dataset.shown === text) return;
      select.dataset.shown = text;
      select.replaceChildren(...options.map(([value, words]) => make("option", { value }, words)));
      if (options.some(([value]) => value === chosen)) select.value = chosen;
    };
    const teams = board.teams.filter((team) => !team.withdrawn);
    choose(this.#team, [["", "choose a team"], ...teams.map((team) => [String(team.id), team.name])]);
    choose(this.#scenario, [["", "what the drone flies"], ...(draw?.scenarios ?? []).map((name) => [name, name])]);
  }

  #showTries(tries) {
    this.#none.hidden = tries.length > 0;
    this.#tries.parentElement.hidden = tries.length === 0;
    this.#clocks.clear();
    this.#tries.replaceChildren(...tries.map((each) => this.#row(each)));
  }

  #row(each) {
    const running = each.state === "running";
    const counts = make("td", { class: "number" },
      each.judged ? seconds(each.result.counted_s) : running ? `${each.result.try_time_s.toFixed(1)} s` : "–");
    if (running) this.#clocks.set(each.id, counts);
    const open = !running && (!each.judged || each.team === null);
    const words = this.judge ? (open ? "Judge" : "Correct") : "Look";
    const team = each.team === null ? make("span", { class: "tag warn" }, "no team") : nameOf(each.team_name);
    return make("tr", { "data-try": String(each.id), "data-state": each.state, "data-open": String(open) },
      make("td", {}, `${each.id}`, make("span", { class: "when" }, moment(each.started))),
      make("td", { class: "team" }, team),
      make("td", {}, orDash(each.scenario), make("span", { class: "when" }, each.round === 0 ? "before the draw" : `round ${each.round}`)),
      make("td", {}, standing(each), " ", running ? null : frameMarks(each.frames, each.result.crossed),
        each.corrected_by === "" ? null : make("span", { class: "when" }, "corrected by ", nameOf(each.corrected_by))),
      counts,
      make("td", {}, make("a", {
        href: `/competition/try/${each.id}`, class: "button", "data-key": `try-${each.id}`,
        "aria-label": `${words} try ${each.id}`,
      }, words)));
  }

  #run(tries) {
    if (this.#board === null) return;
    this.#running = tries;
    for (const each of tries) {
      const clock = this.#clocks.get(each.id);
      if (clock) setText(clock, `${each.try_time_s.toFixed(1)} s`);
    }
    const lines = tries.map((each) => make("p", { class: "flight" },
      make("span", { class: "label" }, "Flying now"), nameOf(each.team_name || "no team", { class: "name" }),
      make("span", { class: "where" }, each.scenario), frameMarks(each.frames, each.crossed),
      make("span", { class: "clock" }, `${each.try_time_s.toFixed(1)} s`)));
    const next = this.#board.next;
    lines.push(next === null
      ? make("p", { class: "hint" }, "Nobody is called. A try that begins now has no team until a judge says whose it is.")
      : make("p", { class: "flight next" }, make("span", { class: "label" }, "Next"), nameOf(next.team_name, { class: "name" }),
        make("span", { class: "where" }, next.scenario || "whatever the drone flies")));
    this.#now.replaceChildren(...lines);
  }
}

function exports() {
  return make("span", { class: "exports" },
    make("a", { href: "/api/competition/ranking.csv", download: true }, "ranking.csv"),
    make("a", { href: "/api/competition/tries.csv", download: true }, "tries.csv"));
}

const element = await whenThere("#competition");
new Desk(element, pageData(import.meta.url).judge === true);
