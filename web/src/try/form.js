/** The fields of a judge's form: each knows what the referee says, and whether the judge says something else. */

import { make, setText } from "../lib/dom.js";

/**
 * @import {Rule, TryDetail} from "../competition/answers"
 *
 * @typedef {object} Said what a try would count, as the form says
 * @property {string[]} missing frames
 * @property {boolean} completed
 * @property {boolean} contradiction completed is ticked while frames are missing
 * @property {number} counted_s
 * @property {number} contacts
 * @property {number} penalty_s
 * @property {boolean} try_time_changed
 */

/** A field that holds a number. */
class NumberField {
  /**
   * @param {string} id
   * @param {string} label
   * @param {{step: number, decimals: number, most: number, unit: string, note?: string}} kind
   * @param {function(): void} changed
   */
  constructor(id, label, kind, changed) {
    this.kind = kind;
    this.input = make("input", {
      id, type: "number", min: "0", max: String(kind.most), step: kind.decimals === 0 ? "1" : "any", required: true,
      inputmode: kind.decimals === 0 ? "numeric" : "decimal",
    });
    this.hint = make("p", { class: "hint", id: `${id}-referee` });
    this.input.setAttribute("aria-describedby", this.hint.id);
    this.input.addEventListener("input", changed);
    /** @param {number} by */
    const step = (by) => {
      const button = make("button", { type: "button", class: "step", "aria-label": `${by < 0 ? "less" : "more"}: ${label}` },
        by < 0 ? "−" : "+");
      button.addEventListener("click", () => {
        const value = Math.min(kind.most, Math.max(0, (this.input.valueAsNumber || 0) + by));
        this.input.value = value.toFixed(kind.decimals);
        changed();
      });
      return button;
    };
    this.element = make("div", { class: "field" }, make("label", { for: id }, label),
      make("div", { class: "stepper" }, step(-kind.step), this.input, step(kind.step)), this.hint);
  }

  /** @param {number} referee @param {number} now @param {?number} corrected what the last correction says */
  show(referee, now, corrected) {
    this.referee = this.#text(referee);
    this.initial = this.#text(now);
    this.corrected = corrected;
    this.input.value = this.initial;
    setText(this.hint, `referee: ${this.referee}${this.kind.unit}${this.kind.note ?? ""}`);
  }

  /** @param {number} value */
  #text(value) {
    return value.toFixed(this.kind.decimals);
  }

  get changed() {
    return this.input.value !== this.initial;
  }

  /** What the judge says; null for "as the referee says". */
  get said() {
    if (!this.changed) return this.corrected;
    const value = this.input.valueAsNumber;
    return Number.isFinite(value) && this.#text(value) === this.referee ? null : value;
  }

  get value() {
    return this.input.valueAsNumber || 0;
  }
}

/** A field of boxes to tick. */
class TickField {
  /** @param {string} title @param {function(): void} changed */
  constructor(title, changed) {
    this.onChange = changed;
    /** @type {Map<string, HTMLInputElement>} */
    this.boxes = new Map();
    this.hint = make("p", { class: "hint" });
    this.ticks = make("div", { class: "ticks" });
    this.element = make("fieldset", { class: "field" }, make("legend", {}, title), this.ticks, this.hint);
  }

  /** @param {string[][]} choices value and label of each */
  offer(choices) {
    this.boxes.clear();
    this.ticks.replaceChildren(...choices.map(([value, label]) => {
      const box = make("input", { type: "checkbox", value });
      box.addEventListener("change", this.onChange);
      this.boxes.set(value, box);
      return make("label", { class: "tick big", "data-colour": value }, box, make("span", { class: "swatch" }), label);
    }));
  }

  /** @param {string[]} referee @param {string[]} now @param {?string[]} corrected @param {string} words of the referee */
  show(referee, now, corrected, words) {
    this.referee = [...referee].sort().join();
    this.initial = [...now].sort().join();
    this.corrected = corrected;
    for (const [value, box] of this.boxes) box.checked = now.includes(value);
    setText(this.hint, `referee: ${words}`);
  }

