/** The connection to flights: starts and controls one flight or a batch, and hears of them. */
import { language } from "../lib/language.js";
import { ReconnectingSocket } from "../lib/reconnecting_socket.js";
import { word } from "./words.js";

/**
 * @typedef {{id: string, to: string, when: string, holds: boolean|null}} Guard
 * @typedef {{run: string, full: boolean, time_s: number, state: string, active: string[], seconds_in_state: number, began_s: number|null,
 *   paused: boolean, stopped_in: string, guards: Guard[], values: {name: string, value: any, unit: string}[],
 *   taken: {ids: string[], time_s: number}[], counts: Object<string, number>, spans: {state: string, from_s: number, to_s: number}[],
 *   contacts: {name: string, time_s: number}[], pose: number[], trail: number[][]}} Now
 * @typedef {{batch: string, scenario: string, seed: number, verdict: string, completed: boolean, reason: string,
 *   lost_in: string, rank: number, total_time_s: number|null, counts: Object<string, number>,
 *   track: {x: number[], y: number[], z: number[], time_s: number[]}, layout: any, result: import("./verdict.js").Result}} Flight
 */

export class Flights {
  #socket;
  #listener;
  #tag = 0;
  /** @type {Map<number, (answer: any) => void>} */
  #waiting = new Map();

  /** @param {{heard: (message: any) => void, lost: () => void}} listener */
  constructor(listener) {
    this.#listener = listener;
    this.#socket = new ReconnectingSocket(`/ws/editing?language=${language()}`, {
      message: (message) => this.#hear(message),
      state: (state) => {
        if (state === "open") return;
        for (const answer of this.#waiting.values()) answer({ kind: "refused", text: word("lost_connection") });
        this.#waiting.clear();
        listener.lost();
      },
    });
  }

  /** Ask for something. @param {object} request @returns {Promise<any>} the answer; `kind` is "refused" if it was */
  ask(request) {
    this.#tag += 1;
    const tag = this.#tag;
    if (!this.#socket.send({ ...request, tag })) return Promise.resolve({ kind: "refused", text: word("no_connection") });
    return new Promise((resolve) => this.#waiting.set(tag, resolve));
  }

  #hear(message) {
    const answer = this.#waiting.get(message.tag);
    if (answer && message.tag && message.kind !== "waiting") {
      this.#waiting.delete(message.tag);
      answer(message);
    }
    this.#listener.heard(message);
  }
}

/** A state's id and those of the states around it, outermost first; none if it is empty. @param {string} id @returns {string[]} */
export function withOuterStates(id) {
  return id === "" ? [] : id.split(".").map((_, index, parts) => parts.slice(0, index + 1).join("."));
}

/** The id of a transition as flights have it. @param {import("./session.js").Edge} edge */
export function flownId({ source, event, order }) {
  return event === "tick" ? `${source}/${order + 1}` : `${source}/${event === "done" ? "then" : "resume"}`;
}
