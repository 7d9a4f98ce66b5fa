/** A WebSocket to the monitor that is opened again after each loss, unless the monitor refused it. */

const REFUSED_CODE = 4403; // as 403 of HTTP; the reason is one line for people
const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 2000;

/**
 * @template {object} In
 * @typedef {object} SocketListener
 * @property {(message: In) => void} message told each message, which is JSON
 * @property {(state: "open"|"away"|"refused", reason: string) => void} state told whether there is a connection
 */

/** @template {object} Out what is sent @template {object} In what is received */
export class ReconnectingSocket {
  #url;
  #listener;
  #silence_ms;
  /** @type {WebSocket|null} */
  #socket = null;
  #isRefused = false;
  #wait_ms = FIRST_WAIT_MS;
  #timer = 0;
  #silence = 0;

  /**
   * Connect, and after each loss connect again, for as long as the page is shown.
   * @param {string} address such as "/ws/live?kinds=status"
   * @param {SocketListener<In>} listener
   * @param {{silence_ms?: number}} [options] silence_ms: a connection without a message for so long is taken for
   *   lost even if nobody closed it; 0: never
   */
  constructor(address, listener, { silence_ms = 0 } = {}) {
    this.#url = new URL(address, location.href);
    this.#url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    this.#listener = listener;
    this.#silence_ms = silence_ms;
    addEventListener("pagehide", () => this.close());
    addEventListener("pageshow", () => this.open());
    addEventListener("online", () => this.open());
    this.open();
  }

  /** Whether a message would be sent at once. */
  get isReady() {
    return this.#socket?.readyState === WebSocket.OPEN && this.#socket.bufferedAmount === 0;
  }

  /** @param {Out} message @returns {boolean} whether there is a connection to send it by */
  send(message) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  /** Connect now, unless there is a connection already or the monitor refused it. */
  open() {
    clearTimeout(this.#timer);
    if (this.#socket || this.#isRefused) return;
    const socket = new WebSocket(this.#url);
    this.#socket = socket;
    socket.onopen = () => {
      this.#wait_ms = FIRST_WAIT_MS;
      this.#listener.state("open", "");
    };
    socket.onmessage = (event) => {
      if (this.#socket !== socket) return;
      this.#awaitNext(socket);
      this.#listener.message(JSON.parse(event.data));
    };
    socket.onclose = (event) => this.#lose(socket, event.code, event.reason);
    this.#awaitNext(socket);
  }

  /** Close the connection; nobody is told, and only `open` or the page's return connects again. */
  close() {
    clearTimeout(this.#timer);
    clearTimeout(this.#silence);
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
  }

  /** @param {WebSocket} socket */
  #awaitNext(socket) {
    clearTimeout(this.#silence);
    if (this.#silence_ms > 0) this.#silence = setTimeout(() => this.#lose(socket, 0, ""), this.#silence_ms);
  }

  /** @param {WebSocket} socket the one that was lost @param {number} code @param {string} reason */
  #lose(socket, code, reason) {
    if (this.#socket !== socket) return;
    this.close();
    this.#isRefused = code === REFUSED_CODE;
    this.#listener.state(this.#isRefused ? "refused" : "away", reason);
    if (this.#isRefused) return;
    this.#timer = setTimeout(() => this.open(), this.#wait_ms);
    this.#wait_ms = Math.min(2 * this.#wait_ms, LONGEST_WAIT_MS);
  }
}
