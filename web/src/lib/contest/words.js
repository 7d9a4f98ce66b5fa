/** How the contest's pages write numbers and states. */

import { make } from "../dom.js";

/** @import {Result, Try} from "./answers" */

/** Seconds with hundredths. @param {number} value */
export function seconds(value) {
  return value.toFixed(2);
}

/** A moment in the time of whoever looks. @param {string} iso */
export function moment(iso) {
  const date = new Date(iso);
  const sameDay = date.toDateString() === new Date().toDateString();
  const time = date.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit", hour12: false });
  return sameDay ? time : `${date.toLocaleDateString()} ${time}`;
}

/** What a try is worth, in a few words. @param {Try} each */
export function standing(each) {
  if (each.state === "running") return "running";
  if (each.state === "interrupted" && !each.judged) return "interrupted, to be judged";
  if (each.corrected_by) return worth(each.result);
  return each.verdict || worth(each.result);
}

/** @param {Pick<Result, "completed"|"missing">} result of a try */
export function worth(result) {
  if (result.completed) return "completed";
  const missing = result.missing.length;
  if (missing === 0) return "not completed";
  return `not completed, ${missing} ${missing === 1 ? "frame" : "frames"} missing`;
}

/**
 * A name that somebody typed: shown as text, and not turning the text around it.
 * @param {string} text
 * @param {Record<string, string>} [attributes]
 */
export function nameOf(text, attributes = {}) {
  return make("bdi", attributes, text);
}

/**
 * The gates of a try as marks: filled when crossed; each says its name.
 * @param {string[]} frames
 * @param {string[]} crossed
 */
export function gateMarks(frames, crossed) {
  const marks = make("span", { class: "marks" });
  for (const colour of frames) {
    const done = crossed.includes(colour);
    const words = `${colour} ${done ? "crossed" : "missing"}`;
    marks.append(make("span", {
      class: "mark", role: "img", "data-colour": colour, "data-done": String(done), "aria-label": words, title: words,
    }));
  }
  return marks;
}

const MARKED = ["not drawn", "open class"];

/**
 * A mark on a try that no ranking has for its scenario or class; null for all others.
 * @param {{barrier: string}} each a try, also a running one
 */
export function notCounted(each) {
  return MARKED.includes(each.barrier) ? make("span", { class: "tag warn" }, `${each.barrier}: does not count`) : null;
}

/** Whether there is a team, scenario or none: a dash for none. @param {string} text */
export function orDash(text) {
  return text === "" ? "–" : text;
}
