/** Who flies now, who is called, and who comes next: three things that the contest's pages never mix up. */

import { gateMarks, nameOf, notCounted } from "./words.js";
import { make } from "../dom.js";

/** @import {Call, Queue, Queued, RunningTry} from "./answers" */

const NAMED_AFTER_NEXT = 3;

/**
 * The lines of those who fly, the team that is called and those in the queue.
 * @param {{running: RunningTry[], called: Call|null, queue: Pick<Queue, "teams">}} state
 * @returns {{lines: HTMLElement[], clocks: [HTMLElement, number][]}} clocks: an element and the seconds it shows
 */
export function nowLines({ running, called, queue }) {
  /** @type {[HTMLElement, number][]} */
  const clocks = [];
  const lines = running.map((each) => {
    const clock = make("span", { class: "clock" }, each.try_time_s.toFixed(1));
    clocks.push([clock, each.try_time_s]);
    return make("div", { class: "flight", "data-try": String(each.id) },
      make("span", { class: "label" }, "Flying now"),
      each.team === null
        ? make("span", { class: "name" }, `drone ${each.drone_id}, no team`)
        : nameOf(each.team_name, { class: "name" }),
      make("span", { class: "where" }, each.scenario), notCounted(each), gateMarks(each.frames, each.crossed),
      make("span", {}, clock, " s"));
  });
  if (isWaiting(called)) {
    lines.push(make("div", { class: "flight called" }, make("span", { class: "label" }, "Called"),
      nameOf(called.team_name, { class: "name" }), make("span", { class: "where" }, called.scenario)));
  }
  const [first, ...others] = queue.teams;
  if (first !== undefined) lines.push(nextLine(first, others));
  return { lines, clocks };
}

/**
 * Whether a team is called and has not taken off yet.
 * @template {{try: number|null}} Call
 * @param {Call|null} called
 * @returns {called is Call}
 */
export function isWaiting(called) {
  return called !== null && called.try === null;
}

/** @param {Queued} first @param {Queued[]} others */
function nextLine(first, others) {
  const then = others.slice(0, NAMED_AFTER_NEXT).flatMap((each, index) =>
    [index === 0 ? "then " : ", ", nameOf(each.team_name)]);
  const more = others.length - NAMED_AFTER_NEXT;
  return make("div", { class: "flight next" }, make("span", { class: "label" }, "Next"),
    nameOf(first.team_name, { class: "name" }),
    then.length === 0 ? null : make("span", { class: "where" }, ...then, more > 0 ? ` and ${more} more` : ""));
}
