import { make, number } from "../lib/dom.js";

/** @import {Live} from "../lib/messages.js" */

const MOST = 60;
const SEVERITIES = ["emergency", "alert", "critical", "error", "warning", "notice", "info", "debug"];

/** What drones, missions and the monitor say, newest first. */
export class Messages {
  #list;
  #severalDrones = false;

  /** @param {HTMLElement} element an empty box */
  constructor(element) {
    this.#list = make("ol", { class: "m-messages", tabindex: "0", "aria-label": "messages, newest first" });
    element.append(this.#list);
    this.#list.append(make("li", { class: "m-none" }, "none yet"));
  }

  /** Forget all: after a loss the last ones come again. */
  clear() {
    this.#list.replaceChildren(make("li", { class: "m-none" }, "none yet"));
  }

  /** Whether to say which drone said it. @param {boolean} several */
  setSeveral(several) {
    this.#severalDrones = several;
  }

  /** @param {Live.Text} message */
  addText({ id, time_s, severity, text, from }) {
    const look = severity <= 3 ? "bad" : severity === 4 ? "warn" : "plain";
    const who = this.#severalDrones ? `${id}` : "";
    this.#add(look, SEVERITIES[severity] ?? `severity ${severity}`, text, time_s, from === "mission" ? `${who} mission`.trim() : who);
  }

  /** @param {Live.Notice} message */
  addNotice({ id, level, text }) {
    const look = /** @type {Record<string, string>} */ ({ error: "bad", warning: "warn" })[level] ?? "plain";
    this.#add(look, level, text, null, id === null || id === undefined || !this.#severalDrones ? "monitor" : `monitor, ${id}`);
  }

  /**
   * @param {string} look @param {string} severity @param {string} text
   * @param {number|null} time_s @param {string} who "" for nobody
   */
  #add(look, severity, text, time_s, who) {
    this.#list.querySelector(".m-none")?.remove();
    const time = typeof time_s === "number" ? make("span", { class: "m-when" }, `${number(time_s)} s`) : null;
    const kind = make("span", { class: "m-severity", "data-look": look }, severity);
    const by = who ? make("span", { class: "m-who" }, who) : null;
    this.#list.prepend(make("li", { "data-look": look }, time, kind, by, make("span", { class: "m-text" }, String(text))));
    while (this.#list.children.length > MOST) this.#list.lastElementChild?.remove();
  }
}
