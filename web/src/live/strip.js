import { stateColour } from "../lib/colours.js";
import { make, number, setAttribute, setText } from "../lib/dom.js";

/**
 * @import {Live} from "../lib/messages.js"
 * @typedef {"mode"|"motors"|"ground"|"battery"|"link"|"mission"|"pilot"} ItemName
 */

const LINKS = { live: "live", stale: "stale", lost: "lost" };
const NO_NAME = "under way"; // the names of its states are still being received

/** What a drone says of itself, in one line: mode, motors, battery, link, mission. */
export class DroneStrip {
  #items = /** @type {Record<ItemName, {item: HTMLElement, value: HTMLElement}>} */ ({});
  #root;

  /** @param {HTMLElement} element an empty box */
  constructor(element) {
    this.#root = make("dl", { class: "m-strip" });
    const titles = { mode: "mode", motors: "motors", ground: "", battery: "battery", link: "link", mission: "mission", pilot: "pilot" };
    for (const [name, title] of Object.entries(titles)) {
      const value = make("dd", { "data-item": name });
      const item = make("div", {}, make("dt", {}, title), value);
      this.#items[/** @type {ItemName} */ (name)] = { item, value };
      this.#root.append(item);
    }
    element.append(this.#root);
    this.set(null);
  }

  /**
   * @param {Live.DroneStatus|null} status of a drone
   * @param {string[]} [order] kinds of states, for the colour of the present one
   */
  set(status, order = []) {
    setAttribute(this.#root, "data-empty", status === null);
    this.#put("mode", status ? status.mode || "–" : "no drone yet; in another terminal: framerunner fly test-case-1");
    const isKnown = status !== null && !(status.over && status.link?.state === "lost"); // else it is what was heard last
    this.#put("motors", isKnown ? (status.armed ? "armed" : "off") : null, status?.armed ? "on" : null);
    this.#put("ground", isKnown ? (status.landed ? "on the ground" : "in the air") : null);
    this.#putBattery(status);
    this.#putLink(status?.link, status?.over);
    this.#putMission(status?.mission, order, status?.over);
    this.#put("pilot", status?.pilot ? `${status.pilot} has the sticks` : null, "warn");
  }

  /** @param {ItemName} name @param {string|null} text null: nothing to say @param {string|null} [look] */
  #put(name, text, look = /** @type {string|null} */ (null)) {
    const { item, value } = this.#items[name];
    item.hidden = text === null;
    setText(value, text ?? "");
    setAttribute(value, "data-look", look);
  }

  /** @param {Live.DroneStatus|null} status */
  #putBattery(status) {
    const { battery_percent: percent = null, voltage_v: volts = null } = status ?? {};
    const parts = [percent === null ? "" : `${number(percent, 0)} %`, volts === null ? "" : `${number(volts)} V`];
    const text = parts.filter(Boolean).join(", ");
    const look = percent === null ? null : percent < 10 ? "bad" : percent < 25 ? "warn" : null;
    const low = { bad: " empty!", warn: " low" }[/** @type {"bad"|"warn"} */ (look)] ?? "";
    this.#put("battery", text ? text + low : null, look);
  }

  /** @param {Live.LinkStatus|undefined} link @param {boolean|undefined} isOver */
  #putLink(link, isOver) {
    if (!link) return this.#put("link", null);
    if (isOver && link.state !== "live") return this.#put("link", "ended with the flight");
    const quality = link.state === "live"
      ? [link.loss_percent === null ? "" : `${number(link.loss_percent, 1)} % lost`, link.rate_hz === null ? "" : `${number(link.rate_hz, 0)}/s`]
      : [`last heard ${number(link.age_s)} s ago`];
    const look = link.state === "live" ? (/** @type {number} */ (link.loss_percent) > 5 ? "warn" : "good")
      : link.state === "stale" ? "warn" : "bad";
    this.#put("link", [LINKS[link.state] ?? link.state, ...quality.filter(Boolean)].join(", "), look);
  }

  /**
   * @param {Live.MissionStatus|null|undefined} mission @param {string[]} order kinds of states
   * @param {boolean|undefined} isOver
   */
  #putMission(mission, order, isOver) {
    const { value } = this.#items.mission;
    if (!mission) {
      value.style.removeProperty("--swatch");
      return this.#put("mission", null);
    }
    const seconds = number(mission.seconds);
    const isBegun = mission.transitions > 0 || mission.flying || mission.finished;
    const state = mission.state || (isBegun ? NO_NAME : "waits to begin");
    if (isOver && !mission.alive) return this.#put("mission", `${mission.name || "mission"}: ended${mission.state ? ` in ${mission.state}` : ""}`);
    const how = mission.alive === false ? "is not heard any more" : mission.finished ? "finished" : mission.paused ? "paused, a pilot has the sticks" : `for ${seconds} s`;
    this.#put("mission", `${mission.name || "mission"}: ${state} ${how}`, mission.alive === false ? "bad" : mission.paused ? "warn" : "state");
    if (mission.state) value.style.setProperty("--swatch", stateColour(mission.state, order));
  }
}
