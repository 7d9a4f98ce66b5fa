import { kindOf, stateColour } from "../colours.js";
import { isTyping, make, setAttribute, setText } from "../dom.js";
import { ArenaAbove } from "./arena_above.js";
import { reasonOf } from "../request.js";

/**
 * @typedef {object} Pose one drone, as in the live channel's message "pose"
 * @property {number} [id] 1 if there is none
 * @property {number} t seconds
 * @property {number[]} p x, y, z, metres, arena axes
 * @property {number[]|null} [truth] where a simulated drone truly is; null: not known
 * @property {number[]} q w, x, y, z, body forward-left-up to arena
 * @property {number[]|null} [v] forward, left, up, m/s
 * @property {number|null} [r] rad/s to the left
 * @property {(number|null)[]|null} [c] the four commanded, as v and r; null: none
 * @property {boolean} on motors
 * @property {number} s index into the states of its mission; -1 if none
 * @property {boolean} [fresh] true if there is none
 */

/**
 * @typedef {"orbit"|"follow"|"onboard"} View
 * @typedef {Pose & {id: number}} DronePose
 * @typedef {{scenario: Record<string, any>|null, lift_m: number, source: string}} World the message "world"
 * @typedef {string[]|Record<number, string[]>} States ids of the mission's, the same for all or by drone
 * @typedef {import("./scene.js").ArenaScene|import("./arena_above.js").ArenaAbove} Painter
 */

const VIEWS = { orbit: "Orbit", follow: "Follow", onboard: "Onboard" };
const NO_STATE = "#5c6773";
const BACK_S = 0.5; // a vehicle's time that goes back by more has begun anew

/** The arena in three dimensions, or from above where a browser cannot draw those. */
export class Arena {
  #box;
  #labels;
  #legend;
  /** @type {Set<string>} */
  #kinds = new Set();
  /** @type {Record<string, HTMLButtonElement>} by view */
  #buttons = {};
  /** @type {HTMLButtonElement|undefined} made by the constructor, as the next ones */
  #sizeButton;
  /** @type {HTMLButtonElement|undefined} */
  #mapButton;
  /** @type {HTMLElement|undefined} */
  #goal;
  /** @type {import("./map.js").NavigationMap|null} */
  #map = null;
  /** @type {Painter|null} */
  #painter = null; // once it is there
  /** @type {((painter: Painter) => void)[]} */
  #waiting = [];
  /** @type {Map<number, Pose>} */
  #last = new Map(); // newest pose by drone
  /** @type {Map<number, {list: string[], order: string[]}>} */
  #orders = new Map();

  /** @param {HTMLElement} element an empty box with a size; its size is followed */
  constructor(element) {
    this.#box = make("div", { class: "m-arena", tabindex: "0", role: "group", "data-view": "orbit", "aria-label": "the arena" });
    this.#labels = make("div", { class: "m-arena-labels", "aria-hidden": "true" });
    this.#legend = make("ul", { class: "m-arena-legend", "aria-label": "colours of the trail" });
    this.#box.append(this.#labels, this.#makeBar(), this.#legend);
    element.append(this.#box);
    /** Resolves once it can draw. */
    this.ready = this.#open();
  }

  /** @param {World} world */
  setWorld(world) {
    this.#do((painter) => painter.setWorld(world));
  }

  /**
   * Where the drones are now; moves on smoothly from where they were, and draws on at their trails.
   * A trail begins anew when the motors come on, and when time goes back.
   * @param {Pose[]} poses
   * @param {States} states
   */
  setPoses(poses, states) {
    this.#do((painter) => {
      for (const pose of poses) this.#watchForNew(pose);
      this.#last = new Map(poses.map((pose) => [pose.id ?? 1, pose]));
      painter.setPoses(poses, (pose) => this.#colour(pose, states));
    });
  }

