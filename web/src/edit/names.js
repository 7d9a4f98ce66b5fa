/** The names that a mission can use, with what they mean. */
import { make } from "../lib/dom.js";
import { textField } from "./fields.js";
import { word } from "./words.js";

/** @typedef {import("./session.js").ValueEntry} ValueEntry */

/** The range and unit of a value. @param {ValueEntry} value */
export function bounds({ low, high, unit }) {
  const range = low !== null && high !== null ? `${low} … ${high}` : low !== null ? `≥ ${low}` : high !== null ? `≤ ${high}` : "";
  return [range, unit].filter(Boolean).join(" ");
}

/**
 * Show all names; the search that is typed stays.
 * @param {HTMLElement} root
 * @param {import("../lib/messages.js").Documents.Catalogue} catalogue
 */
export function showNames(root, { values, primitives }) {
  const key = JSON.stringify([values, primitives]);
  if (root.dataset.shown === key) return;
  root.dataset.shown = key;
  const list = make("dl", {});
  /** @param {string} search */
  const fill = (search) => {
    const rows = [
      ...primitives.map(({ name, text }) => [name, text]),
      ...values.map((value) => [value.name, [value.text, bounds(value)].filter(Boolean).join(" – ")]),
    ];
    list.replaceChildren(...rows.filter((row) => row.join(" ").includes(search))
      .flatMap(([name, text]) => [make("dt", {}, name), make("dd", {}, text)]));
  };
  const field = textField(word("search"), "", fill);
  field.querySelector("input")?.addEventListener("input", (event) => fill(/** @type {HTMLInputElement} */ (event.target).value.trim()));
  fill("");
  root.replaceChildren(field, list);
}
