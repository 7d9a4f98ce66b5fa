/**
 * The live channel, by kinds of messages (docs/monitor-channels.md).
 *
 *     const channel = new LiveChannel();
 *     channel.on("pose", (message) => …);
 *     channel.onState((state) => …);   // "open" or "away"
 */
import { ReconnectingSocket } from "./reconnecting_socket.js";

/** @import {Live} from "./messages.js" */

const SILENCE_MS = 7000; // a status comes every two seconds

export class LiveChannel {
  /** @type {Map<string, ((message: any) => void)[]>} */
  #listeners = new Map();
  /** @type {((state: "open"|"away") => void)[]} */
  #stateListeners = [];
  /** @type {ReconnectingSocket<never, Live.ToPage>} */
  #socket;

  /** @param {string[]} kinds of messages that are wanted; none: all */
  constructor(kinds = []) {
    const query = kinds.length ? `?kinds=${kinds.join(",")}` : "";
    const isWatched = !kinds.length || kinds.includes("status");
    this.#socket = new ReconnectingSocket(`/ws/live${query}`, {
      message: (message) => {
        for (const hear of this.#listeners.get(message.kind) ?? []) hear(message);
      },
      state: (state) => {
        for (const hear of this.#stateListeners) hear(state === "open" ? "open" : "away");
      },
    }, { silence_ms: isWatched ? SILENCE_MS : 0 });
  }

  /**
   * Hear messages of a kind.
   * @template {Live.ToPage["kind"]} K
   * @param {K} kind as in docs/monitor-channels.md
   * @param {(message: Extract<Live.ToPage, {kind: K}>) => void} hear
   */
  on(kind, hear) {
    const listeners = this.#listeners.get(kind) ?? [];
    this.#listeners.set(kind, [...listeners, hear]);
  }

  /** Hear whether the monitor is reached. @param {(state: "open"|"away") => void} hear */
  onState(hear) {
    this.#stateListeners.push(hear);
  }

  /** Connect now, unless there is a connection. */
  open() {
    this.#socket.open();
  }

  /** Replace a connection that seems to be lost. */
  reopen() {
    this.#socket.close();
    this.#socket.open();
  }
}
