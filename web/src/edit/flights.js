/** The connection to flights: starts and controls one flight or a batch, and hears of them. */
import { language } from "../lib/language.js";
import { ReconnectingSocket } from "../lib/reconnecting_socket.js";
import { word } from "./words.js";

/**
 * @import {Flights as Messages} from "../lib/messages.js"
 * @typedef {Messages.Now} Now
 * @typedef {Messages.Flight} Flight
 * @typedef {Messages.Done | Messages.Refused | Messages.Started | Messages.Changed | Messages.BatchStarted} Answer
 * @typedef {Messages.FromPage extends infer Each ? Each extends any ? Omit<Each, "tag"> : never : never} Request
 */

export class Flights {
  /** @type {ReconnectingSocket<Messages.FromPage, Messages.ToPage>} */
  #socket;
  #listener;
  #tag = 0;
  /** @type {Map<number, (answer: Answer) => void>} */
  #waiting = new Map();

  /** @param {{heard: (message: Messages.ToPage) => void, lost: () => void}} listener */
  constructor(listener) {
    this.#listener = listener;
    this.#socket = new ReconnectingSocket(`/ws/editing?language=${language()}`, {
      message: (message) => this.#hear(message),
      state: (state) => {
        if (state === "open") return;
        for (const answer of this.#waiting.values()) answer(refused(word("lost_connection")));
        this.#waiting.clear();
        listener.lost();
      },
    });
  }

  /** Ask for something. @param {Request} request @returns {Promise<Answer>} the answer; `kind` is "refused" if it was */
  ask(request) {
    this.#tag += 1;
    const tag = this.#tag;
    if (!this.#socket.send({ ...request, tag })) return Promise.resolve(refused(word("no_connection")));
    return new Promise((resolve) => this.#waiting.set(tag, resolve));
  }

  /** @param {Messages.ToPage} message */
  #hear(message) {
    const answer = "tag" in message ? this.#waiting.get(message.tag) : undefined;
    if (answer && "tag" in message && message.tag && message.kind !== "waiting") {
      this.#waiting.delete(message.tag);
      answer(message);
    }
    this.#listener.heard(message);
  }
}

/** @param {string} text @returns {Answer} of this page itself */
const refused = (text) => ({ kind: "refused", tag: 0, text, lines: [], run: "" });

/** A state's id and those of the states around it, outermost first; none if it is empty. @param {string} id @returns {string[]} */
export function withOuterStates(id) {
  return id === "" ? [] : id.split(".").map((_, index, parts) => parts.slice(0, index + 1).join("."));
}

/** The id of a transition as flights have it. @param {import("./session.js").Edge} edge */
export function flownId({ source, event, order }) {
  return event === "tick" ? `${source}/${order + 1}` : `${source}/${event === "done" ? "then" : "resume"}`;
}
