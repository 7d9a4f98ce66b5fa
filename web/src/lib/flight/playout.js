/**
 * Shows poses, images and detections of one moment. They arrive one after the other (an image, then where the drone
 * was, then what the app found in the image), so all are shown a little later, at one vehicle time.
 */
import { onBeat } from "../beat.js";

/**
 * @typedef {import("../messages.js").Live.Detections} Detections
 * @typedef {import("../arena/arena.js").DronePose} DronePose
 * @typedef {import("./video.js").VideoImage} VideoImage
 * @typedef {VideoImage & {t: number, isShown?: boolean, hasBoxes?: boolean}} TimedImage
 */

/**
 * @typedef {object} Track a drone's poses that wait for their moment
 * @property {DronePose[]} poses
 * @property {number|null} shown the vehicle time that is shown, seconds
 * @property {number} newest that of the newest pose
 * @property {number} heardAt when that came, ms
 * @property {boolean} [isTaken] the first pose was passed
 */

/**
 * @typedef {object} Moment
 * @property {DronePose[]} poses all drones' now
 * @property {DronePose[]} passed as they were heard since the last call
 * @property {DronePose|null} chosen that drone's pose now
 * @property {(VideoImage & {detections: Detections|null})|null} image if there is another than
 *   before; its detections null if none are known
 */

const MIN_DELAY_S = 0.1; // without images: evens out how poses arrive
const MAX_DELAY_S = 1;
const MARGIN_S = 0.05; // beyond the longest delay seen lately
const LAG_FADES = 0.9; // with each image
const CATCH_UP = 4; // share of the way to the wanted time that is made up in a second, beside the time that passes
const JUMP_S = 1.5; // farther behind than this, it jumps
const RESTART_S = 0.5; // a vehicle's time that goes back by more has begun anew
const QUIET_MS = 400; // after this no newer pose is waited for
const KEPT_S = 3; // images and detections wait for their moment at most this long
const MAX_IMAGES = 60;
const SAME_S = 0.0006; // detections tell milliseconds, images microseconds
const OTHER_CLOCK_S = 5; // an image whose time is this far off has another clock

export class Playout {
  /** @type {Map<number, Track>} */
  #tracks = new Map(); // by drone
  /** @type {TimedImage[]} */
  #images = [];
  /** @type {Detections[]} */
  #detections = [];
  #detectedAt = -Infinity;
  /** @type {VideoImage|null} */
  #loose = null; // an image that tells no time, or one of another clock
  /** @type {number|null} */
  #chosen = null;
  #lag_s = 0;
  #last = 0;
  #show;

  /**
   * @param {(moment: Moment) => void} show
   */
  constructor(show) {
    this.#show = show;
  }

  /** Whose images and detections these are from now on. @param {number|null} id */
  choose(id) {
    this.#chosen = id;
    this.#images = [];
    this.#detections = [];
    this.#loose = null;
    this.#lag_s = 0;
  }

  /** Go on from a drone's next pose: those until now are known. @param {number} id */
  restart(id) {
    const track = this.#tracks.get(id);
    if (track) Object.assign(track, { poses: track.poses.slice(-1), shown: track.newest, isTaken: true });
  }

  /** @param {DronePose[]} drones of the message "pose" */
  addPoses(drones) {
    const there = new Set(drones.map((pose) => pose.id));
    for (const id of this.#tracks.keys()) if (!there.has(id)) this.#forget(id);
    for (const pose of drones) this.#addPose(pose);
    this.#ask();
  }

  /** @param {VideoImage} image of the chosen drone */
  addImage(image) {
    const track = this.#tracks.get(/** @type {number} */ (this.#chosen));
    if (image.t === null || !track || Math.abs(image.t - track.newest) > OTHER_CLOCK_S) {
      this.#loose = image;
    } else {
      this.#note(track.newest - image.t);
      if (this.#images.length > 0 && image.t <= /** @type {TimedImage} */ (this.#images.at(-1)).t) {
        this.#images = [];
      }
      this.#images.push(/** @type {TimedImage} */ (image));
      if (this.#images.length > MAX_IMAGES) this.#images.shift();
    }
    this.#ask();
  }

  /** @param {Detections} message of the chosen drone */
  addDetections(message) {
    const track = this.#tracks.get(/** @type {number} */ (this.#chosen));
    if (track && message.t !== null) this.#note(track.newest - message.t);
    /** @param {Detections} each */
    const isNear = (each) => message.t !== null && each.t !== null && Math.abs(each.t - message.t) < KEPT_S;
    this.#detections = [...this.#detections.filter(isNear), message];
    this.#detectedAt = performance.now();
    this.#ask();
  }

  /** @param {DronePose} pose */
  #addPose(pose) {
    const now = performance.now();
    let track = this.#tracks.get(pose.id);
    if (track && pose.t < track.newest - RESTART_S) {
      this.#forget(pose.id);
      track = undefined;
    }
    if (!track) { // an image that came before the first pose stays
      track = { poses: [], shown: null, newest: -Infinity, heardAt: now };
      this.#tracks.set(pose.id, track);
    }
    if (pose.t > track.newest) {
      track.poses.push(pose);
      track.newest = pose.t;
      track.heardAt = now;
    } else {
      track.poses.splice(-1, 1, { ...pose, t: track.newest }); // whether it is fresh is news, too
    }
  }

  /** @param {number} id */
  #forget(id) {
    this.#tracks.delete(id);
    if (id === this.#chosen) this.choose(id);
  }

  /** @param {number} lag_s */
  #note(lag_s) {
    if (lag_s < MAX_DELAY_S) this.#lag_s = Math.max(LAG_FADES * this.#lag_s, lag_s);
  }

