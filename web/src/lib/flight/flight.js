/** A flight as it happens, in an arena and a camera view: both of one moment, for one of the drones. */
import { posesOf } from "./history.js";
import { Playout } from "./playout.js";
import { FrameStream } from "./video.js";

/**
 * @import {Live} from "../messages.js"
 * @typedef {import("../arena/arena.js").DronePose} DronePose
 */

const LATE_IMAGE_MS = 2000;
const LOOK_MS = 500;

export class Flight {
  #arena;
  #camera;
  #playout;
  #stream;
  #hear;
  /** @type {number|null} */
  #chosen = null;
  /** @type {Live.DroneStatus|null} */
  #status = null;
  #image = false; // there is one to be seen
  #imageAt = 0;

  /**
   * @param {import("../arena/arena.js").Arena} arena
   * @param {import("./camera.js").CameraView} camera
   * @param {{states: () => Record<number, string[]>, passed: (pose: DronePose) => void}} hear
   *   states: of the missions, by drone; passed: told each drone's poses once their moment has come
   */
  constructor(arena, camera, hear) {
    this.#arena = arena;
    this.#camera = camera;
    this.#hear = hear;
    this.#playout = new Playout((moment) => this.#show(moment));
    this.#stream = new FrameStream((image) => this.#playout.addImage(image));
    setInterval(() => this.#note(), LOOK_MS);
  }

  /** Show another drone's camera. @param {number|null} id */
  choose(id) {
    if (id === this.#chosen) return;
    this.#chosen = id;
    this.#playout.choose(id);
    this.#forgetImage();
  }

  /** @param {Live.DroneStatus|null} status of the chosen drone */
  setStatus(status) {
    this.#status = status;
    this.#stream.watch(status?.video ? `/video/${status.id}/frames` : null);
    if (!this.#image || !status?.video) this.#forgetImage();
    this.#note();
  }

  /** @param {Live.DronePose[]} drones of the message "pose" */
  addPoses(drones) {
    this.#playout.addPoses(drones);
  }

  /** @param {Live.Detections} message of the chosen drone */
  addDetections(message) {
    this.#playout.addDetections(message);
  }

  /**
   * Draw a flight's trail so far.
   * @param {Live.FlightHistory} message
   * @returns {DronePose[]} its poses
   */
  setHistory({ id, poses: rows }) {
    const poses = posesOf(id, rows);
    this.#playout.restart(id);
    this.#arena.setTrail(poses, this.#hear.states(), id);
    return [...poses]; // the arena may draw its own later
  }

  /** @param {import("./playout.js").Moment} moment */
  #show({ poses, passed, image }) {
    for (const pose of passed) this.#hear.passed(pose);
    // A drone whose flight is over stands where it ended; it is not drawn as one that is missed.
    /** @param {DronePose} pose */
    const isOver = (pose) => pose.id === this.#chosen && this.#status?.over;
    this.#arena.showMoment(poses.map((pose) => (isOver(pose) ? { ...pose, fresh: true } : pose)), passed, this.#hear.states());
    if (!image) return;
    this.#image = true;
    this.#imageAt = performance.now();
    this.#camera.showFrame(image);
    this.#note();
  }

  #forgetImage() {
    this.#image = false;
    const status = this.#status;
    this.#camera.clearFrame(!status ? "no drone yet: start one with framerunner sim" : status.video ? "waiting for the first image" : "no video");
  }

  /** Say so when the image is not of now. */
  #note() {
    const isLate = this.#image && performance.now() - this.#imageAt > LATE_IMAGE_MS;
    const isOver = Boolean(this.#status?.over);
    this.#camera.setNote(!isLate ? "" : isOver ? "last image of the flight" : "no new image comes");
  }
}

/** Whether a drone is being flown. @param {Live.DroneStatus|null|undefined} status */
export function isFlying(status) {
  if (!status || (status.over && status.link?.state === "lost")) return false;
  return Boolean(status.figures ? status.figures.motors_on && !status.figures.over : status.armed);
}
