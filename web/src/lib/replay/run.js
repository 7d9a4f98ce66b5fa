/** A recorded flight: fetched whole, asked for any of its times. Nothing here touches the page. */
import { request } from "../request.js";

/**
 * @import {Live} from "../messages.js"
 * @typedef {import("../arena/arena.js").Pose} Pose
 * @typedef {import("../flight/camera.js").Seen & {t: number}} SeenAt
 * @typedef {import("../arena/map.js").NavigationMap & {t: number}} MapAt
 * @typedef {{t: number, colour: string}} Crossing
 */

/**
 * @typedef {object} Result what is used of result.json; what has its default may be missing
 * @property {string} verdict
 * @property {string} reason
 * @property {number} [try_time_s]
 * @property {number} [penalty_s]
 * @property {number} [total_time_s]
 * @property {number} [contacts]
 * @property {string[]} [contact_frames]
 * @property {number[]} [contact_times_s]
 * @property {string[]} [frames_crossed]
 * @property {number[]} [crossing_times_s]
 */

/**
 * @typedef {object} Recording a run as in docs/monitor-channels.md, section 6; seconds since motors on
 * @property {string} name
 * @property {import("../arena/arena.js").World} world
 * @property {import("../chart/statechart.js").Chart|null} chart
 * @property {string[]} [states] that poses tell
 * @property {Pose[]} poses
 * @property {SeenAt[]} detections
 * @property {MapAt[]} maps
 * @property {Live.Transition[]} transitions oldest first
 * @property {number[]} images their times
 * @property {Crossing[]} crossings
 * @property {Result|null} result null: not judged
 */

const OLD_IMAGE_S = 1; // boxes of an image older than this are not drawn
const TRANSITIONS = 10;

/** The address of a run. @param {string} name */
export function addressOf(name) {
  return `/api/runs/${encodeURIComponent(name)}`;
}

/** How many of a sorted list's times are not after t. @param {number[]} times @param {number} t */
function countUntil(times, t) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle + 1;
    else high = middle;
  }
  return low;
}

/**
 * The attitude between two, which are near each other, after a share of the shortest way.
 * @param {number[]} from @param {number[]} to @param {number} share
 */
function turned(from, to, share) {
  const sign = from.reduce((sum, value, axis) => sum + value * to[axis], 0) < 0 ? -1 : 1;
  const q = from.map((value, axis) => value + share * (sign * to[axis] - value));
  const norm = Math.hypot(...q) || 1;
  return q.map((value) => value / norm);
}

export class Run {
  /** @param {Recording} recording */
  constructor(recording) {
    this.name = recording.name;
    this.world = recording.world;
    this.chart = recording.chart;
    this.states = recording.states ?? recording.chart?.states ?? [];
    this.poses = recording.poses;
    this.images = recording.images;
    this.crossings = recording.crossings;
    this.transitions = recording.transitions;
    this.detections = recording.detections;
    this.maps = recording.maps;
    this.result = recording.result;
    this.begin = this.poses[0]?.t ?? 0;
    this.end = this.poses.at(-1)?.t ?? 0;
    this.poseTimes = this.poses.map((pose) => pose.t);
    this.detectionTimes = this.detections.map((each) => each.t);
    this.mapTimes = this.maps.map((each) => each.t);
    this.transitionTimes = this.transitions.map((each) => each.time_s);
    this.outside = this.#outsideSeconds();
  }

  /** Fetch a run. @param {string} name */
  static async fetch(name) {
    return new Run(await request(addressOf(name)));
  }

  /** How many poses there are up to a time. @param {number} t */
  posesUntil(t) {
    return countUntil(this.poseTimes, t);
  }

  /**
   * Where the drone is at a time, between the poses around it; null if nothing is known.
   * @param {number} t
   * @returns {Pose|null}
   */
  poseAt(t) {
    const count = this.posesUntil(t);
    const before = this.poses[Math.max(0, count - 1)];
    const after = this.poses[count];
    if (!before) return null;
    if (!after || count === 0) return { ...before, t };
    const share = (t - before.t) / Math.max(1e-6, after.t - before.t);
    const p = before.p.map((value, axis) => value + share * (after.p[axis] - value));
    const q = turned(before.q, after.q, share);
    return { ...before, t, p, q };
  }

