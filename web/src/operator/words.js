/** What the operator's page says. */

/** @import {Operator} from "../lib/messages.js" */

/**
 * Phases of a flight, as `offboard.safety.operator` names them.
 * @type {Record<string, string[]>}
 */
const PHASES = {
  checks: ["Checks", "the drone is checked; nothing is armed"],
  waiting: ["Ready", "hold Go to arm and take off"],
  flying: ["In flight", "Land ends the flight where the drone is"],
  landing: ["Landing", "Stop motors stops them at once: the drone falls"],
  holding: ["Holding", "it hovers, then lands; Land lands it now"],
  "stopping motors": ["Stopping motors", "Stop motors again requests it again"],
  "motors stopped": ["Motors stopped", ""],
  ended: ["Ended", ""],
};

/**
 * @param {Operator.FlightMessage|null} flight null without one
 * @param {Operator.BeatMessage|null} beat the latest; null before the first
 * @param {string} ended how the flight ended; empty if it goes on
 * @returns {{phase: string, head: string, words: string}}
 */
export function stateOf(flight, beat, ended) {
  if (ended) return { phase: "ended", head: "Ended", words: ended };
  if (!flight) return { phase: "none", head: "No flight", words: "start one with framerunner fly … --drone URL --monitor" };
  if (!beat) return { phase: "none", head: "Not known", words: "the flight has not said yet what it does" };
  const { phase } = beat;
  const [head, words] = PHASES[phase] ?? [phase, ""];
  if (phase === "checks" && flight.failed.length) {
    return { phase, head: "Not armed", words: `failed: ${flight.failed.join(", ")}` };
  }
  return { phase, head, words: [beat.words, words].filter(Boolean).join("; ") };
}

/**
 * The page's own connection to the flight, in words.
 * @param {{open: boolean, refused: string, hasFlight: boolean, age_ms: number, delay_ms: number|null, others: number}} link
 * @returns {{look: "good"|"bad"|"idle", words: string}}
 */
export function linkWords(link) {
  if (link.refused) return { look: "bad", words: link.refused };
  if (!link.open) return { look: "bad", words: "Not connected to the monitor. Use the remote control." };
  if (!link.hasFlight) return { look: "idle", words: "connected to the monitor" };
  if (link.age_ms > 1000) {
    return { look: "bad", words: `The app has not answered for ${(link.age_ms / 1000).toFixed(0)} s. Use the remote control.` };
  }
  const delay = link.delay_ms === null ? "" : `, delay ${link.delay_ms} ms`;
  const others = link.others ? `; ${link.others} more page${link.others > 1 ? "s" : ""}` : "";
  return { look: "good", words: `connected to the flight${delay}${others}` };
}
