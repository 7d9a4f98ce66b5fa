/** The WebSocket of the sticks. */
import { ReconnectingSocket } from "../lib/reconnecting_socket.js";

/** @import {ManualControl} from "../lib/messages.js" */

export class ManualControlSocket {
  /** @type {ReconnectingSocket<ManualControl.FromPage, ManualControl.ToPage>} */
  #socket;

  /**
   * @param {{control: (message: ManualControl.ControlMessage) => void, reply: (message: ManualControl.Reply) => void,
   *   state: (state: "open"|"away"|"refused", reason: string) => void}} hear
   */
  constructor(hear) {
    this.#socket = new ReconnectingSocket("/ws/pilot", {
      message: (message) => {
        if (message.kind === "control") hear.control(message);
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
   * @param {ManualControl.Order["what"]} what
   * @param {boolean} confirmed
   * @returns {boolean} whether it could be sent
   */
  order(id, what, confirmed = false) {
    return this.#socket.send({ kind: "do", id, what, ...(confirmed ? { confirmed } : {}) });
  }
}
