/** Calling teams, taking a call back, and the queue of those who fly after. */

import { send } from "../lib/contest/channel.js";
import { isWaiting, nowLines } from "../lib/contest/now.js";
import { nameOf } from "../lib/contest/words.js";
import { make, setText } from "../lib/dom.js";

/** @import {Board, Call, LastCall, Queued, RunningTry, Team} from "./answers" */
/** @import {Page} from "./main.js" */

/** "Now and next": who flies, who is called, and an organiser's form to call a team. */
export class Calls {
  #page;
  #now = make("div", { class: "now" });
  #form = make("form", { class: "call" });
  #team = make("select", { id: "next-team" });
  #scenario = make("select", { id: "next-scenario" });
  #call = make("button", { type: "submit", class: "main" }, "Call");
  #undo = make("button", { type: "button", id: "undo-call" });
  /** @type {Board|null} */
  #board = null;

  /** @param {Page} page */
  constructor(page) {
    this.#page = page;
    this.element = make("section", { class: "panel", "aria-labelledby": "next-title" },
      make("h2", { id: "next-title" }, "Now and next"), this.#now);
    if (!page.judge) return;
    this.#form.append(
      make("label", { for: "next-team" }, "Team"), this.#team,
      make("label", { for: "next-scenario" }, "Scenario"), this.#scenario,
      make("div", { class: "buttons" }, this.#call, this.#undo));
    this.#team.addEventListener("change", () => this.#label());
    this.#undo.addEventListener("click", () => this.#takeBack());
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#callTeam();
    });
    this.element.append(this.#form);
  }

  /** The team that the form would call: the one chosen, or the first of the queue. */
  get #chosen() {
    const id = Number(this.#team.value) || /** @type {Board} */ (this.#board).queue.teams[0]?.team;
    return /** @type {Board} */ (this.#board).teams.find((team) => team.id === id) ?? null;
  }

  #callTeam() {
    const team = this.#chosen;
    if (team === null) {
      this.#page.say("the queue is empty and no team is chosen; choose one, or fill the queue with Add all teams");
      return;
    }
    const called = /** @type {Board} */ (this.#board).called;
    const question = `${called?.team_name} is called and has not flown. Call ${team.name} in its place?`;
    if (isWaiting(called) && /** @type {Call} */ (called).team !== team.id && !confirm(question)) return;
    const form = { team: team.id, scenario: this.#scenario.value };
    this.#page.attempt(async () => {
      await send("next", form);
      this.#team.value = "";
    });
  }

  #takeBack() {
    const call = /** @type {LastCall} */ (/** @type {Board} */ (this.#board).last_call);
    const tries = call.tries.join(", ");
    const question = `${call.tries.length === 1 ? `Try ${tries} was` : `Tries ${tries} were`} flown on this call and `
      + `would be nobody's: it would not count for ${call.team_name}. Take the call back?`;
    if (call.tries.length > 0 && !confirm(question)) return;
    this.#page.attempt(() => send("next/undo", { call: call.id }));
  }

  /** @param {Board} board */
  show(board) {
    this.#board = board;
    if (!this.#page.judge) return;
    const draw = board.draws.find((each) => each.round === board.round);
    const teams = board.teams.filter((team) => !team.withdrawn);
    const first = board.queue.teams[0];
    const nobody = first === undefined ? "choose a team" : `next in the queue: ${first.team_name}`;
    offer(this.#team, [["", nobody], ...teams.map((team) => [String(team.id), team.name])]);
    offer(this.#scenario, [["", "what the drone flies"], ...(draw?.scenarios ?? []).map((name) => [name, name])]);
    const call = board.last_call;
    this.#undo.hidden = call === null;
    if (call !== null) setText(this.#undo, `Take back the call of ${call.team_name}`);
    this.#label();
  }

  #label() {
    const team = this.#chosen;
    setText(this.#call, team === null ? "Call" : `Call ${team.name}`);
  }

  /** @param {RunningTry[]} tries that are flown now */
  run(tries) {
    if (this.#board === null) return;
    const { called, queue } = this.#board;
    const { lines } = nowLines({ running: tries, called, queue });
    if (called === null) {
      lines.push(make("p", { class: "hint" },
        "No team is called: a try that begins now has no team until a judge assigns it. ",
        this.#page.judge ? "Call one here." : "Organisers call one after their log-in."));
    }
    this.#now.replaceChildren(...lines);
  }
}

/**
 * Offer choices, and leave what is chosen as it is.
 * @param {HTMLSelectElement} select
 * @param {string[][]} options value and words of each
 */
function offer(select, options) {
  const chosen = select.value;
  const text = JSON.stringify(options);
  if (select.dataset.shown === text) return;
  select.dataset.shown = text;
  select.replaceChildren(...options.map(([value, words]) => make("option", { value }, words)));
  if (options.some(([value]) => value === chosen)) select.value = chosen;
}

/** The queue: everybody sees the order, organisers change it. */
export class Queue {
  #page;
  #list = make("ol", { class: "queue" });
  #count = make("span", { class: "count" });
  #all = make("button", { type: "button", id: "queue-all" }, "Add all teams");
  #shuffle = make("button", { type: "button", id: "queue-shuffle" }, "Shuffle");
  /** @type {Board|null} */
  #board = null;
  #busy = false;

  /** @param {Pick<Page, "judge"|"attempt">} page */
  constructor(page) {
    this.#page = page;
    this.element = make("section", { class: "panel", "aria-labelledby": "queue-title" },
      make("h2", { id: "queue-title" }, "Queue ", this.#count), this.#list);
    if (!page.judge) return;
    this.#all.addEventListener("click", () => this.#set([...this.#order, ...this.#absent]));
    this.#shuffle.addEventListener("click", () => this.#set(this.#order, true));
    this.element.append(make("div", { class: "buttons queue-buttons" }, this.#all, this.#shuffle));
  }

  get #order() {
    return /** @type {Board} */ (this.#board).queue.teams.map((each) => each.team);
  }

  /** Teams that take part and are not in the queue. */
  get #absent() {
    const order = this.#order;
    return /** @type {Board} */ (this.#board).teams
      .filter((team) => !team.withdrawn && !order.includes(team.id)).map((team) => team.id);
  }

  /** Put a team at the end of the queue. @param {number} team its id */
  add(team) {
    return this.#set([...this.#order, team]);
  }

  /** @param {number[]} teams their ids, in order */
  async #set(teams, shuffle = false) {
    if (this.#busy) return; // a second click would speak of an order that is not there any more
    this.#busy = true;
    await this.#page.attempt(() => send("queue", {
      seen: /** @type {Board} */ (this.#board).queue.number, teams, shuffle,
    }));
    this.#busy = false;
  }

  /** @param {number} team its id @param {number|null} place from 0; null: out of the queue */
  #move(team, place) {
    const order = this.#order.filter((each) => each !== team);
    if (place !== null) order.splice(place, 0, team);
    return this.#set(order);
  }

  /** @param {Board} board */
  show(board) {
    this.#board = board;
    const teams = board.queue.teams;
    setText(this.#count, teams.length === 0 ? "" : String(teams.length));
    this.#all.hidden = this.#absent.length === 0;
    this.#shuffle.hidden = teams.length < 2;
    if (teams.length === 0) this.#list.replaceChildren(make("li", { class: "hint" }, this.#page.judge ? "The queue is empty. Enter teams, then Add all teams." : "The queue is empty."));
    else this.#list.replaceChildren(...teams.map((each, place) => this.#row(each, place, teams.length - 1)));
  }

  /** @param {Queued} each @param {number} place from 0 @param {number} last place */
  #row(each, place, last) {
    const row = make("li", { "data-queued": String(each.team) },
      make("span", { class: "who-is" }, make("span", { class: "place" }, `${place + 1}`),
        nameOf(each.team_name, { class: "name" })));
    if (!this.#page.judge) return row;
    /**
     * @param {string} sign @param {string} words @param {string} key
     * @param {number|null} to place @param {boolean} disabled
     */
    const button = (sign, words, key, to, disabled) => {
      const element = make("button", {
        type: "button", disabled, title: words, "data-key": `${key}-${each.team}`, "aria-label": `${words}: ${each.team_name}`,
      }, sign);
      element.addEventListener("click", () => this.#move(each.team, to));
      return element;
    };
    row.append(make("span", { class: "buttons" },
      button("↑", "One place up", "up", place - 1, place === 0),
      button("↓", "One place down", "down", place + 1, place === last),
      button("Skip", "To the end", "skip", last, place === last),
      button("✕", "Out of the queue", "out", null, false)));
    return row;
  }
}
