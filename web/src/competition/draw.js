/** The scenarios of a round, drawn at random, and the rule by which tries are added up. */

import { send } from "../lib/contest/channel.js";
import { moment, nameOf } from "../lib/contest/words.js";
import { make, setText } from "../lib/dom.js";

/** @import {Board} from "./answers" */
/** @import {Page} from "./main.js" */

export class Draw {
  #page;
  #drawn = make("div", { class: "drawn" });
  #pool = make("div", { class: "pool" });
  #count = make("input", { id: "draw-count", type: "number", min: "1", max: "10", inputmode: "numeric" });
  #other = make("input", { id: "draw-other", maxlength: "80", autocomplete: "off", spellcheck: "false" });
  #flown = false;
  /** @type {string[]|null} */
  #known = null;

  /** @param {Page} page */
  constructor(page) {
    this.#page = page;
    this.element = make("section", { class: "panel", "aria-labelledby": "draw-title" },
      make("h2", { id: "draw-title" }, "Scenarios of the round"), this.#drawn);
    if (page.judge) this.element.append(this.#form());
  }

  #form() {
    const add = make("button", { type: "button" }, "Add");
    add.addEventListener("click", () => this.#add());
    this.#other.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      this.#add();
    });
    const form = make("form", { class: "fields" },
      make("fieldset", {}, make("legend", {}, "Draw from"), this.#pool),
      make("label", { for: "draw-other" }, "Another one: a random layout such as calm-17, or the name of your own scenario"),
      make("div", { class: "buttons" }, this.#other, add),
      make("label", { for: "draw-count" }, "How many"), this.#count,
      make("div", { class: "buttons" }, make("button", { type: "submit", class: "main" }, "Draw")));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#draw();
    });
    return make("details", {}, make("summary", {}, "Draw scenarios"), form);
  }

  #add() {
    const name = this.#other.value.trim();
    return this.#page.attempt(async () => {
      await send("pool", { scenario: name });
      const known = /** @type {HTMLInputElement|null} */ (this.#pool.querySelector(`[value="${CSS.escape(name)}"]`));
      if (known) known.checked = true;
      else this.#tick(name, true);
      this.#other.value = "";
    });
  }

  /** @param {string} name of a scenario @param {boolean} checked */
  #tick(name, checked) {
    const box = make("input", { type: "checkbox", value: name });
    box.checked = checked;
    this.#pool.append(make("label", { class: "tick" }, box, name));
  }

  #draw() {
    const ticked = [.../** @type {NodeListOf<HTMLInputElement>} */ (this.#pool.querySelectorAll("input:checked"))].map((box) => box.value);
    const question = "Tries were flown in this round. Draw for the next round? The tries stay in theirs.";
    if (this.#flown && !confirm(question)) return;
    this.#page.attempt(() => send("draw", { pool: ticked, count: Number(this.#count.value) }));
  }

  /** @param {Board} board @param {string[]} scenarios that can be drawn */
  show(board, scenarios) {
    const draw = board.draws.find((each) => each.round === board.round);
    this.#flown = board.round > 0 && board.tries.some((each) => each.round === board.round);
    if (draw === undefined) {
      this.#drawn.replaceChildren(make("p", { class: "hint" },
        "Nothing has been drawn yet. Until then the first scenarios that are flown make the round."));
    } else {
      const items = draw.scenarios.map((name, index) =>
        make("li", {}, make("strong", {}, name), make("code", {}, draw.commands[index])));
      this.#drawn.replaceChildren(
        make("p", { class: "hint" }, `Round ${draw.round}, drawn by `, nameOf(draw.who),
          ` at ${moment(draw.at)} from ${draw.pool.length}.`),
        make("ol", {}, ...items));
    }
    if (this.#known === null && this.#page.judge) {
      for (const name of scenarios) this.#tick(name, true);
      this.#count.value = String(board.rule.scenarios);
      this.#known = scenarios;
    }
  }
}

export class Rule {
  #page;
  #words = make("p");
  #set = make("p", { class: "hint" });
  /** @type {Record<string, {value: string|number}>} inputs, which take a number for its text */
  #fields = {};
  #shown = "";

  /** @param {Page} page */
  constructor(page) {
    this.#page = page;
    this.element = make("section", { class: "panel", "aria-labelledby": "rule-title" },
      make("h2", { id: "rule-title" }, "Rule"), this.#words, this.#set);
    if (page.judge) this.element.append(this.#form());
  }

  #form() {
    /** @param {string} id @param {string} label @param {string} least @param {string} step */
    const number = (id, label, least, step) => {
      const input = make("input", { id, type: "number", min: least, step, required: true, inputmode: "decimal" });
      this.#fields[id] = input;
      return [make("label", { for: id }, label), input];
    };
    const counting = make("select", { id: "rule-counting" },
      make("option", { value: "best" }, "the best"), make("option", { value: "last" }, "the last"));
    this.#fields["rule-counting"] = counting;
    const form = make("form", { class: "fields" },
      ...number("rule-limit", "A try not completed counts, seconds", "1", "any"),
      ...number("rule-missing", "And for each frame missing, seconds", "0", "any"),
      ...number("rule-scenarios", "Scenarios of a round", "1", "1"),
      make("label", { for: "rule-counting" }, "Of several tries counts"), counting,
      make("div", { class: "buttons" }, make("button", { type: "submit", class: "main" }, "Set")));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#page.attempt(() => send("settings", {
        limit_s: Number(this.#fields["rule-limit"].value),
        missing_frame_s: Number(this.#fields["rule-missing"].value),
        scenarios: Number(this.#fields["rule-scenarios"].value),
        counting: counting.value,
      }));
    });
    return make("details", {}, make("summary", {}, "Change the rule"), form);
  }

  /** @param {Board} board */
  show(board) {
    const rule = board.rule;
    setText(this.#words, `Sum of try time and penalty over ${rule.scenarios} scenarios. A try that is not completed `
      + `counts ${rule.limit_s} s and ${rule.missing_frame_s} s for each frame missing; a scenario not flown counts `
      + `as if all were. Of several tries the ${rule.counting} counts.`);
    this.#set.replaceChildren(...(rule.at === null ? [] : ["Set by ", nameOf(rule.who), ` at ${moment(rule.at)}.`]));
    if (!this.#page.judge || this.#shown === JSON.stringify(rule)) return; // somebody may be typing
    this.#shown = JSON.stringify(rule);
    this.#fields["rule-limit"].value = rule.limit_s;
    this.#fields["rule-missing"].value = rule.missing_frame_s;
    this.#fields["rule-scenarios"].value = rule.scenarios;
    this.#fields["rule-counting"].value = rule.counting;
  }
}