  /**
   * Where the drones are at one moment: drawn exactly there, at once.
   * @param {Pose[]} poses
   * @param {Pose[]} passed through which they came since the last call; the trail goes through all of them
   * @param {States} states
   */
  showMoment(poses, passed, states) {
    this.#do((painter) => {
      /** @param {Pose} pose */
      const colourOf = (pose) => this.#colour(pose, states);
      for (const pose of passed) {
        this.#watchForNew(pose);
        this.#last.set(pose.id ?? 1, pose);
        painter.addTrail(pose.id ?? 1, [pose], colourOf);
      }
      painter.setPoses(poses, colourOf, true);
      setAttribute(this.#box, "data-time", poses[0]?.t ?? null);
    });
  }

  /**
   * Show what a navigator knows and plans, until the next call.
   * @param {import("./map.js").NavigationMap|null} map as in the message "map"; null: there is none
   */
  setMap(map) {
    if (map === this.#map) return;
    this.#map = map;
    /** @type {HTMLButtonElement} */ (this.#mapButton).hidden = !map;
    this.#showMap();
  }

  /** @param {View} view */
  setView(view) {
    setAttribute(this.#box, "data-view", view);
    for (const [name, button] of Object.entries(this.#buttons)) setAttribute(button, "aria-pressed", String(name === view));
    this.#do((painter) => painter.setView(view));
  }

  /** Whom "follow" and "onboard" follow. @param {number} id */
  select(id) {
    this.#do((painter) => painter.select(id));
  }

  /** Forget the trails. @param {number} [id] only this drone's */
  clearTrail(id) {
    this.#do((painter) => {
      this.#kinds.clear();
      this.#legend.replaceChildren();
      painter.clearTrail(id);
    });
  }

  /**
   * Draw a whole trail at once, for a replay that jumps; the next `setPoses` goes on from its end.
   * @param {Pose[]} poses
   * @param {States} states
   * @param {number} [id]
   */
  setTrail(poses, states, id = 1) {
    this.clearTrail(id);
    this.#do((painter) => {
      painter.addTrail(id, poses, (pose) => this.#colour({ ...pose, id }, states));
      if (poses.length > 0) this.#last.set(id, /** @type {Pose} */ (poses.at(-1)));
    });
  }

  /** Let go of the graphics card. */
  dispose() {
    this.#painter?.dispose();
    this.#painter = null;
    this.#waiting = [];
    this.#box.remove();
  }

  /** Draw the map unless it is switched off. */
  #showMap() {
    const shown = /** @type {HTMLButtonElement} */ (this.#mapButton).getAttribute("aria-pressed") === "true"
      ? this.#map : null;
    setText(/** @type {HTMLElement} */ (this.#goal), shown ? `navigator: ${shown.goal}` : "");
    /** @type {HTMLElement} */ (this.#goal).hidden = !shown?.goal;
    setAttribute(this.#box, "data-mapped", shown ? shown.frames.map((each) => each.colour).join(" ") : null);
    this.#do((painter) => painter.setMap(shown));
  }

  /** A trail begins anew with a flight. @param {Pose} pose */
  #watchForNew(pose) {
    const before = this.#last.get(pose.id ?? 1);
    if (before && (pose.t < before.t - BACK_S || (pose.on && !before.on))) this.clearTrail(pose.id ?? 1);
  }

  /** Done at once, or when the graphics are there. @param {(painter: Painter) => void} what */
  #do(what) {
    if (this.#painter) what(this.#painter);
    else this.#waiting.push(what);
  }

  async #open() {
    try {
      // The library is large; the rest of the page does not wait for it.
      const { ArenaScene } = await import("./scene.js");
      this.#painter = new ArenaScene(this.#box, this.#labels);
    } catch (error) {
      console.info(`no 3-D here (${reasonOf(error)}); the arena is drawn from above`);
      this.#painter = new ArenaAbove(this.#box, "This browser draws no 3-D here, so the arena is shown from above.");
      for (const button of [
        ...Object.values(this.#buttons), /** @type {HTMLButtonElement} */ (this.#sizeButton),
      ]) button.hidden = true;
    }
    for (const what of this.#waiting.splice(0)) what(this.#painter);
  }

  #makeBar() {
    const bar = make("div", { class: "m-views small-buttons", role: "toolbar", "aria-label": "views" });
    // What turns the arena would capture the pointer, and the click would never reach the button.
    bar.addEventListener("pointerdown", (event) => event.stopPropagation());
    /** @type {[View, string][]} */ (Object.entries(VIEWS)).forEach(([view, words], index) => {
      const key = String(index + 1);
      const pressed = String(view === "orbit");
      const attributes = { type: "button", "aria-pressed": pressed, "data-view": view, "aria-keyshortcuts": key };
      const button = make("button", attributes, make("kbd", { "aria-hidden": "true" }, key), words);
      button.addEventListener("click", () => this.setView(view));
      this.#buttons[view] = button;
      bar.append(button);
    });
    const mapTitle = "show the frames as the navigator estimates them, and its path";
    this.#mapButton = make("button", { type: "button", class: "m-map-button", "aria-pressed": "true", title: mapTitle, hidden: true }, "Map");
    this.#mapButton.addEventListener("click", () => {
      setAttribute(
        /** @type {HTMLButtonElement} */ (this.#mapButton), "aria-pressed",
        String(/** @type {HTMLButtonElement} */ (this.#mapButton).getAttribute("aria-pressed") !== "true"));
      this.#showMap();
    });
    const title = "show the drone no larger than it is";
    this.#sizeButton = make("button", { type: "button", "aria-pressed": "false", title }, "True size");
    this.#sizeButton.addEventListener("click", () => {
      const isTrue =
        /** @type {HTMLButtonElement} */ (this.#sizeButton).getAttribute("aria-pressed") !== "true";
      setAttribute(/** @type {HTMLButtonElement} */ (this.#sizeButton), "aria-pressed", String(isTrue));
      this.#do((painter) => painter.setTrueSize(isTrue));
    });
    this.#goal = make("p", { class: "m-arena-goal", hidden: true });
    bar.append(this.#mapButton, this.#sizeButton, this.#goal);
    document.addEventListener("keydown", (event) => {
      const view = /** @type {View[]} */ (Object.keys(VIEWS))[Number(event.key) - 1];
      if (view && !event.ctrlKey && !event.metaKey && !event.altKey && !isTyping(event)) this.setView(view);
    });
    return bar;
  }

  /**
   * The colour of a drone's state; with motors on it goes to the trail, so the legend says what it means.
   * @param {Pose} pose
   * @param {States} states
   */
  #colour(pose, states) {
    const id = pose.id ?? 1;
    const list = Array.isArray(states) ? states : states?.[id];
    const state = list?.[pose.s];
    if (state === undefined) return NO_STATE;
    // Kinds are numbered as they first stand in the mission, so that all who watch see the same colours.
    if (this.#orders.get(id)?.list !== list) {
      /** @type {string[]} */
      const order = [];
      for (const each of list) stateColour(each, order);
      this.#orders.set(id, { list, order });
    }
    const colour = stateColour(state, /** @type {{order: string[]}} */ (this.#orders.get(id)).order);
    const kind = kindOf(state);
    if (pose.on && !this.#kinds.has(kind)) {
      this.#kinds.add(kind);
      const swatch = make("span", { class: "m-swatch" });
      swatch.style.background = colour;
      this.#legend.append(make("li", {}, swatch, kind));
    }
    return colour;
  }
}
