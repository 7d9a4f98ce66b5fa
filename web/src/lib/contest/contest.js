/** What the contest knows of who flies, for pages that show a flight. */
import { ask, oneAtATime, watch } from "./channel.js";

/** @import {RunningTry, Stage} from "./answers" */

/**
 * @typedef {object} Contest
 * @property {RunningTry[]} running tries that are being flown, as in `/ws/competition`
 * @property {any} stage a `Stage`, as `/api/competition/stage` answers; null before the first answer
 */

/**
 * Follow the contest for as long as the page lives.
 * @param {function(Contest): void} hear told at each change
 */
export function watchContest(hear) {
  /** @type {Contest} */
  const known = { running: [], stage: null };
  const refresh = oneAtATime(async () => {
    /** @type {Stage} */
    const stage = await ask("stage");
    Object.assign(known, { stage, running: stage.running });
    hear(known);
  }, (error) => console.info(`the contest is not known: ${error.message}`));
  watch({
    changed: refresh,
    running: (tries) => {
      known.running = tries;
      hear(known);
    },
    link: () => {},
  });
}

/**
 * Whose flight a drone's is: the try that is being flown, else its last.
 * @param {Contest} contest
 * @param {number} id of the drone
 * @returns {any} a `RunningTry` or a `FlownTry`; null if nobody knows
 */
export function tryOf({ running, stage }, id) {
  const known = [...running, stage?.interrupted, stage?.last];
  return known.find((each) => each?.drone_id === id) ?? null;
}

/**
 * What the contest last knew of a drone's try that nobody judges any more, for `Figures`.
 * @param {Contest} contest
 * @param {number} id of the drone
 * @returns {import("../messages.js").Live.Figures|null} null if there is no such try
 */
export function interruptedFigures({ running, stage }, id) {
  const found = /** @type {Stage|null} */ (stage)?.interrupted;
  if (found?.drone_id !== id || running.some((each) => each.drone_id === id)) return null;
  return {
    try_time_s: found.try_time_s, penalty_s: found.penalty_s, total_time_s: found.total_s, contacts: null, limit_s: null,
    time_over: false, crossed: found.crossed, crossing_times_s: found.crossed.map((colour) => found.splits[colour] ?? null),
    next_colour: null, inside: true, motors_on: false, over: true, final: false, verdict: "interrupted",
    reason: "the monitor was restarted meanwhile: as it was last seen; a judge decides", source: "the contest's store",
  };
}
