/** The connection to the document that is edited; the server applies all edits, this page shows what comes back. */
import { language } from "../lib/language.js";
import { ReconnectingSocket } from "../lib/reconnecting_socket.js";

const TYPING_PAUSE_MS = 80; // after which typed text is sent

/**
 * @typedef {{start: number, removed: number, inserted: string}} TextChange offsets in UTF-16 code units
 * @typedef {[number, number]|null} Span offsets of the first character and of the one after the last
 * @typedef {{severity: "error"|"warning"|"advice", code: string, message: string, spanish?: string, line: number, span: Span,
 *   state: string, event: string|null, index: number|null, nodes: string[]}} Finding
 * @typedef {{id: string, name: string, parent: string, initial: string, final: boolean, finish: boolean, enter: string[],
 *   during: string[], exit: string[], parameters: [string, string][], template: string, source: string, span: Span}} StateNode
 * @typedef {{id: string, source: string, target: string, missing: boolean, event: "tick"|"done"|"resume", order: number, when: string,
 *   actions: string[], source_state: string, source_index: number, span: Span}} Edge
 * @typedef {{initial: string, readable: boolean, nodes: StateNode[], edges: Edge[]}} Diagram the chart as it is flown
 * @typedef {{x: number, y: number}} Point
 * @typedef {{name: string, type: string, text: string, unit: string, low: number|null, high: number|null,
 *   assignable: boolean, needs_map: boolean}} ValueEntry
 * @typedef {{name: string, text: string, help: string, needs_map: boolean}} PrimitiveEntry
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
  #sending = Promise.resolve();
  #isTypedUnderWay = false;

  revision = 0;
  /** @type {Diagram} */
  diagram = { initial: "", readable: true, nodes: [], edges: [] };
  /** @type {Object<string, string>} */
  mission = {};
  /** @type {Object<string, string>} */
  variables = {};
  /** @type {string[]} */
  templates = [];
  /** @type {{values: ValueEntry[], primitives: PrimitiveEntry[]}} */
  catalogue = { values: [], primitives: [] };
  /** @type {Finding[]} */
  findings = [];
  /** @type {Object<string, Point>} */
  layout = {};
  name = "";
  isReadable = true;
  isSaved = true;
  canUndo = false;
  canRedo = false;
  others = 0;

  /**
   * @param {string} address of the document's WebSocket
   * @param {{changed: (changes: TextChange[], text: string|null, isOwn: boolean) => void, placed: () => void,
   *   connected: (state: string, reason: string) => void, refused: (reason: string) => void, status: () => void,
   *   note: (text: string) => void}} listener changed: told after each change of the document; with a text that is
   *   not null, all of it is new; isOwn: this page asked for it; placed: told when states were moved
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

  async save(force = false) {
    await this.flush();
    return this.#ask({ type: "save", force });
  }

  /**
   * Keep where states are drawn.
   * @param {Object<string, Point|null>} places null forgets one
   * @param {boolean} [settled] the page has found these places: nothing to undo
   */
  async place(places, settled = false) {
    if (Object.keys(places).length === 0) return true;
    await this.flush();
    for (const [path, point] of Object.entries(places)) {
      if (point) this.layout[path] = point;
      else delete this.layout[path];
    }
    return this.#ask({ type: "layout", places, settled });
  }

  /**
   * How an edit names the target of a transition: states of one template by where they are written.
   * @param {string} from id of the state that has the transition
   * @param {string} to id
   */
  target(from, to) {
    const written = (id) => this.diagram.nodes.find((node) => node.id === id)?.source ?? "";
    const template = (path) => (path.startsWith("@") ? path.split(".")[0] : "");
    const path = written(to);
    return template(path) && template(path) === template(written(from)) ? path : to;
  }

  /** Text is being typed. @param {() => TextChange[]} take the changes since the last call */
  type(take) {
    this.#typed = take;
    this.isSaved = false;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.flush(), TYPING_PAUSE_MS);
  }

  /** Send what was typed now; resolves when the server has it. */
  async flush() {
    clearTimeout(this.#timer);
    const before = this.#sending;
    this.#sending = (async () => {
      await before; // its answer has the revision for which the next changes are made
      const changes = this.#typed?.() ?? [];
      this.#typed = null;
      if (changes.length === 0) return;
      this.#isTypedUnderWay = true;
      await this.#ask({ type: "type", revision: this.revision, changes });
      this.#isTypedUnderWay = false;
    })();
    return this.#sending;
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
      for (const key of ["findings", "layout", "mission", "variables", "templates", "name"]) this[key] = message[key];
      if (language() === "es") for (const finding of this.findings) finding.message = finding.spanish ?? finding.message;
      this.catalogue = message.catalogue ?? this.catalogue;
      // While the text cannot be read, the last diagram stays.
      if (message.diagram.readable) this.diagram = message.diagram;
      this.isReadable = message.diagram.readable;
      this.#setStatus(message);
      // A change that overtakes typed text makes the server refuse that and send the whole text.
      const isOvertaken = this.#isTypedUnderWay && message.answers === undefined;
      this.#listener.changed(isOvertaken ? [] : message.changes ?? [], message.text ?? null, message.answers !== undefined && message.text === undefined);
      if (message.text !== undefined && message.restored) this.#listener.note("restored");
      if (message.text !== undefined && message.problem) this.#listener.refused(message.problem);
    } else {
      this.#setStatus(message);
      if (message.layout && !isSame(message.layout, this.layout)) {
        this.layout = message.layout;
        this.#listener.placed();
      }
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

/** Whether two layouts are the same. @param {Object<string, Point>} one @param {Object<string, Point>} other */
function isSame(one, other) {
  const names = Object.keys(one);
  return names.length === Object.keys(other).length && names.every((name) => one[name].x === other[name]?.x && one[name].y === other[name]?.y);
}
