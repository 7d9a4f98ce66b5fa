/** One try: a judge's form on a phone, and the history of all that judges said. Viewers read it. */

import "../lib/contest/contest.css";
import { ask, oneAtATime, send, watch } from "../lib/contest/channel.js";
import { effect, penaltyNote } from "./effect.js";
import { Fields } from "./form.js";
import { gateMarks, moment, nameOf, notCounted, orDash, seconds, standing } from "../lib/contest/words.js";
import { make, setText } from "../lib/dom.js";
import { pageData, pageRoot } from "../lib/page_data.js";
import { reasonOf } from "../lib/request.js";

/** @import {Judgement, Result, Team, Try, TryDetail} from "../competition/answers" */
/** @typedef {(term: string, ...values: (Node|string)[]) => HTMLElement[]} MakeRow */

const { judge, attempt } = /** @type {{judge: boolean, attempt: number}} */ (pageData());

class TryPage {
  #line = make("p", { class: "line", role: "status", hidden: true });
  #head = make("div", { class: "panel head" });
  #form = make("form", { class: "panel fields judge", novalidate: true, hidden: true }); // until it is filled in
  #fields = new Fields(() => this.#preview());
  #team = make("select", { id: "try-team" });
  #counts = make("p", { class: "counts", "aria-live": "polite" });
  #save = make("button", { type: "submit", class: "main" }, "Save");
  #history = make("ol", { class: "history" });
  /** @type {TryDetail|null} */
  #detail = null;
  #stale = false;

  /** @param {HTMLElement} element */
  constructor(element) {
    element.append(
      make("p", {}, make("a", { href: "/competition" }, "← all tries")),
      make("h1", {}, `Try ${attempt}`), this.#line, this.#head,
      ...(judge ? [this.#teamForm(), this.#judgeForm()] : []),
      make("section", { class: "panel", "aria-labelledby": "history-title" },
        make("h2", { id: "history-title" }, "What judges changed"), this.#history));
    const refresh = oneAtATime(() => this.#load(false), (error) => this.#say(reasonOf(error)));
    watch({
      changed: refresh,
      running: (tries) => {
        if (tries.some((each) => each.id === attempt)) refresh();
      },
      link: (up) => {
        if (!up) this.#say("connection to the monitor lost, trying again");
      },
    });
  }

  #teamForm() {
    const form = make("form", { class: "panel fields", hidden: true }, make("label", { for: "try-team" }, "Whose try it is"),
      make("div", { class: "buttons" }, this.#team, make("button", { type: "submit" }, "Set")));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const team = this.#team.value === "" ? null : Number(this.#team.value);
      this.#attempt(() => send(`tries/${attempt}/team`, {
        seen: /** @type {TryDetail} */ (this.#detail).try.judgements, team,
      }), this.#fields.changed);
    });
    return form;
  }

  #judgeForm() {
    const back = make("button", { type: "button" }, "As the referee says");
    back.addEventListener("click", () => {
      if (confirm("Take all corrections of this try back? They stay in the history.")) {
        this.#attempt(() => send(`tries/${attempt}/judgement`, {
          seen: /** @type {TryDetail} */ (this.#detail).try.judgements,
        }), false);
      }
    });
    this.#form.append(make("h2", {}, "Correct"), ...this.#fields.elements,
      make("div", { class: "save" }, this.#counts, make("div", { class: "buttons" }, this.#save, back)));
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      const wrong = /** @type {HTMLInputElement|null} */ (this.#form.querySelector("input:invalid, select:invalid, textarea:invalid"));
      if (wrong && !wrong.reportValidity()) return;
      this.#attempt(
        () => send(`tries/${attempt}/judgement`, {
          seen: /** @type {TryDetail} */ (this.#detail).try.judgements, ...this.#fields.said,
        }), false);
    });
    return this.#form;
  }

