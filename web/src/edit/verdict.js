/** What a flight was worth, in a pupil's words. */
import { number } from "../lib/dom.js";
import { translator } from "../lib/language.js";

const word = translator({
  en: {
    clean: "The drone did everything and landed on its base after {time} s.",
    wrong_order: "The drone flew through the frames in the wrong order: {crossed}.", crashed: "The drone crashed after {time} s, in the state {state}.",
    crashed_early: "The drone crashed after {time} s.", time_up: "The time was up after {time} s; the drone was still in the state {state}.",
    no_motors: "The drone never started its motors. The action hover does that.",
    beside: "The drone landed {distance} m from the middle of its base, not on it.", not_landed: "The drone did not take off and land.",
    no_hold: "The drone landed, but it was not at the point {place} for {seconds} s.", nearest: "The nearest it came to it was {distance} m; {radius} m or less counts.",
    no_face: "The drone landed, but it did not look at {colour} for {seconds} s from {least} to {most} m away.",
    no_crossing: "The drone landed, but it did not fly through {frames}.",
    ended_early: "The flight ended early: {reason}.", hit: "The drone hit {things}.", hit_at: "{thing} at {time} s", outside: "It was outside the arena for {time} s.",
    red: "the red frame", green: "the green frame", blue: "the blue frame", cyan: "the cyan frame", magenta: "the magenta frame", pole: "a pole", wall: "a wall",
    and: " and ",
    short_clean: "done", short_completed: "done, but not clean", short_time_up: "time was up", short_crashed: "crashed", short_aborted: "not all done", short_wrong_order: "wrong order", short_error: "fault of the program",
  },
  es: {
    clean: "El dron lo hizo todo y aterrizó en su base a los {time} s.",
    wrong_order: "El dron cruzó los marcos en otro orden: {crossed}.", crashed: "El dron se estrelló a los {time} s, en el estado {state}.",
    crashed_early: "El dron se estrelló a los {time} s.", time_up: "Se acabó el tiempo a los {time} s; el dron seguía en el estado {state}.",
    no_motors: "El dron no encendió los motores. Eso lo hace la acción hover.",
    beside: "El dron aterrizó a {distance} m del centro de su base, no en ella.", not_landed: "El dron no despegó y aterrizó.",
    no_hold: "El dron aterrizó, pero no estuvo {seconds} s en el punto {place}.", nearest: "Lo más cerca que estuvo fue a {distance} m; vale a {radius} m o menos.",
    no_face: "El dron aterrizó, pero no miró {colour} durante {seconds} s desde una distancia de {least} a {most} m.",
    no_crossing: "El dron aterrizó, pero no cruzó {frames}.",
    ended_early: "El vuelo acabó antes de tiempo: {reason}.", hit: "El dron chocó con {things}.", hit_at: "{thing} a los {time} s", outside: "Estuvo {time} s fuera de la arena.",
    red: "el marco rojo", green: "el marco verde", blue: "el marco azul", cyan: "el marco cian", magenta: "el marco magenta", pole: "un poste", wall: "una pared",
    and: " y ",
    short_clean: "hecho", short_completed: "hecho, pero no limpio", short_time_up: "sin tiempo", short_crashed: "se estrelló", short_aborted: "no todo hecho", short_wrong_order: "otro orden", short_error: "fallo del programa",
  },
});

/**
 * @typedef {{verdict: string, reason: string, frames_crossed?: string[], goal_times_s?: number[], contact_frames?: string[], contact_times_s?: number[],
 *   outside_s?: number, try_time_s?: number, landed_on_base?: boolean, landing_error_m?: number|null, mission_state?: string, ended?: string}} Result
 *   as result.json; what has its default may be missing
 * @typedef {{name: string, time_s: number}} Contact time since the start
 * @typedef {{goals?: Goal[], frames?: {colour: string}[]}} Layout what is needed of a scenario
 * @typedef {{hold_m: number[]|null, face: string|null, radius_m: number, distance_m: number[], seconds: number}} Goal
 */

