/** The WebSocket of the sticks. */
import { ReconnectingSocket } from "../lib/reconnecting_socket.js";

export class PilotSocket {
  #socket;

  /**
   * @param {{seat: (message: any) => void, reply: (message: any) => void,
   *   state: (state: "open"|"away"|"refused", reason: string) => void}} hear
   */
  constructor(hear) {
    this.#socket = new ReconnectingSocket("/ws/pilot", {
      message: (message) => {
        if (message.kind === "seat") hear.seat(message);
        else if (message.kind === "reply") hear.reply(message);
      },
      state: hear.state,
    });
  }

  /**
   * Send where the sticks are, unless older ones still wait to be sent: late sticks are worse than none.
   * @param {import("./values.js").Sticks} sticks
   */
  sticks(sticks) {
    if (this.#socket.isReady) this.#socket.send({ kind: "sticks", ...sticks });
  }

  /**
   * @param {number} id of the drone
   * @param {string} what
   * @param {boolean} confirmed
   * @returns {boolean} whether it could be sent
   */
  order(id, what, confirmed = false) {
    return this.#socket.send({ kind: "do", id, what, ...(confirmed ? { confirmed } : {}) });
  }
}
