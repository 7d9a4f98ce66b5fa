/** The choice of what is flown: a scenario, or a random layout instead. */
import { request } from "../lib/request.js";
import { choice, textField } from "./fields.js";
import { word } from "./words.js";

export const FIRST_SCENARIO = "test-case-1";

/** @typedef {{scenarios: string[], lessons: string[], levels: string[]}} Choices names of what can be flown */

/** @returns {Promise<Choices|null>} null: the server does not tell */
export function loadChoices() {
  return request("/api/editing/choices").catch(() => null);
}

/** Names as options of a choice. @param {string[]} names @returns {[string, string][]} */
export const options = (names) => names.map((each) => [each, each]);

/**
 * Fields for a scenario and, before it, a random layout.
 * @param {Choices} choices
 * @param {string} scenario that is chosen first
 * @param {(scenario: string) => void} changed
 */
export function scenarioFields({ scenarios, lessons }, scenario, changed) {
  let layout = "";
  return [
    choice(word("scenario"), options([...scenarios, ...lessons]), scenario, (value) => {
      scenario = value;
      changed(layout || scenario);
    }),
    textField(word("or_layout"), layout, (value) => {
      layout = value;
      changed(layout || scenario);
    }, { placeholder: "calm-17" }),
  ];
}
