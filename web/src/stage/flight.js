/** What the audience's page says of a flight: who, how long, how far, and how that compares with the best. */
import { nameOf } from "../lib/contest/words.js";
import { bigName } from "./board.js";
import { make, number, setAttribute, setText } from "../lib/dom.js";

/**
 * @import {FlownTry} from "../competition/answers"
 * @import {Live} from "../lib/messages.js"
 */

const GOOD = ["clean", "completed"];

/** The line at the top: team, time, and at the end the verdict. */
export class StageHead {
  #team = make("p", { class: "s-team" });
  #where = make("p", { class: "s-where" });
  #clock = make("output", { class: "s-clock", "aria-live": "off" }, "–");
  #verdict = make("p", { class: "s-verdict", role: "status" });
  #penalty = make("p", { class: "s-penalty" });

  constructor() {
    const who = make("div", { class: "s-who" }, this.#team, this.#where);
    const time = make("div", { class: "s-time" }, make("p", {}, this.#clock, make("small", {}, " s")), this.#penalty);
    this.element = make("header", { class: "s-head" }, who, this.#verdict, time);
  }

  /**
   * @param {object} told
   * @param {string} told.team @param {string} told.scenario @param {Live.Figures|null} told.figures
   * @param {boolean} told.isOver @param {number|null} told.rank
   */
  show({ team, scenario, figures, isOver, rank }) {
    if (this.#team.dataset.shown !== team) {
      const name = bigName(team, "s-team");
      this.#team.replaceWith(name);
      this.#team = name;
      this.#team.dataset.shown = team;
    }
    setText(this.#where, scenario);
    setText(this.#clock, number((isOver ? figures?.total_time_s : figures?.try_time_s) ?? null));
    const penalty = /** @type {number} */ (figures?.penalty_s) > 0
      ? `${isOver ? "with" : "and"} ${number(/** @type {Live.Figures} */ (figures).penalty_s)} s penalty`
      : "";
    const late = figures?.time_over && !isOver ? "time over" : "";
    setText(this.#penalty, late || penalty);
    const verdict = isOver ? figures?.verdict || "ended" : "";
    setText(this.#verdict, rank === null ? verdict : `${verdict} · rank ${rank}`);
    setAttribute(this.#verdict, "data-look", verdict ? (GOOD.includes(verdict) ? "good" : "bad") : null);
  }
}

/** The gates and the landing: time of each, and how much before or behind the best. */
export class Splits {
  #list = make("ol", { class: "s-tiles" });
  #against = make("p", { class: "s-against" });
  #shown = "";

  constructor() {
    this.element = make("section", { class: "s-splits", "aria-label": "split times" }, this.#list, this.#against);
  }

  /**
   * @param {Live.Figures|null} figures as in the live channel's status
   * @param {string[]} frames colours to cross, in order
   * @param {FlownTry|null} best try, as `/api/competition/stage` has it
   */
  show(figures, frames, best) {
    const isDone = Boolean(figures?.over) && GOOD.includes(/** @type {Live.Figures} */ (figures).verdict);
    const times = (figures?.crossed ?? []).map((colour, index) =>
      [colour, /** @type {Live.Figures} */ (figures).crossing_times_s?.[index] ?? null]);
    const own = Object.fromEntries(times);
    const told = JSON.stringify([own, frames, best, figures?.next_colour, figures?.over, isDone]);
    if (told === this.#shown) return;
    this.#shown = told;
    const tiles = frames.map((colour) => {
      const state = colour in own ? "crossed" : figures?.next_colour === colour && !figures.over ? "next" : "open";
      return tile(colour, colour, state, own[colour] ?? null, best?.splits[colour] ?? null);
    });
    const isLanding = figures !== null && figures.next_colour === null && !figures.over;
    const end = isDone ? /** @type {Live.Figures} */ (figures).total_time_s : null;
    tiles.push(tile("landed", "", isDone ? "crossed" : isLanding ? "next" : "open", end, best?.completed ? best.total_s : null));
    this.#list.replaceChildren(...tiles);
    const name = nameOf(best?.team_name || "without a team");
    this.#against.replaceChildren(...(best ? ["best: ", name, best.completed ? `, ${number(best.total_s)} s` : ", not completed"] : []));
  }
}

/**
 * @param {string} name @param {string} colour "" for the landing @param {"crossed"|"next"|"open"} state
 * @param {number|null} time seconds; null: not yet, or not known
 * @param {number|null} best seconds; null: there is none
 */
function tile(name, colour, state, time, best) {
  const gap = time !== null && best !== null ? time - best : null;
  const look = gap === null ? null : gap <= 0 ? "ahead" : "behind";
  const words = gap === null ? (best === null ? "" : `best ${number(best)}`) : `${gap <= 0 ? "▲ −" : "▼ +"}${number(Math.abs(gap))}`;
  return make(
    "li", { "data-colour": colour || null, "data-state": state, "data-split": name },
    make("span", { class: "s-name" }, name),
    make("span", { class: "s-split" }, time === null ? (state === "crossed" ? "✓" : state === "next" ? "…" : "–") : number(time)),
    make("span", { class: "s-gap", "data-look": look }, words),
  );
}