/** The name of something in the arena. @param {string} name as contacts have it */
export const thingName = (name) => word(/** @type {any} */ (name)) ?? name;

/** @param {string[]} parts */
const list = (parts) => [parts.slice(0, -1).join(", "), parts.at(-1)].filter(Boolean).join(word("and"));
/** @param {number} value */
const seconds = (value) => number(value, 0);

/** What the drone hit, and when; "" if nothing. @param {Contact[]} contacts */
export function hitWords(contacts) {
  if (contacts.length === 0) return "";
  return word("hit", { things: list(contacts.map(({ name, time_s }) => word("hit_at", { thing: thingName(name), time: seconds(time_s) }))) });
}

/**
 * The first contact with each thing.
 * @param {Pick<Result, "contact_frames"|"contact_times_s">} result
 * @returns {Contact[]}
 */
export function contactsOf({ contact_frames = [], contact_times_s = [] }) {
  return contact_frames.map((name, index) => ({ name, time_s: contact_times_s[index] ?? 0 }))
    .filter(({ name }, index) => contact_frames.indexOf(name) === index);
}

/** A verdict in two or three words. @param {string} verdict */
export function shortVerdict(verdict) {
  const key = verdict === "timed out" ? "time_up" : verdict.replace(" ", "_");
  return word(/** @type {any} */ (`short_${key}`));
}

/**
 * A flight's verdict in one or two sentences, without what it hit.
 * @param {Result} result
 * @param {Layout|null} layout the scenario
 * @param {number[][]} places where the drone was
 */
export function verdictWords(result, layout, places) {
  const outside = (result.outside_s ?? 0) > 0 ? word("outside", { time: number(result.outside_s, 1) }) : "";
  return [judged(result, layout, places), outside].filter(Boolean).join(" ");
}

/** @param {Result} result @param {Layout|null} layout @param {number[][]} places */
function judged(result, layout, places) {
  const time = seconds(result.try_time_s ?? 0), state = result.mission_state ?? "";
  switch (result.verdict) {
    case "clean": case "completed": return word("clean", { time });
    case "wrong order": return word("wrong_order", { crossed: (result.frames_crossed ?? []).map(thingName).join(", ") });
    case "crashed": return state ? word("crashed", { time, state }) : word("crashed_early", { time });
    case "timed out": return word("time_up", { time, state });
    case "aborted": return unfinished(result, layout, places);
    default: return word("ended_early", { reason: result.reason });
  }
}

/** @param {Result} result @param {Layout|null} layout @param {number[][]} places */
function unfinished(result, layout, places) {
  const time = result.try_time_s ?? 0;
  if (result.ended && result.ended !== "finished") return word("ended_early", { reason: result.reason });
  if (time === 0) return word("no_motors");
  if (typeof result.landing_error_m !== "number") return word("not_landed");
  if (!result.landed_on_base) return word("beside", { distance: number(result.landing_error_m, 1) });
  const goal = (layout?.goals ?? [])[result.goal_times_s?.length ?? 0];
  if (goal) return missed(goal, places);
  const crossed = result.frames_crossed ?? [];
  const left = (layout?.frames ?? []).map(({ colour }) => colour).filter((colour) => !crossed.includes(colour));
  return word("no_crossing", { frames: list(left.map(thingName)) });
}

/** @param {Goal} goal @param {number[][]} places */
function missed({ hold_m, face, radius_m, distance_m, seconds: time }, places) {
  if (face) return word("no_face", { colour: thingName(face), seconds: String(time), least: String(distance_m[0]), most: String(distance_m[1]) });
  const [x, y, z] = hold_m ?? [];
  const nearest = Math.min(...places.map((place) => Math.hypot(place[0] - x, place[1] - y, place[2] - z)));
  const sentence = word("no_hold", { place: `(${x}, ${y}, ${z})`, seconds: String(time) });
  if (!(nearest > radius_m) || !Number.isFinite(nearest)) return sentence;
  return `${sentence} ${word("nearest", { distance: number(nearest, 2), radius: String(radius_m) })}`;
}
