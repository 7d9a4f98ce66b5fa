/** What the audience's page shows between flights: who is next, the ranking, and at the end the podium. */
import { isWaiting } from "../lib/contest/now.js";
import { Pages } from "../lib/contest/pages.js";
import { nameOf } from "../lib/contest/words.js";
import { make, number } from "../lib/dom.js";

/** @import {Queued, RankingOfRound, Stage} from "../competition/answers" */

const LONG = 24; // letters of a name that is written smaller
const PLACES = 3;

/** A name in large letters; a long one in smaller ones. @param {string} name @param {string} kind class */
export function bigName(name, kind) {
  return make("p", { class: kind, "data-long": name.length > LONG }, nameOf(name));
}

/** Who is next beside the ranking. */
export class StageRanking {
  #next = make("div", { class: "s-next" });
  #rows = make("ol", { class: "s-rows" });
  #list = make("div", { class: "s-list" }, this.#rows);
  /** @type {string|null} */
  #shown = null;
  #pages;

  constructor() {
    const note = make("p", { class: "s-pages" });
    this.#pages = new Pages(this.#list, this.#rows, note);
    this.element = make("section", { class: "s-board" }, this.#next, make("div", { class: "s-standing" }, this.#list, note));
  }

  /** @param {Stage|null} stage as `/api/competition/stage` answers */
  show(stage) {
    const told = JSON.stringify([stage?.called, stage?.queue, stage?.last, stage?.ranking]);
    if (told === this.#shown) return;
    this.#shown = told;
    this.#next.replaceChildren(...nextWords(stage));
    const rows = stage?.ranking?.rows ?? [];
    this.#rows.replaceChildren(...rows.map((row) => make(
      "li", { "data-rank": String(row.rank) },
      make("span", { class: "s-rank" }, String(row.rank ?? "–")), nameOf(row.name, { class: "s-row-name" }),
      make("span", { class: "s-total" }, row.flown ? number(row.total_s) : "–"),
    )));
    this.#rows.hidden = rows.length === 0;
    this.#pages.fit();
  }
}

/** Who was called, who is next and who flew last. @param {Stage|null} stage */
function nextWords(stage) {
  const called = isWaiting(stage?.called ?? null) ? /** @type {Stage} */ (stage).called : null;
  const first = stage?.queue.teams[0] ?? null;
  const words = called || first
    ? [
      make("p", { class: "s-label" }, called ? "Called" : "Next"),
      bigName(/** @type {Queued} */ (called ?? first).team_name, "s-called"),
      make("p", { class: "s-where" }, called?.scenario ?? ""),
    ]
    : [bigName("No try is running", "s-called"), make("p", { class: "s-where" }, "Organisers call the next team on the page Competition.")];
  if (called && first) words.push(make("p", { class: "s-before" }, "Next: ", nameOf(first.team_name)));
  const last = stage?.last;
  if (last) {
    const worth = last.completed ? `${number(last.total_s)} s` : "not completed";
    words.push(make("p", { class: "s-before" }, "Last: ", nameOf(last.team_name || "without a team"), ` · ${worth}`));
  }
  return words;
}

/** The first three of a round that everybody has flown. */
export class Podium {
  #steps = make("ol", { class: "s-steps" });
  /** @type {string|null} */
  #shown = null;

  constructor() {
    this.element = make("section", { class: "s-podium", "aria-label": "podium" }, this.#steps);
  }

  /** @param {RankingOfRound} ranking of the round */
  show(ranking) {
    const told = JSON.stringify(ranking);
    if (told === this.#shown) return;
    this.#shown = told;
    this.#steps.replaceChildren(...ranking.rows.slice(0, PLACES).map((row, index) => make(
      "li", { "data-place": String(index + 1), "data-rank": String(row.rank) },
      bigName(row.name, "s-winner"), make("span", { class: "s-total" }, `${number(row.total_s, 2)} s`),
      make("span", { class: "s-step" }, String(row.rank)),
    )));
  }
}
