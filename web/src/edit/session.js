/** The connection to the document that is edited; the server applies all edits, this page shows what comes back. */
import { ReconnectingSocket } from "../lib/reconnecting_socket.js";

const TYPING_PAUSE_MS = 150; // after which typed text is sent

/**
 * @typedef {{start: number, removed: number, inserted: string}} TextChange offsets in UTF-16 code units
 * @typedef {{line: number, column: number, start: number, end: number, severity: "error"|"warning"|"advice",
 *   code: string, message: string, path: string, transition: string|null}} Finding
 * @typedef {{path: string, name: string, parent: string, kind: "state"|"template", initial: boolean, final: boolean,
 *   use: string, states: number, enter: string[], during: string[], exit: string[], start: number, end: number}} StateNode
 * @typedef {{id: string, state: string, to: string|null, written: string, event: "tick"|"done"|"resume",
 *   index: number, when: string, actions: string[], start: number, end: number}} TransitionEdge
 * @typedef {{states: StateNode[], transitions: TransitionEdge[], mission: Object<string, string>,
 *   variables: Object<string, string>}} Diagram
 * @typedef {{x: number, y: number}} Point
 */

export class EditSession {
  #socket;
  #listener;
  #number = 0;
  /** @type {Map<number, (reply: any) => void>} */
  #waiting = new Map();
  /** @type {(() => TextChange[])|null} */
  #typed = null;
  #timer = 0;

  text = "";
  revision = -1;
  /** @type {Diagram} */
  diagram = { states: [], transitions: [], mission: {}, variables: {} };
  /** @type {Finding[]} */
  findings = [];
  /** @type {Object<string, Point>} */
  layout = {};
  name = "";
  isSaved = true;
  canUndo = false;
  canRedo = false;
  others = 0;

  /**
   * @param {string} address of the document's WebSocket
   * @param {{changed: (changes: TextChange[]|null) => void, connected: (state: string, reason: string) => void,
   *   refused: (reason: string) => void, status: () => void}} listener changed: told after each change of the
   *   document; null: all of its text is new
   */
  constructor(address, listener) {
    this.#listener = listener;
    this.#socket = new ReconnectingSocket(address, {
      message: (message) => this.#receive(message),
      state: (state, reason) => {
        if (state !== "open") for (const answer of this.#waiting.values()) answer({ refused: "the connection was lost" });
        this.#waiting.clear();
        listener.connected(state, reason);
      },
    });
  }

  /**
   * Send an edit of the diagram, after what was typed before it.
   * @param {object} edit see offboard/authoring/edits.py
   * @returns {Promise<boolean>} whether it was applied; the reason, if not, is told to the listener
   */
  async edit(edit) {
    await this.flush();
    return this.#ask({ type: "edit", edit });
  }

  async undo() {
    await this.flush();
    return this.#ask({ type: "undo" });
  }

  async redo() {
    await this.flush();
    return this.#ask({ type: "redo" });
  }

  async save() {
    await this.flush();
    return this.#ask({ type: "save" });
  }

  /** Keep where states are drawn. @param {Object<string, Point|null>} places null forgets one */
  place(places) {
    for (const [path, point] of Object.entries(places)) {
      if (point) this.layout[path] = point;
      else delete this.layout[path];
    }
    return this.#ask({ type: "layout", places });
  }

  /** Text is being typed. @param {() => TextChange[]} take the changes since the last call */
  type(take) {
    this.#typed = take;
    this.isSaved = false;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.flush(), TYPING_PAUSE_MS);
  }

  /** Send what was typed now. */
  async flush() {
    clearTimeout(this.#timer);
    const changes = this.#typed?.() ?? [];
    this.#typed = null;
    if (changes.length > 0) await this.#ask({ type: "type", changes });
  }

  /** @param {object} message @returns {Promise<boolean>} */
  #ask(message) {
    this.#number += 1;
    const number = this.#number;
    if (!this.#socket.send({ ...message, number })) {
      this.#listener.refused("there is no connection to the editor's program; nothing was changed");
      return Promise.resolve(false);
    }
    return new Promise((resolve) => {
      this.#waiting.set(number, (reply) => {
        if (reply.refused) this.#listener.refused(reply.refused);
        resolve(!reply.refused);
      });
    });
  }

  /** @param {any} message */
  #receive(message) {
    if (message.type === "document" || message.type === "changed") {
      this.revision = message.revision;
      if (message.text !== undefined) this.text = message.text;
      else for (const { start, removed, inserted } of message.changes) {
        this.text = this.text.slice(0, start) + inserted + this.text.slice(start + removed);
      }
      Object.assign(this, {
        diagram: message.diagram, findings: message.findings, layout: message.layout ?? this.layout,
        name: message.name ?? this.name,
      });
      this.#setStatus(message);
      this.#listener.changed(message.text === undefined ? message.changes : null);
    } else if (message.type === "status") {
      this.#setStatus(message);
    }
    const answer = this.#waiting.get(message.answers);
    if (answer) {
      this.#waiting.delete(message.answers);
      answer(message);
    }
    this.#listener.status();
  }

  /** @param {any} message */
  #setStatus(message) {
    this.isSaved = message.saved ?? this.isSaved;
    this.canUndo = message.can_undo ?? this.canUndo;
    this.canRedo = message.can_redo ?? this.canRedo;
    this.others = message.others ?? this.others;
  }
}