  /**
   * Do what the judge asks.
   * @param {() => Promise<unknown>} work
   * @param {boolean} keep what is filled in but not saved
   */
  async #attempt(work, keep) {
    this.#save.disabled = true;
    try {
      await work();
      await this.#load(!keep, keep);
      this.#say(`Saved. ${this.#counts.textContent}`, "good");
    } catch (error) {
      this.#say(reasonOf(error));
      if (/** @type {{status?: number}} */ (error).status === 409) this.#offerNew();
    } finally {
      this.#save.disabled = false;
    }
  }

  /** @param {string} words "" takes them away @param {"bad"|"good"} look */
  #say(words, look = "bad") {
    setText(this.#line, words);
    this.#line.dataset.look = look;
    this.#line.hidden = words === "";
    if (words !== "") this.#line.scrollIntoView({ block: "center" }); // the form is longer than a phone's screen
  }

  /** Somebody else changed the try: what is filled in stays until the judge wants the new state. */
  #offerNew() {
    this.#stale = true;
    const button = make("button", { type: "button" }, "Show the new state");
    button.addEventListener("click", () => this.#load(true).then(() => this.#say("")));
    this.#line.replaceChildren("Another judge changed this try meanwhile. ", button);
    this.#line.dataset.look = "bad";
    this.#line.hidden = false;
  }

  /**
   * Ask for the try and show it.
   * @param {boolean} force also over what is filled in
   * @param {boolean} ownChange the change was ours: what is filled in is still good
   */
  async #load(force, ownChange = false) {
    const [detail, teams] = /** @type {[TryDetail, Team[]]} */ (
      await Promise.all([ask(`tries/${attempt}`), judge ? ask("teams") : []]));
    const before = this.#detail;
    const judged = before !== null && before.try.judgements !== detail.try.judgements;
    const filled = judge && before !== null && this.#fields.changed;
    if (filled && judged && !force && !ownChange) {
      this.#offerNew(); // and the number of judgements seen stays, so that saving is refused
      return;
    }
    if (this.#stale && !force) return;
    this.#stale = false;
    this.#detail = detail;
    if (!this.#line.hidden && this.#line.dataset.look === "bad" && !filled) this.#say("");
    this.#showHead(detail);
    this.#showHistory(detail.history);
    if (!judge) return;
    this.#showTeams(teams, detail.try.team, before?.try.team);
    if (!filled || force) this.#fields.show(detail);
    for (const form of [this.#form, this.#team.form]) if (form) form.hidden = false;
    this.#preview();
  }

  /** @param {TryDetail} detail */
  #showHead(detail) {
    const each = detail.try;
    const result = each.result;
    /** @type {MakeRow} */
    const row = (term, ...values) => [make("dt", {}, term), make("dd", {}, ...values)];
    const rows = [
      ...row("Team", each.team === null ? make("span", { class: "tag warn" }, "no team") : nameOf(each.team_name)),
      ...row("Scenario", orDash(each.scenario), each.round === 0 ? ", before the draw" : `, round ${each.round} `, notCounted(each) ?? ""),
      ...row("State", each.state === "running" ? "running" : standing(each)),
      ...(judge ? [] : values(each, result, row)),
      ...row("Counts", make("strong", {}, each.judged ? `${seconds(result.counted_s)} s` : "not yet judged")),
      ...row("Referee", each.reason || "–", each.source === "" ? "" : ` (by ${each.source}${each.final ? ", final" : ""})`),
    ];
    this.#head.replaceChildren(make("dl", {}, ...rows));
  }

  /**
   * @param {Team[]} teams
   * @param {number|null} team whose it is
   * @param {number|null|undefined} before whose it was as shown; undefined: nothing was shown
   */
  #showTeams(teams, team, before) {
    const text = JSON.stringify(teams);
    if (this.#team.dataset.shown === text && team === before) return;
    this.#team.dataset.shown = text;
    this.#team.replaceChildren(make("option", { value: "" }, "nobody's"),
      ...teams.map((each) => make("option", { value: String(each.id) }, each.name)));
    this.#team.value = team === null ? "" : String(team);
  }

  #preview() {
    if (this.#detail === null) return;
    setText(this.#counts, effect(this.#detail, this.#fields.counts(this.#detail.try.frames, this.#detail.rule)));
    this.#save.textContent = this.#fields.changed ? "Save" : "Confirm";
  }

  /** @param {Judgement[]} entries */
  #showHistory(entries) {
    if (entries.length === 0) {
      this.#history.replaceChildren(make("li", { class: "hint" }, "Nothing: it stands as the referee says."));
      return;
    }
    this.#history.replaceChildren(...entries.map((entry) => make("li", {},
      make("div", { class: "by" }, nameOf(entry.who), ` at ${moment(entry.at)}`),
      make("div", {}, ...describe(entry)),
      entry.remarks === "" ? null : make("p", { class: "remarks", dir: "auto" }, entry.remarks))));
  }
}

/**
 * What the form shows to judges, for those who only look.
 * @param {Try} each @param {Result} result @param {MakeRow} row
 */
function values(each, result, row) {
  return [
    ...row("Frames", gateMarks(each.frames, result.crossed), ` ${result.crossed.join(", ") || "none"}`),
    ...row("Completed", result.completed ? "yes" : "no"),
    ...row("Contacts", String(result.contacts)),
    ...row("Try time", `${seconds(result.try_time_s)} s`),
    ...row("Penalty", `${seconds(result.penalty_s)} s${penaltyNote(result)}`),
  ];
}

/** What an entry of the history says. @param {Judgement} entry */
function describe(entry) {
  if (entry.kind === "team") return ["team: ", entry.team_name === "" ? "nobody's" : nameOf(entry.team_name)];
  const parts = [];
  if (entry.crossed !== null) parts.push(`crossed: ${entry.crossed.join(", ") || "none"}`);
  if (entry.completed !== null) parts.push(entry.completed ? "completed" : "not completed");
  if (entry.contacts !== null) parts.push(`contacts: ${entry.contacts}`);
  if (entry.penalty_s !== null) parts.push(`penalty: ${seconds(entry.penalty_s)} s`);
  if (entry.try_time_s !== null) parts.push(`try time: ${seconds(entry.try_time_s)} s`);
  return [parts.join("; ") || "as the referee says"];
}

new TryPage(pageRoot("try"));