  #ask() {
    onBeat(this, (now) => this.#tick(now));
  }

  /** @param {number} now ms */
  #tick(now) {
    const passed_s = Math.min(0.5, (now - this.#last) / 1000);
    this.#last = now;
    /** @type {DronePose[][]} */
    const [poses, passed] = [[], []];
    let moves = false;
    for (const track of this.#tracks.values()) {
      moves = this.#advance(track, now, passed_s) || moves;
      const count = track.poses.findIndex((pose) => pose.t > /** @type {number} */ (track.shown));
      const until = count < 0 ? track.poses.length : count;
      const fresh = /** @type {DronePose} */ (track.poses.at(-1)).fresh;
      for (const pose of track.poses.slice(track.isTaken ? 1 : 0, until)) passed.push(pose);
      poses.push({
        ...between(
          track.poses[Math.max(0, until - 1)], track.poses[until], /** @type {number} */ (track.shown)),
        fresh,
      });
      if (until > 0) {
        track.poses.splice(0, until - 1); // the last one passed is where the next stretch begins
        track.isTaken = true;
      }
    }
    const chosen = poses.find((pose) => pose.id === this.#chosen) ?? null;
    this.#show({ poses, passed, chosen, image: this.#imageAt(chosen?.t ?? null) });
    if (moves) this.#ask();
  }

  /**
   * Let a drone's shown time go on; returns whether there is more to come without news.
   * @param {Track} track
   * @param {number} now ms
   * @param {number} passed_s since the last call
   */
  #advance(track, now, passed_s) {
    const silent_s = (now - track.heardAt) / 1000;
    const isQuiet = now - track.heardAt > QUIET_MS;
    const delay_s = isQuiet ? 0 : Math.min(MAX_DELAY_S, Math.max(MIN_DELAY_S, this.#lag_s + MARGIN_S));
    const wanted = track.newest - delay_s + (isQuiet ? 0 : Math.min(0.1, silent_s));
    const isFar = track.shown === null || Math.abs(wanted - track.shown) > JUMP_S;
    const share = Math.min(1, CATCH_UP * passed_s); // with few beats a second, all of it
    const aim = isFar ? wanted
      : /** @type {number} */ (track.shown)
        + Math.max(0, passed_s + share * (wanted - /** @type {number} */ (track.shown) - passed_s));
    track.shown = Math.min(track.newest, Math.max(track.poses[0].t, aim));
    return track.shown < track.newest;
  }

  /**
   * The newest image of a moment, with what was detected in it; null: none, or the one that is shown.
   * @param {number|null} time
   */
  #imageAt(time) {
    const loose = this.#loose;
    if (loose) {
      this.#loose = null;
      const isLate = performance.now() - this.#detectedAt > 1000 * MAX_DELAY_S;
      return { ...loose, detections: this.#of(loose) ?? (isLate ? null : this.#detections.at(-1) ?? null) };
    }
    if (time === null) return null;
    const until = this.#images.filter((image) => image.t <= time + SAME_S);
    if (until.length === 0) return null;
    const newest = /** @type {TimedImage} */ (until.at(-1));
    // Where the app looks at some of the images only, those are shown; the others would have no boxes.
    const image = until.findLast((each) => this.#of(each)) ?? newest;
    if (image !== newest && newest.t - image.t < MAX_DELAY_S) return this.#take(image);
    return this.#take(newest);
  }

  /** @param {TimedImage} image */
  #take(image) {
    const detections = this.#of(image);
    if (image.isShown && (image.hasBoxes || !detections)) return null;
    image.isShown = true;
    image.hasBoxes = Boolean(detections);
    this.#images = this.#images.filter((each) => each.t >= image.t);
    return { ...image, detections };
  }

  /** What was detected in an image. @param {VideoImage} image */
  #of(image) {
    return this.#detections.find(
      (each) => each.t !== null && Math.abs(each.t - /** @type {number} */ (image.t)) < SAME_S) ?? null;
  }
}

/**
 * Where a drone is between two poses.
 * @param {DronePose} before
 * @param {DronePose|undefined} after
 * @param {number} t seconds
 */
function between(before, after, t) {
  if (!after || t <= before.t) return before;
  const share = (t - before.t) / (after.t - before.t);
  const dot = before.q.reduce((sum, value, axis) => sum + value * after.q[axis], 0);
  /** @param {number[]} from @param {number[]} to @param {number} sign */
  const mix = (from, to, sign) => from.map((value, axis) => value + share * (sign * to[axis] - value));
  const q = mix(before.q, after.q, dot < 0 ? -1 : 1);
  const norm = Math.hypot(...q) || 1;
  return { ...before, t, p: mix(before.p, after.p, 1), q: q.map((value) => value / norm) };
}
