/**
 * The live channel: one WebSocket that comes back by itself.
 *
 *     const channel = new LiveChannel();
 *     channel.on("pose", (message) => …);
 *     channel.onState((state) => …);   // "open" or "away"
 */

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 2000;
const SILENCE_MS = 7000; // a status comes every two seconds; a link that fell silent is gone even if nobody closed it

export class LiveChannel {
  /** @param {string[]} kinds of messages that are wanted; none: all */
  constructor(kinds = []) {
    this.listeners = new Map();
    this.stateListeners = [];
    this.wait = FIRST_WAIT_MS;
    this.url = new URL("/ws/live", location.href);
    this.url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    this.isWatched = !kinds.length || kinds.includes("status");
    if (kinds.length) this.url.searchParams.set("kinds", kinds.join(","));
    addEventListener("pagehide", () => this.pause());
    addEventListener("pageshow", () => this.open());
    addEventListener("online", () => this.open());
    this.open();
  }

  /**
   * Hear messages of a kind.
   * @param {string} kind as in docs/monitor-channels.md
   * @param {(message: object) => void} hear
   */
  on(kind, hear) {
    if (!this.listeners.has(kind)) this.listeners.set(kind, []);
    this.listeners.get(kind).push(hear);
  }

  /** Hear whether the monitor is reached. @param {(state: "open"|"away") => void} hear */
  onState(hear) {
    this.stateListeners.push(hear);
  }

  /** Connect, unless it is. */
  open() {
    clearTimeout(this.timer);
    if (this.socket) return;
    const socket = new WebSocket(this.url);
    this.socket = socket;
    socket.onopen = () => {
      this.wait = FIRST_WAIT_MS;
      this.tell("open");
    };
    socket.onmessage = (event) => {
      if (this.socket !== socket) return;
      this.listen(socket);
      this.take(event.data);
    };
    socket.onclose = () => this.lose(socket);
    this.listen(socket);
  }

  /** Count a silence from now on as a loss. @param {WebSocket} socket */
  listen(socket) {
    clearTimeout(this.silence);
    if (this.isWatched) this.silence = setTimeout(() => this.lose(socket), SILENCE_MS);
  }

  /** Go on after a loss: wait a little, then connect again. @param {WebSocket} socket the one lost */
  lose(socket) {
    if (this.socket !== socket) return;
    this.pause();
    this.tell("away");
    this.timer = setTimeout(() => this.open(), this.wait);
    this.wait = Math.min(2 * this.wait, LONGEST_WAIT_MS);
  }

  /** Let go, for a page that is left or put aside. */
  pause() {
    clearTimeout(this.timer);
    clearTimeout(this.silence);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
  }

  take(text) {
    const message = JSON.parse(text);
    for (const hear of this.listeners.get(message.kind) ?? []) hear(message);
  }

  tell(state) {
    for (const hear of this.stateListeners) hear(state);
  }
}
