/** The connection to the document that is edited; the server applies all edits, this page shows what comes back. */
import { language } from "../lib/language.js";
import { ReconnectingSocket } from "../lib/reconnecting_socket.js";
import { word } from "./words.js";

const TYPING_PAUSE_MS = 80; // after which typed text is sent

/**
 * @import {Documents} from "../lib/messages.js"
 * @typedef {Documents.ToPage} ToPage
 * @typedef {Documents.FromPage} FromPage
 * @typedef {FromPage extends infer Each ? Each extends any ? Omit<Each, "number"> : never : never} Unnumbered
 * @typedef {Documents.TypedChange} TextChange offsets in UTF-16 code units
 * @typedef {Documents.Place} Point
 * @typedef {Documents.Edge} Edge
 * @typedef {Documents.Finding} Finding
 * @typedef {Documents.ValueEntry} ValueEntry
 */

export class EditSession {
  /** @type {ReconnectingSocket<FromPage, ToPage>} */
  #socket;
  #listener;
  #number = 0;
  /** What was sent and is not answered yet, in order. @type {Map<number, {message: FromPage, answer: (reply: {refused?: string, code?: string}) => void}>} */
  #waiting = new Map();
  #client = Array.from({ length: 4 }, () => Math.random().toString(36).slice(2, 10)).join("");
  #session = ""; // of the program that has the document
  #isReady = false; // connected, and the document is known
  /** @type {(() => TextChange[])|null} */
  #typed = null;
  #timer = 0;
  #sending = Promise.resolve();
  #isTypedUnderWay = false;

