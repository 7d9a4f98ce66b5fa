/** What a judge's values do to the ranking, in sentences: also when they do nothing. */

import { seconds, worth } from "../lib/contest/words.js";

/**
 * @import {Rule, TryDetail} from "../competition/answers"
 * @import {Said} from "./form.js"
 */

/** @type {Record<string, string>} */
const BARRIERS = {
  "open class": "It is in no ranking: its mission is of the class open, faster than the contest allows.",
  "no team": "It counts for nobody until a team is set.",
  withdrawn: "It is in no ranking: the team is withdrawn.",
  "no scenario": "It is in no ranking: nobody knows which scenario was flown.",
  "not drawn": "It is in no ranking: its scenario is not one of the round's.",
};

/**
 * Say what a try counts, and which of a judge's values change nothing.
 * @param {TryDetail} detail of the try
 * @param {Said} now as the form says
 * @returns {string}
 */
export function effect(detail, now) {
  if (now.contradiction) {
    const missing = `${now.missing.join(", ")} ${now.missing.length === 1 ? "is" : "are"} missing`;
    return `Not completed while ${missing}: tick the frames or take “Completed” away.`;
  }
  return [`Counts ${seconds(now.counted_s)} s: ${worth(now)}.`, idle(detail.rule, now), standing(detail, now)]
    .filter((sentence) => sentence !== "").join(" ");
}

/**
 * Why a penalty of a try that is not completed changes nothing, as a note; "" if it counts.
 * @param {{penalty_s: number, completed: boolean}} result
 */
export function penaltyNote(result) {
  return result.penalty_s > 0 && !result.completed ? " (changes nothing: not completed)" : "";
}

/**
 * Time and penalty of a try that is not completed change nothing: say so where a judge gave them.
 * @param {Rule} rule @param {Said} now
 */
function idle(rule, now) {
  if (now.completed) return "";
  const given = [now.penalty_s > 0 ? "penalty" : "", now.try_time_changed ? "try time" : ""].filter((each) => each !== "");
  if (given.length === 0) return "";
  return `The ${given.join(" and the ")} ${given.length === 1 ? "changes" : "change"} nothing: a try that is not completed `
    + `counts ${rule.limit_s} s, and ${rule.missing_frame_s} s for each frame missing.`;
}

/**
 * Whether the ranking has this try, or another one of the team.
 * @param {TryDetail} detail @param {Said} now
 */
function standing(detail, now) {
  const { rival } = detail;
  const { barrier } = detail.try;
  if (barrier !== "") return BARRIERS[barrier];
  if (rival === null) return "";
  const mine = [now.counted_s, now.contacts, detail.try.id];
  const isLast = detail.try.id > rival.try;
  const isBetter = before(mine, [rival.counted_s, rival.contacts, rival.try]);
  if (detail.rule.counting === "last" ? isLast : isBetter) return "";
  return `The ranking stays as it is: of the team's tries here try ${rival.try} counts, ${seconds(rival.counted_s)} s.`;
}

/**
 * Whether one list of numbers comes before another: the first that differs decides.
 * @param {number[]} one @param {number[]} other
 */
function before(one, other) {
  const at = one.findIndex((value, index) => Math.round(value * 100) !== Math.round(other[index] * 100));
  return at >= 0 && one[at] < other[at];
}
