/** The teams: entering them, calling one to fly, taking one out. */

import { send } from "../lib/contest/channel.js";
import { isWaiting } from "../lib/contest/now.js";
import { nameOf } from "../lib/contest/words.js";
import { make, setText } from "../lib/dom.js";

/** @import {Board, Call, RunningTry, Team} from "./answers" */

export class Teams {
  #page;
  #list = make("ul", { class: "teams" });
  #count = make("span", { class: "count" });
  #form = make("form", { class: "fields" });
  #title = make("h3", {}, "Enter a team");
  #name = make("input", { id: "team-name", maxlength: "60", required: true, autocomplete: "off", dir: "auto" });
  #members = make("input", { id: "team-members", maxlength: "300", autocomplete: "off", dir: "auto" });
  #save = make("button", { type: "submit", class: "main" }, "Enter");
  #cancel = make("button", { type: "button", hidden: true }, "Cancel");
  /** @type {Team|null} */
  #edited = null;

  /**
   * @param {Pick<import("./main.js").Page, "judge"|"attempt"> & {queue: import("./queue.js").Queue}} page
   */
  constructor(page) {
    this.#page = page;
    this.element = make("section", { class: "panel", "aria-labelledby": "teams-title" },
      make("h2", { id: "teams-title" }, "Teams ", this.#count), this.#list);
    if (!page.judge) return;
    this.#form.append(this.#title,
      make("label", { for: "team-name" }, "Name"), this.#name,
      make("label", { for: "team-members" }, "Members (optional)"), this.#members,
      make("div", { class: "buttons" }, this.#save, this.#cancel));
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#store();
    });
    this.#cancel.addEventListener("click", () => this.#edit(null));
    this.element.append(this.#form);
  }

  async #store() {
    const path = this.#edited === null ? "teams" : `teams/${this.#edited.id}`;
    const form = { name: this.#name.value, members: this.#members.value };
    if (await this.#page.attempt(() => send(path, form))) this.#edit(null);
  }

  /** @param {Team|null} team null: a new one */
  #edit(team) {
    this.#edited = team;
    this.#name.value = team?.name ?? "";
    this.#members.value = team?.members ?? "";
    setText(this.#title, team === null ? "Enter a team" : "Change the team");
    setText(this.#save, team === null ? "Enter" : "Save");
    this.#cancel.hidden = team === null;
    this.#name.focus();
  }

  /** @param {Board} board @param {RunningTry[]} running */
  show(board, running) {
    setText(this.#count, board.teams.length === 0 ? "" : String(board.teams.length));
    const flying = new Set(running.map((each) => each.team));
    const waiting = isWaiting(board.called) ? /** @type {Call} */ (board.called).team : null;
    /** @param {Team} team */
    const state = (team) => {
      const place = board.queue.teams.findIndex((each) => each.team === team.id) + 1;
      const inQueue = place > 0 ? `in the queue: ${place}` : "";
      return flying.has(team.id) ? "flying" : team.id === waiting ? "called" : inQueue;
    };
    if (board.teams.length === 0) {
      this.#list.replaceChildren(make("li", { class: "hint" }, this.#page.judge ? "No team has been entered. Enter the first one here." : "No team has been entered. Organisers enter them after their log-in."));
      return;
    }
    this.#list.replaceChildren(...board.teams.map((team) => this.#row(team, state(team))));
  }

  /** @param {Team} team @param {string} state "" for none */
  #row(team, state) {
    const row = make("li", { "data-team": String(team.id), "data-withdrawn": String(team.withdrawn) },
      make("span", { class: "who-is" }, nameOf(team.name, { class: "name" }),
        team.members === "" ? null : nameOf(team.members, { class: "members" })),
      team.withdrawn ? make("span", { class: "tag" }, "withdrawn") : null,
      state === "" ? null : make("span", { class: "tag good" }, state));
    if (!this.#page.judge) return row;
    /** @param {string} words @param {string} key @param {() => void} work */
    const button = (words, key, work) => {
      const element = make("button", { type: "button", "data-key": `${key}-${team.id}`, "aria-label": `${words}: ${team.name}` }, words);
      element.addEventListener("click", work);
      return element;
    };
    /** @param {boolean} withdrawn */
    const withdraw = (withdrawn) => this.#page.attempt(() => send(`teams/${team.id}`, { withdrawn }));
    row.append(make("span", { class: "buttons" },
      team.withdrawn || state.startsWith("in the queue")
        ? null
        : button("Queue", "queue", () => this.#page.queue.add(team.id)),
      button("Change", "change", () => this.#edit(team)),
      team.withdrawn
        ? button("Take back in", "withdraw", () => withdraw(false))
        : button("Withdraw", "withdraw", () => withdraw(true))));
    return row;
  }
}