  revision = 0;
  /** @type {Documents.Diagram} */
  diagram = { name: "", initial: "", readable: true, nodes: [], edges: [] };
  /** @type {Object<string, string>} */
  mission = {};
  /** @type {Object<string, string>} */
  variables = {};
  /** @type {string[]} */
  templates = [];
  /** @type {Documents.Catalogue} */
  catalogue = { values: [], primitives: [], operators: [] };
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
   * @param {string} file name of the mission's file
   * @param {{changed: (changes: TextChange[], text: string|null, isOwn: boolean) => void, placed: () => void,
   *   connected: (state: string, reason: string) => void, refused: (reason: string, code: string) => void, status: () => void,
   *   note: (text: string) => void, text: () => string}} listener changed: told after each change of the document; with a
   *   text that is not null, all of it is new; isOwn: this page asked for it. placed: told when states were moved. text: as
   *   it is shown
   */
  constructor(file, listener) {
    this.#listener = listener;
    const address = `/ws/edit?file=${encodeURIComponent(file)}&language=${language()}&client=${this.#client}`;
    this.#socket = new ReconnectingSocket(address, {
      message: (message) => this.#receive(message),
      state: (state, reason) => {
        this.#isReady = false;
        // What is not answered waits for the next connection.
        if (state === "refused") this.#drop(reason);
        listener.connected(state, reason);
      },
    });
  }

  /** @param {string} reason */
  #drop(reason) {
    for (const { answer } of this.#waiting.values()) answer({ refused: reason });
    this.#waiting.clear();
  }

  /**
   * The document was sent, first or after a lost connection. What the program does not have is sent again.
   * @param {Documents.DocumentMessage} message
   * @returns {boolean} whether the text that is shown stays
   */
  #synchronize(message) {
    const isOther = this.#session !== "" && message.session !== this.#session; // the program was started anew
    this.#session = message.session;
    this.#isReady = true;
    const text = this.#listener.text();
    if (isOther) {
      const edits = [...this.#waiting].filter(([, { message: sent }]) => sent.kind !== "type");
      for (const [number, { message: sent, answer }] of this.#waiting) {
        if (sent.kind !== "type") continue;
        this.#waiting.delete(number);
        answer({});
      }
      const isNewer = !this.isSaved && text !== message.text;
      if (isNewer) {
        this.#typed = null; // it is in the text
        this.#ask({ kind: "type", revision: message.revision, changes: [difference(message.text, text)] });
        this.#listener.note("sent_again");
      }
      for (const [, { message: sent }] of edits) this.#socket.send(sent);
      return isNewer;
    }
    for (const [number, { message: sent, answer }] of this.#waiting) {
      if (number <= (message.answered ?? 0)) {
        this.#waiting.delete(number);
        answer({});
      } else this.#socket.send(sent);
    }
    const isTyped = [...this.#waiting.values()].some(({ message: sent }) => sent.kind === "type") || this.#typed !== null;
    return isTyped; // the program has the text without it; the answer has the right one if it cannot be applied
  }

  /**
   * Send an edit of the diagram, after what was typed before it.
   * @param {Documents.EditMessage["edit"]} edit see offboard/authoring/edits.py
   * @returns {Promise<boolean>} whether it was applied; the reason, if not, is told to the listener
   */
  async edit(edit) {
    await this.flush();
    return this.#ask({ kind: "edit", edit });
  }

  async undo() {
    await this.flush();
    return this.#ask({ kind: "undo" });
  }

  async redo() {
    await this.flush();
    return this.#ask({ kind: "redo" });
  }

  async save(force = false) {
    await this.flush();
    return this.#ask({ kind: "save", force });
  }

  /**
   * Keep where states are drawn.
   * @param {Object<string, Point>} places
   * @param {boolean} [settled] the page has found these places: nothing to undo
   */
  async place(places, settled = false) {
    if (Object.keys(places).length === 0) return true;
    Object.assign(this.layout, places); // at once: the next drawing has them
    await this.flush();
    return this.#ask({ kind: "layout", places, settled });
  }

  /**
   * How an edit names the target of a transition: states of one template by where they are written.
   * @param {string} from id of the state that has the transition
   * @param {string} to id
   */
  target(from, to) {
    /** @param {string} id */
    const written = (id) => this.diagram.nodes.find((node) => node.id === id)?.source ?? "";
    /** @param {string} path */
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
    if (!this.#isReady && this.#session !== "") return this.#sending; // it is sent with the next connection
    const before = this.#sending;
    this.#sending = (async () => {
      await before; // its answer has the revision for which the next changes are made
      const changes = this.#typed?.() ?? [];
      this.#typed = null;
      if (changes.length === 0) return;
      this.#isTypedUnderWay = true;
      await this.#ask({ kind: "type", revision: this.revision, changes });
      this.#isTypedUnderWay = false;
    })();
    return this.#sending;
  }

  /** @param {Unnumbered} message @returns {Promise<boolean>} */
  #ask(message) {
    const sent = /** @type {FromPage} */ ({ ...message, number: this.#number + 1 });
    if (!this.#isReady || !this.#socket.send(sent)) {
      this.#listener.refused(word("no_connection"), "");
      return Promise.resolve(false);
    }
    this.#number += 1;
    return new Promise((resolve) => {
      /** @param {{refused?: string, code?: string}} reply */
      const answer = (reply) => {
        if (reply.refused) this.#listener.refused(reply.refused, reply.code ?? "");
        resolve(!reply.refused);
      };
      this.#waiting.set(sent.number, { message: sent, answer });
    });
  }

  /** @param {ToPage} message */
  #receive(message) {
    if (message.warning) this.#listener.refused(message.warning, "");
    if (message.kind === "status") this.#takeStatus(message);
    else this.#takeDocument(message);
    const answers = message.answers ?? 0;
    const asked = this.#waiting.get(answers);
    if (asked) {
      this.#waiting.delete(answers);
      asked.answer(message);
    }
    this.#listener.status();
  }

  /** @param {Documents.DocumentMessage|Documents.ChangedMessage} message */
  #takeDocument(message) {
    const stays = message.kind === "document" && message.answered !== undefined && this.#synchronize(message);
    this.revision = message.revision;
    for (const key of ["findings", "layout", "mission", "variables", "templates", "name"]) {
      /** @type {Record<string, any>} */ (this)[key] = /** @type {Record<string, any>} */ (message)[key];
    }
    if (language() === "es") this.findings.forEach((finding, index) => { finding.message = message.spanish?.[index] ?? finding.message; });
    this.catalogue = message.catalogue ?? this.catalogue;
    // While the text cannot be read, the last diagram stays.
    if (message.diagram.readable) this.diagram = message.diagram;
    this.isReadable = message.diagram.readable;
    this.#setStatus(message);
    // A change that overtakes typed text makes the server refuse that and send the whole text.
    const isOvertaken = this.#isTypedUnderWay && message.answers === undefined;
    const isOwn = message.answers !== undefined && message.text === undefined;
    this.#listener.changed(isOvertaken ? [] : message.changes ?? [], stays ? null : message.text ?? null, isOwn);
    if (message.text !== undefined && message.restored) this.#listener.note("restored");
    if (message.text !== undefined && message.problem) this.#listener.refused(message.problem, "");
    if (stays) this.flush();
  }

  /** @param {Documents.StatusMessage} message */
  #takeStatus(message) {
    this.#setStatus(message);
    const isOutdated = [...this.#waiting.values()].some(({ message: sent }) => sent.kind === "layout" && sent.number > (message.answers ?? Infinity));
    if (message.layout && !isOutdated && !isSame(message.layout, this.layout)) {
      this.layout = message.layout;
      this.#listener.placed();
    }
  }

  /** @param {ToPage} message */
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

/** The one change that makes a text another one. @param {string} from @param {string} to @returns {TextChange} */
function difference(from, to) {
  let start = 0;
  while (start < from.length && start < to.length && from[start] === to[start]) start += 1;
  let same = 0; // characters at the end
  const most = Math.min(from.length, to.length) - start;
  while (same < most && from[from.length - 1 - same] === to[to.length - 1 - same]) same += 1;
  return { start, removed: from.length - start - same, inserted: to.slice(start, to.length - same) };
}
