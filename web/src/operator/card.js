/** The flight card: checks first, those that failed at the top. */

import { make } from "../lib/dom.js";

/** @import {Operator} from "../lib/messages.js" */

const ORDER = ["FAIL", "accepted", "note", "pass"];

/** @param {Operator.CardSection[]} sections @returns {Node[]} */
export function cardOf(sections) {
  const checks = sections.find(({ rows }) => rows[0]?.cells.length === 5);
  const others = sections.filter((section) => section !== checks);
  const parts = checks ? [checksOf(checks.rows)] : [];
  return [...parts, ...others.map(({ title, rows }) => details(title, tableOf(rows)))];
}

/** @param {Operator.Row[]} rows */
function checksOf(rows) {
  const sorted = rows.toSorted((a, b) => ORDER.indexOf(a.cells[1]) - ORDER.indexOf(b.cells[1]));
  const bad = rows.filter(({ cells }) => cells[1] === "FAIL").length;
  const title = bad ? `Checks: ${bad} of ${rows.length} failed` : `Checks: all ${rows.length} done`;
  const list = make("ul", { class: "o-checks" }, ...sorted.map(({ cells: [name, result, value, limit, advice] }) => make(
    "li",
    { "data-result": result },
    make("b", {}, result),
    make("span", {}, `${name}: ${value}`, limit ? ` (allowed: ${limit})` : null, advice ? `; ${advice}` : null),
  )));
  return details(title, list, bad > 0);
}

/** @param {Operator.Row[]} rows */
function tableOf(rows) {
  return make("table", {}, make("tbody", {}, ...rows.map(({ cells }) => make("tr", {}, ...cells.map((cell, column) => make(
    column ? "td" : "th",
    column ? {} : { scope: "row" },
    cell,
  ))))));
}

/** @param {string} title @param {Node} content @param {boolean} open */
function details(title, content, open = false) {
  return make("details", { open }, make("summary", {}, title), content);
}
