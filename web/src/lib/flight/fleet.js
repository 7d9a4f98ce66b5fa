/** All that was heard of the drones, and which one is looked at. */

/** @import {Live} from "../messages.js" */

/**
 * @typedef {object} Known
 * @property {number} id
 * @property {Live.DronePose|null} pose
 * @property {Live.DroneStatus|null} status
 * @property {Live.Chart|null} chart
 * @property {import("../arena/map.js").NavigationMap|null} map of its navigator
 * @property {Live.Transition[]} transitions newest first
 * @property {import("../arena/arena.js").DronePose[]} recent poses of the last minute
 */

export class Fleet {
  /** @type {Map<number, Known>} */
  #drones = new Map();
  #tabs;
  #hear;
  /** @type {number|null} */
  #chosen = null;

  /**
   * @param {HTMLElement} tabs where the choice is made; hidden with one drone
   * @param {function(Known): void} onChoice told who is looked at
   */
  constructor(tabs, onChoice) {
    this.#tabs = tabs;
    this.#hear = onChoice;
    tabs.setAttribute("role", "group");
    tabs.setAttribute("aria-label", "drones");
    tabs.hidden = true;
    this.#tabs.addEventListener("click", ({ target }) => {
      const id = /** @type {Element} */ (target).closest("button")?.dataset.drone;
      if (id) this.choose(Number(id));
    });
  }

  /** Who is looked at; null before anybody was heard. @returns {Known|null} */
  get chosen() {
    return this.#drones.get(/** @type {number} */ (this.#chosen)) ?? null;
  }

  get several() {
    return this.#drones.size > 1;
  }

  /** What is known of a drone, known from now on. @param {number} id @returns {Known} */
  of(id) {
    let drone = this.#drones.get(id);
    if (!drone) {
      drone = { id, pose: null, status: null, chart: null, map: null, transitions: [], recent: [] };
      this.#drones.set(id, drone);
      this.#show();
      if (this.#chosen === null) this.choose(id);
    }
    return drone;
  }

  /**
   * Take what drones say of themselves; those that are not among them are gone.
   * @param {Live.DroneStatus[]} list
   */
  setStatus(list) {
    const there = new Set(list.map((status) => status.id));
    for (const status of list) this.of(status.id).status = status;
    const gone = [...this.#drones.keys()].filter((id) => !there.has(id));
    for (const id of gone) this.#drones.delete(id);
    if (gone.length > 0 || list.length > 0) this.#show();
    if (gone.includes(/** @type {number} */ (this.#chosen))) {
      this.#chosen = null;
      const next = list[0]?.id;
      if (next !== undefined) this.choose(next);
    }
  }

  /** @param {number} id */
  choose(id) {
    this.#chosen = id;
    this.#show();
    this.#hear(this.of(id));
  }

  /** The missions' states, by drone. */
  states() {
    return Object.fromEntries([...this.#drones].map(([id, { chart }]) => [id, chart?.states ?? []]));
  }

  get #buttons() {
    return [...this.#tabs.querySelectorAll("button")];
  }

  #show() {
    this.#tabs.hidden = this.#drones.size < 2;
    const ids = [...this.#drones.keys()].sort((a, b) => a - b);
    const old = this.#buttons.map((button) => Number(button.dataset.drone));
    if (ids.join() !== old.join()) {
      this.#tabs.replaceChildren(...ids.map((id) => {
        const button = document.createElement("button");
        button.type = "button";
        button.dataset.drone = String(id);
        return button;
      }));
    }
    for (const button of this.#buttons) {
      const id = Number(button.dataset.drone);
      const { status } = /** @type {Known} */ (this.#drones.get(id));
      const link = status?.link?.state;
      const note = status?.over && link !== "live" ? ", flight over" : link && link !== "live" ? `, link ${link}` : "";
      const words = `${status?.name || `drone ${id}`}${note}`;
      if (button.textContent !== words) button.textContent = words;
      const pressed = String(id === this.#chosen);
      if (button.getAttribute("aria-pressed") !== pressed) button.setAttribute("aria-pressed", pressed);
    }
  }
}
