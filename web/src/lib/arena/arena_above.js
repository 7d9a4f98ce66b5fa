/** The arena from above, for browsers that draw no 3-D: does what `ArenaScene` does, as far as a flat picture can. */
import { make } from "../dom.js";
import { yawOf } from "../yaw.js";
import { TopView } from "./top_view.js";

const STEP_M = 0.03; // between two points of a trail
const MOST_POINTS = 6000;

/** @typedef {import("./arena.js").Pose} Pose @typedef {(pose: Pose) => string} ColourOf */

export class ArenaAbove {
  #view;
  /** @type {Record<string, any>|null} */
  #scenario = null;
  /** @type {Map<number, {place: number[], colour: string}[]>} */
  #trails = new Map();
  /** @type {Map<number, number[][]>} where they truly were */
  #truths = new Map();
  /** @type {Pose[]} */
  #poses = [];
  /** @type {number|null} */
  #selected = null;
  /** @type {import("./map.js").NavigationMap|null} */
  #map = null;
  #isAsked = false;

  /** @param {HTMLElement} box @param {string} words below the picture */
  constructor(box, words) {
    const drawing = make("div", { class: "m-topview", "aria-hidden": "true" });
    box.prepend(drawing);
    box.append(make("p", { class: "m-arena-words" }, words));
    this.#view = new TopView(drawing);
  }

  /** @param {import("./arena.js").World} world */
  setWorld(world) {
    this.#scenario = world?.scenario ?? null;
    this.#view.setWorld(this.#scenario);
    this.setMap(this.#map);
    this.#ask();
  }

  /** @param {import("./map.js").NavigationMap|null} map */
  setMap(map) {
    this.#map = map;
    this.#view.setMap(map, this.#scenario);
  }

  /** @param {Pose[]} poses @param {ColourOf} colourOf */
  setPoses(poses, colourOf) {
    this.#poses = poses;
    for (const pose of poses) this.addTrail(pose.id ?? 1, [pose], colourOf);
    this.#ask();
  }

  /** @param {number} id @param {Pose[]} poses @param {ColourOf} colourOf */
  addTrail(id, poses, colourOf) {
    const trail = this.#trails.get(id) ?? [];
    this.#trails.set(id, trail);
    for (const pose of poses.filter(({ on }) => on)) {
      const [x, y] = pose.p, last = trail.at(-1);
      const colour = colourOf(pose);
      if (!last || Math.hypot(x - last.place[0], y - last.place[1]) > STEP_M) trail.push({ place: [x, y], colour });
    }
    if (trail.length > MOST_POINTS) trail.splice(0, 1000);
    const truth = this.#truths.get(id) ?? [];
    this.#truths.set(id, truth);
    for (const { on, truth: place } of poses) {
      const last = truth.at(-1);
      if (on && place && (!last || Math.hypot(place[0] - last[0], place[1] - last[1]) > STEP_M)) truth.push(place);
    }
    if (truth.length > MOST_POINTS) truth.splice(0, 1000);
    this.#ask();
  }

  /** @param {number} [id] */
  clearTrail(id) {
    for (const lines of [this.#trails, this.#truths]) {
      if (id === undefined) lines.clear();
      else lines.delete(id);
    }
    this.#ask();
  }

  /** @param {number} id */
  select(id) {
    this.#selected = id;
    this.#ask();
  }

  /** There is one view only, and everything is as large as it has to be. */
  setView() {}

  setTrueSize() {}

  dispose() {}

  #ask() {
    if (this.#isAsked) return;
    this.#isAsked = true;
    requestAnimationFrame(() => this.#draw());
  }

  #draw() {
    this.#isAsked = false;
    this.#view.setTracks([...this.#trails.values()].flatMap(inOneColour));
    this.#view.setTruth([...this.#truths.values()]);
    for (const { id = 1, p, q, fresh = true } of this.#poses) {
      const isOther = this.#selected !== null && id !== this.#selected;
      this.#view.setDrone(id, p, yawOf(q), !fresh ? "old" : isOther ? "other" : "");
    }
  }
}

/** A trail in parts, each of one colour, which begins where the one before ends. @param {{place: number[], colour: string}[]} trail */
function inOneColour(trail) {
  /** @type {{places: number[][], colour: string}[]} */
  const parts = [];
  trail.forEach(({ place, colour }, index) => {
    const last = parts.at(-1);
    if (last?.colour === colour) last.places.push(place);
    else parts.push({ places: [...(index > 0 ? [trail[index - 1].place] : []), place], colour });
  });
  return parts;
}