  /**
   * The id of the mission's state at a time, and since when.
   * @param {number} t
   * @returns {[string|null, number]} id and seconds in it
   */
  stateAt(t) {
    const pose = this.poses[Math.max(0, this.posesUntil(t) - 1)];
    const id = this.states[pose?.s] ?? null;
    const count = countUntil(this.transitionTimes, t);
    const since = count > 0 ? this.transitionTimes[count - 1] : this.begin;
    return [id, Math.max(0, t - since)];
  }

  /**
   * The last transitions at a time, newest first, and how many there were.
   * @param {number} t
   * @returns {[Live.Transition[], number]}
   */
  transitionsAt(t) {
    const count = countUntil(this.transitionTimes, t);
    return [this.transitions.slice(Math.max(0, count - TRANSITIONS), count).reverse(), count];
  }

  /** The number of the image at a time; null before the first. @param {number} t */
  imageAt(t) {
    const count = countUntil(this.images, t);
    return count > 0 ? count - 1 : null;
  }

  /** What was detected last at a time; null if that is too old. @param {number} t */
  detectionsAt(t) {
    const count = countUntil(this.detectionTimes, t);
    const last = this.detections[count - 1];
    if (!last) return null;
    // An image without a change of what is seen has no entry of its own: it is the images that grow old.
    const image = this.imageAt(t);
    const seen = image === null ? last.t : Math.max(last.t, this.images[image]);
    return t - seen <= OLD_IMAGE_S ? last : null;
  }

  /** What the navigator's map was at a time; null if there was none. @param {number} t */
  mapAt(t) {
    return this.maps[countUntil(this.mapTimes, t) - 1] ?? null;
  }

  /**
   * The Game Monitor's figures at a time; null if nobody judged.
   * @param {number} t
   * @returns {Live.Figures|null}
   */
  figuresAt(t) {
    const { result } = this;
    if (!result) return null;
    const end = result.try_time_s ?? this.end;
    const isOver = t >= end;
    const crossed = this.crossings.filter((each) => each.t <= t);
    const order = ["red", "green", "blue"].filter((colour) => this.#hasFrame(colour));
    const limit = this.world.scenario?.try_limit_s ?? null;
    const time = Math.min(Math.max(0, t), end);
    const pose = this.poses[Math.max(0, this.posesUntil(t) - 1)];
    const outside = Math.min(this.outside[Math.max(0, this.posesUntil(t) - 1)] ?? 0, result.penalty_s ?? 0);
    const penalty = isOver ? result.penalty_s ?? null : outside;
    return {
      try_time_s: time,
      penalty_s: penalty,
      total_time_s: isOver ? result.total_time_s ?? null : time + outside,
      limit_s: limit,
      time_over: limit !== null && time > limit,
      crossed: crossed.map((each) => each.colour),
      crossing_times_s: crossed.map((each) => this.#timeOf(each)),
      next_colour: order.find((colour) => !crossed.some((each) => each.colour === colour)) ?? null,
      contacts: isOver ? result.contacts ?? null : null,
      inside: pose ? this.#isInside(pose) : true,
      motors_on: Boolean(pose?.on) && !isOver,
      over: isOver,
      verdict: isOver ? result.verdict ?? "" : "",
      reason: isOver ? result.reason ?? "" : "",
      source: this.world.source,
      final: isOver,
    };
  }

  /** The exact time of a crossing, as the result has it. @param {Crossing} crossing */
  #timeOf(crossing) {
    const index = this.result?.frames_crossed?.indexOf(crossing.colour) ?? -1;
    return this.result?.crossing_times_s?.[index] ?? crossing.t;
  }

  /** @param {string} colour */
  #hasFrame(colour) {
    return (this.world.scenario?.frames ?? []).some(
      (/** @type {{colour: string}} */ gate) => gate.colour === colour);
  }

  /** @param {Pose} pose */
  #isInside({ p: [x, y, z] }) {
    const arena = this.world.scenario?.arena;
    if (!arena) return true;
    const top = arena.height_m + (this.world.lift_m ?? 0);
    return Math.abs(x) <= arena.length_x_m / 2 && Math.abs(y) <= arena.width_y_m / 2 && z <= top;
  }

  /** Seconds outside the arena with motors on, up to each pose. */
  #outsideSeconds() {
    let sum = 0;
    return this.poses.map((pose, index) => {
      const before = this.poses[index - 1];
      if (before && before.on && !this.#isInside(before)) sum += pose.t - before.t;
      return sum;
    });
  }
}