  get ticked() {
    return [...this.boxes].filter(([, box]) => box.checked).map(([value]) => value);
  }

  get changed() {
    return [...this.ticked].sort().join() !== this.initial;
  }

  /** What the judge says; null for "as the referee says". */
  get said() {
    if (!this.changed) return this.corrected;
    return [...this.ticked].sort().join() === this.referee ? null : this.ticked;
  }
}

/** All that a judge can correct. */
export class Fields {
  /** @param {function(): void} changed called when the judge changes something */
  constructor(changed) {
    this.crossed = new TickField("Frames crossed, in their turn", changed);
    this.completed = new TickField("Completed", changed);
    this.contacts = new NumberField("contacts", "Contacts with frames", { step: 1, decimals: 0, most: 1000, unit: "", note: "; between equal totals fewer contacts win" }, changed);
    this.penalty = new NumberField("penalty", "Penalty, seconds", { step: 1, decimals: 2, most: 36000, unit: " s" }, changed);
    this.time = new NumberField("time", "Try time, seconds", { step: 0.1, decimals: 2, most: 36000, unit: " s" }, changed);
    this.remarks = make("textarea", { id: "remarks", maxlength: "1000", rows: "3", dir: "auto" });
    this.remarks.addEventListener("input", changed);
    this.remarksShown = "";
    this.elements = [
      this.crossed.element, this.completed.element, this.contacts.element, this.penalty.element, this.time.element,
      make("div", { class: "field" }, make("label", { for: "remarks" }, "Remarks"), this.remarks),
    ];
    this.completed.offer([["completed", "all frames crossed and landed on the base in time"]]);
    this.all = [this.crossed, this.completed, this.contacts, this.penalty, this.time];
  }

  /** @param {TryDetail} detail of a try */
  show(detail) {
    const { referee, result, frames } = detail.try;
    const said = detail.correction;
    /** @param {boolean} completed */
    const ticks = (completed) => (completed ? ["completed"] : []);
    this.crossed.offer(frames.map((colour) => [colour, colour]));
    this.crossed.show(referee.crossed, result.crossed, said?.crossed ?? null, referee.crossed.join(", ") || "none");
    const saidCompleted = said?.completed ?? null;
    this.completed.show(ticks(referee.completed), ticks(result.completed),
      saidCompleted === null ? null : ticks(saidCompleted), referee.completed ? "yes" : "no");
    this.contacts.show(referee.contacts, result.contacts, said?.contacts ?? null);
    this.penalty.show(referee.penalty_s, result.penalty_s, said?.penalty_s ?? null);
    this.time.show(referee.try_time_s, result.try_time_s, said?.try_time_s ?? null);
    this.remarksShown = said?.remarks ?? "";
    this.remarks.value = this.remarksShown;
  }

  get changed() {
    return this.all.some((field) => field.changed) || this.remarks.value !== this.remarksShown;
  }

  /** What the form says now, for the interface. */
  get said() {
    const completed = this.completed.said;
    return {
      crossed: this.crossed.said,
      completed: completed ? completed.length > 0 : null,
      contacts: this.contacts.said,
      penalty_s: this.penalty.said,
      try_time_s: this.time.said,
      remarks: this.remarks.value,
    };
  }

  /** What the try would count, by a rule. @param {string[]} frames @param {Rule} rule @returns {Said} */
  counts(frames, rule) {
    const missing = frames.filter((colour) => !this.crossed.ticked.includes(colour));
    const completed = this.completed.ticked.length > 0;
    const contradiction = completed && missing.length > 0;
    const counted_s = completed && !contradiction
      ? this.time.value + this.penalty.value
      : rule.limit_s + missing.length * rule.missing_frame_s;
    return {
      missing,
      completed: completed && !contradiction,
      contradiction,
      counted_s,
      contacts: this.contacts.value,
      penalty_s: this.penalty.value,
      try_time_changed: this.time.changed,
    };
  }
}
