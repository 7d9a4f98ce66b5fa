/** From where the arena is seen: round about it, behind a drone, or through its camera. */
import { Matrix4, PerspectiveCamera, Quaternion, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

/**
 * @typedef {import("three").Object3D} Object3D
 * @typedef {import("./arena.js").View} View
 * @typedef {import("./obstacles.js").Scenario} Scenario
 */

const ORBIT_FOV_DEG = 42;
const FOLLOW_FOV_DEG = 55;
const BEHIND_M = 1.5;
const ABOVE_M = 0.55;
const LAG_S = 0.3; // how far "follow" lags behind, so that a turn is seen as one
const KEY_RAD = 0.12;

/** The camera of the page. */
export class ArenaEye {
  #box;
  #ask;
  #controls;
  #size = [1, 1];
  #arena = { length_x_m: 10, width_y_m: 10, height_m: 4 };
  #onboard = { width_px: 320, height_px: 240, horizontal_fov_rad: 1.57, position_flu_m: [0.08, 0, 0] };
  #isTouched = false;
  /** @type {import("three").Vector3|null} */
  #heading = null;
  #orbitCamera;
  #otherCamera;

  /**
   * @param {HTMLElement} box what takes mouse, touch and keys
   * @param {function(): void} ask for a new picture
   */
  constructor(box, ask) {
    this.#box = box;
    this.#ask = ask;
    /** @type {View} */
    this.view = "orbit";
    this.rectangle = [0, 0, 1, 1];
    this.overview_m = 14; // how far away all of the arena is seen
    this.#orbitCamera = new PerspectiveCamera(ORBIT_FOV_DEG, 1, 0.1, 300);
    this.#otherCamera = new PerspectiveCamera(FOLLOW_FOV_DEG, 1, 0.01, 300);
    for (const camera of [this.#orbitCamera, this.#otherCamera]) camera.up.set(0, 0, 1);
    const controls = new OrbitControls(this.#orbitCamera, box);
    Object.assign(controls, { maxPolarAngle: 1.53, minDistance: 0.6, maxDistance: 45, enableZoom: false });
    box.style.touchAction = "pan-y"; // a finger that moves up or down scrolls the page; sideways, or two, turn and zoom
    controls.addEventListener("change", ask);
    controls.addEventListener("start", () => { this.#isTouched = true; });
    // The wheel scrolls the page unless somebody has gone into the arena on purpose.
    box.addEventListener("focusin", () => { controls.enableZoom = this.view === "orbit"; });
    box.addEventListener("focusout", () => { controls.enableZoom = false; });
    box.addEventListener("touchstart", (event) => { controls.enableZoom = event.touches.length > 1; }, { passive: true });
    box.addEventListener("keydown", (event) => this.#key(event));
    this.#controls = controls;
  }

  /** What looks now. */
  get camera() {
    return this.view === "orbit" ? this.#orbitCamera : this.#otherCamera;
  }

  /** @param {View} view */
  setView(view) {
    this.view = view;
    this.#heading = null;
    this.#controls.enabled = view === "orbit";
    this.#frame();
  }

  /** @param {number} width @param {number} height */
  setSize(width, height) {
    this.#size = [width, height];
    this.#frame();
    if (!this.#isTouched) this.#overview();
  }

  /** @param {Scenario["arena"]} arena @param {Scenario["camera"]} camera */
  setArena(arena, camera) {
    this.#arena = arena;
    this.#onboard = camera;
    this.#frame();
    if (!this.#isTouched) this.#overview();
  }

  /**
   * Look where the view looks.
   * @param {Object3D|null} drone with its place and attitude
   * @param {number} passed_s since the last picture
   * @param {boolean} still nothing moves by itself
   * @returns {boolean} whether the view moves on by itself
   */
  look(drone, passed_s, still) {
    if (this.view === "orbit" || !drone) return false;
    if (this.view === "onboard") {
      this.#lookOut(drone);
      return false;
    }
    return this.#follow(drone, passed_s, still);
  }

  /**
   * Where a place is on the page, in pixels of the box; null if it is behind.
   * @param {import("three").Vector3} place
   */
  toScreen(place) {
    const seen = place.clone().project(this.camera);
    if (seen.z > 1) return null;
    const [x, y, width, height] = this.rectangle;
    const bottom = this.#size[1] - y;
    return [x + ((seen.x + 1) / 2) * width, bottom - ((seen.y + 1) / 2) * height];
  }

  /** Fit the picture into the box; the onboard view keeps the shape of the camera's image. */
  #frame() {
    const [width, height] = this.#size;
    const [other, orbit] = [this.#otherCamera, this.#orbitCamera];
    this.rectangle = [0, 0, width, height];
    orbit.aspect = width / height;
    orbit.updateProjectionMatrix();
    other.aspect = width / height;
    other.fov = FOLLOW_FOV_DEG;
    if (this.view === "onboard") {
      const { width_px, height_px, horizontal_fov_rad } = this.#onboard;
      const shape = width_px / height_px;
      const wide = Math.min(width, height * shape);
      const high = wide / shape;
      this.rectangle = [Math.round((width - wide) / 2), Math.round((height - high) / 2), Math.round(wide), Math.round(high)];
      other.aspect = shape;
      other.fov = (2 * Math.atan(Math.tan(horizontal_fov_rad / 2) / shape) * 180) / Math.PI;
    }
    other.updateProjectionMatrix();
    this.#ask();
  }

  /** Stand as near as all of the arena lets one. */
  #overview() {
    const camera = this.#orbitCamera;
    const { length_x_m, width_y_m, height_m } = this.#arena;
    const target = new Vector3(0, 0, Math.min(height_m, 3) * 0.3);
    const way = new Vector3(-0.72, -0.42, 0.56).normalize();
    const corners = [-0.5, 0.5].flatMap((x) => [-0.5, 0.5].flatMap((y) => [0, 1].map(
      (z) => new Vector3(x * length_x_m, y * width_y_m, z * Math.min(height_m, 3)))));
    this.#controls.target.copy(target);
    const widest = Math.hypot(length_x_m, width_y_m, height_m);
    let [near, far] = [0.5 * widest, 6 * widest];
    camera.far = 10 * widest + 150;
    camera.updateProjectionMatrix();
    for (let step = 0; step < 24; step += 1) {
      const away = (near + far) / 2;
      camera.position.copy(target).addScaledVector(way, away);
      camera.lookAt(target);
      camera.updateMatrixWorld();
      const fits = corners.every((corner) => {
        const seen = corner.clone().project(camera);
        return Math.abs(seen.x) < 0.98 && seen.y < 0.94 && seen.y > -0.8 && seen.z < 1; // below stands the legend
      });
      if (fits) far = away;
      else near = away;
    }
    this.overview_m = far;
    this.#controls.maxDistance = 3 * far;
    this.#controls.update();
  }

  /** @param {Object3D} drone */
  #lookOut(drone) {
    // A camera of three.js looks along its -z with y up; the drone's looks along x with z up.
    const turn = new Quaternion().setFromRotationMatrix(
      new Matrix4().makeBasis(new Vector3(0, -1, 0), new Vector3(0, 0, 1), new Vector3(-1, 0, 0)));
    const camera = this.#otherCamera;
    camera.position.fromArray(this.#onboard.position_flu_m).applyQuaternion(drone.quaternion).add(drone.position);
    camera.quaternion.copy(drone.quaternion).multiply(turn);
    camera.updateMatrixWorld();
  }

  /** @param {Object3D} drone @param {number} passed_s @param {boolean} still */
  #follow(drone, passed_s, still) {
    const ahead = new Vector3(1, 0, 0).applyQuaternion(drone.quaternion).setZ(0).normalize();
    const share = still || this.#heading === null ? 1 : 1 - Math.exp(-passed_s / LAG_S);
    this.#heading ??= ahead.clone();
    const left = this.#heading.angleTo(ahead);
    this.#heading.lerp(ahead, share).normalize();
    const camera = this.#otherCamera;
    camera.position.copy(drone.position).addScaledVector(this.#heading, -BEHIND_M);
    camera.position.z = Math.max(0.15, drone.position.z + ABOVE_M);
    camera.up.set(0, 0, 1);
    camera.lookAt(drone.position.clone().addScaledVector(this.#heading, 0.8));
    camera.updateMatrixWorld();
    return left > 0.002;
  }

  /** Arrows turn, + and - come nearer and go away. @param {KeyboardEvent} event */
  #key(event) {
    if (event.target !== this.#box || this.view !== "orbit") return;
    const turns = /** @type {Record<string, number[]|undefined>} */ ({
      ArrowLeft: [-KEY_RAD, 0], ArrowRight: [KEY_RAD, 0], ArrowUp: [0, -KEY_RAD], ArrowDown: [0, KEY_RAD],
    })[event.key];
    const nearer = /** @type {Record<string, number|undefined>} */ ({
      "+": 0.88, "=": 0.88, "-": 1.14,
    })[event.key];
    if (!turns && !nearer) return;
    event.preventDefault();
    this.#isTouched = true;
    const { target, maxPolarAngle, minDistance, maxDistance } = this.#controls;
    const offset = new Vector3().subVectors(this.#orbitCamera.position, target);
    const away = Math.min(maxDistance, Math.max(minDistance, offset.length() * (nearer ?? 1)));
    const [azimuth, polar] = [Math.atan2(offset.y, offset.x), Math.acos(offset.z / offset.length())];
    const around = azimuth + (turns?.[0] ?? 0);
    const down = Math.min(maxPolarAngle, Math.max(0.05, polar + (turns?.[1] ?? 0)));
    offset.set(Math.cos(around) * Math.sin(down), Math.sin(around) * Math.sin(down), Math.cos(down));
    this.#orbitCamera.position.copy(target).addScaledVector(offset, away);
    this.#controls.update();
    this.#ask();
  }
}
