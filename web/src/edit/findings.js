/** The list of what the checker has found. */
import { make } from "../lib/dom.js";
import { button } from "./fields.js";
import { word } from "./words.js";

/** @typedef {import("./session.js").Finding} Finding */

/** What a finding says, with its line. @param {Finding} finding */
const said = ({ line, message }) => `${line ? `${line}: ` : ""}${message}`;

/** What keeps the mission from flying, in a line; "" if nothing does. @param {Finding[]} findings */
export function mistakeIn(findings) {
  const error = findings.find(({ severity }) => severity === "error");
  return error ? said(error) : "";
}

/** How many there are, as a sign behind the list's title. @param {Finding[]} findings */
export function signOf(findings) {
  const faults = findings.filter(({ severity }) => severity !== "advice").length;
  const errors = findings.filter(({ severity }) => severity === "error").length;
  return errors > 0 ? `${errors} ✗` : faults > 0 ? `${faults} !` : "✓";
}

/**
 * Show them, advice apart.
 * @param {HTMLElement} list
 * @param {Finding[]} findings
 * @param {(finding: Finding) => void} chosen
 */
export function showFindings(list, findings, chosen) {
  const row = (/** @type {Finding} */ finding) => make("li", { "data-severity": finding.severity },
    button(said(finding), () => chosen(finding), { class: "e-link" }));
  const faults = findings.filter(({ severity }) => severity !== "advice");
  const advice = findings.filter(({ severity }) => severity === "advice");
  const isOpen = list.querySelector("details")?.open ?? false;
  list.replaceChildren(
    faults.length > 0 ? make("ul", {}, ...faults.map(row)) : make("p", { class: "e-good" }, word("none")),
    ...(advice.length > 0 ? [make("details", { open: isOpen }, make("summary", {}, word("advice", { count: String(advice.length) })), make("ul", {}, ...advice.map(row)))] : []));
}
