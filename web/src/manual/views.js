/** What the person with the sticks looks at: the camera's image and, where there is room, the arena from behind the drone. */

import { CameraView } from "../lib/flight/camera.js";

/** @import {Live} from "../lib/messages.js" */

const ROOM = "(min-width: 60rem) and (min-height: 36rem)"; // as in manual.css

export class ManualViews {
  #camera;
  #arenaBox;
  /** @type {import("../lib/arena/arena.js").Arena|null} */
  #arena = null;
  /** @type {number|null} */
  #id = null;
  /** @type {Live.World|null} */
  #world = null;
  /** @type {Object<number, string[]>} */
  #states = {};

  /** @param {HTMLElement} camera an empty box @param {HTMLElement} arena an empty box */
  constructor(camera, arena) {
    this.#camera = new CameraView(camera);
    this.#arenaBox = arena;
    const room = matchMedia(ROOM);
    const look = () => {
      if (room.matches && !this.#arena) this.#open();
    };
    room.addEventListener("change", look);
    look();
  }

  /** @param {number} id of the drone that is flown */
  choose(id) {
    this.#id = id;
    this.#camera.setDetections(null);
    this.#arena?.select(id);
  }

  /** @param {Live.DroneStatus|undefined} status of that drone */
  setStatus(status) {
    this.#camera.setImage(status?.video ? `/video/${status.id}` : null, status ? "no video" : "no drone yet: start one with framerunner sim");
  }

  /** @param {Live.World} message */
  setWorld(message) {
    this.#world = message;
    this.#arena?.setWorld(message);
  }

  /** @param {Live.Chart} message */
  setChart(message) {
    this.#states[message.id] = message.states ?? [];
  }

  /** @param {Live.Detections} message */
  setDetections(message) {
    if (message.id === this.#id) this.#camera.setDetections(message);
  }

  /** @param {Live.DronePose[]} drones of the message "pose" */
  setPoses(drones) {
    this.#arena?.setPoses(drones, this.#states);
  }

  /** The arena is a large module, and work for the graphics card: phones do without. */
  async #open() {
    const { Arena } = await import("../lib/arena/arena.js");
    if (this.#arena) return;
    this.#arena = new Arena(this.#arenaBox);
    if (this.#world) this.#arena.setWorld(this.#world);
    if (this.#id !== null) this.#arena.select(this.#id);
    this.#arena.setView("follow");
  }
}
