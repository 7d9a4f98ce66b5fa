/** The WebSocket of the sticks; it comes back by itself unless it was refused. */

const REFUSED = 4403;
const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 4000;

export class PilotSocket {
  #socket = null;
  #wait = FIRST_WAIT_MS;
  #timer = 0;
  #hear;

  /**
   * @param {{seat: (message: object) => void, reply: (message: object) => void,
   *   state: (state: "open"|"away"|"refused", reason: string) => void}} hear
   */
  constructor(hear) {
    this.#hear = hear;
    addEventListener("pagehide", () => this.#socket?.close());
    addEventListener("pageshow", () => this.#open());
    addEventListener("online", () => this.#open());
    this.#open();
  }

  /**
   * Send where the sticks are, unless older ones still wait to be sent: late sticks are worse than none.
   * @param {import("./pilot_values.js").Sticks} sticks
   */
  sticks(sticks) {
    if (this.#socket?.readyState !== WebSocket.OPEN || this.#socket.bufferedAmount > 0) return;
    this.#socket.send(JSON.stringify({ kind: "sticks", ...sticks }));
  }

  /**
   * @param {number} id of the drone
   * @param {string} what
   * @param {boolean} confirmed
   * @returns {boolean} whether it could be sent
   */
  order(id, what, confirmed = false) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(JSON.stringify({ kind: "do", id, what, ...(confirmed ? { confirmed } : {}) }));
    return true;
  }

  #open() {
    clearTimeout(this.#timer);
    if (this.#socket) return;
    const url = new URL("/ws/pilot", location.href);
    url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(url);
    this.#socket = socket;
    socket.onopen = () => {
      this.#wait = FIRST_WAIT_MS;
      this.#hear.state("open", "");
    };
    socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      this.#hear[message.kind]?.(message);
    };
    socket.onclose = (event) => {
      if (this.#socket !== socket) return;
      this.#socket = null;
      this.#hear.state(event.code === REFUSED ? "refused" : "away", event.reason);
      if (event.code === REFUSED) return;
      this.#timer = setTimeout(() => this.#open(), this.#wait);
      this.#wait = Math.min(2 * this.#wait, LONGEST_WAIT_MS);
    };
  }
}
