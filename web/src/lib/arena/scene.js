/** Draws the arena in three dimensions: only when something changed, and never more often than the machine can bear. */
import * as THREE from "three";
import { onBeat, setPeriod } from "../beat.js";
import { buildCone, buildWorld, discard, GROUND, SKY } from "./world.js";
import { DroneModel, SIZE_M } from "./drone.js";
import { ArenaEye } from "./eye.js";
import { TRUTH_COLOUR } from "./map.js";
import { MapModel } from "./map_model.js";
import { channels } from "../colours.js";
import { isDark, make, onTheme, setAttribute, setText, wantsStillness } from "../dom.js";

/**
 * @typedef {import("./arena.js").Pose} Pose
 * @typedef {import("./arena_above.js").ColourOf} ColourOf
 * @typedef {import("./obstacles.js").Scenario} Scenario
 * @typedef {DroneModel & {label: HTMLElement}} Labelled
 */

const SLOW_FRAME_MS = 1000 / 12; // where the processor has to draw, it has other things to do too
const SLOWEST_FRAME_MS = 400;
const SLOW_SHARE = 4; // there, it draws for a quarter of the time at most
const SPAN_MS = 60; // from one pose to the next, a little more than they are apart
const SEEN_PX = 40; // a drone is drawn this large from far away, unless its true size is wanted
const MOST_TIMES = 5; // but no more than so much larger
// Sky and ground as they suit the page; the onboard view has the camera's.
const LIGHT = { sky: "#eef1f5", ground: "#b4b7b9" };
const DARK = { sky: "#161b22", ground: "#383c40" };

export class ArenaScene {
  #box;
  #labels;
  #renderer;
  #scene;
  #fog;
  #eye;
  /** @type {THREE.Group|null} */
  #world = null;
  /** @type {Scenario|null} */
  #scenario = null;
  #mapModel;
  /** @type {import("./map.js").NavigationMap|null} */
  #map = null;
  /** @type {Map<number, Labelled>} */
  #drones = new Map();
  /** @type {number|null} */
  #selected = null;
  #isTrueSize = false;
  #paint = LIGHT;
  #isSlow = false;
  #isSeen = true;
  #drawn = 0;
  #frames = 0;

  /**
   * @param {HTMLElement} box is filled
   * @param {HTMLElement} labels gets the drones' numbers
   * @throws {Error} if there is no WebGL
   */
  constructor(box, labels) {
    this.#box = box;
    this.#labels = labels;
    const canvas = make("canvas", { "aria-hidden": "true" });
    const context = canvas.getContext("webgl2", { antialias: true, powerPreference: "low-power" });
    if (!context) throw new Error("WebGL is missing");
    this.#renderer = this.#makeRenderer(canvas, context);
    this.#scene = new THREE.Scene();
    this.#fog = new THREE.Fog(LIGHT.sky, 1, 2);
    this.#scene.add(new THREE.HemisphereLight("#ffffff", "#8a8578", 2.2));
    const sun = new THREE.DirectionalLight("#ffffff", 1.6);
    sun.position.set(5, -1, 9);
    this.#scene.add(sun);
    this.#mapModel = new MapModel(this.#scene);
    this.#eye = new ArenaEye(box, () => this.#ask());
    box.prepend(canvas);
    this.#watch(canvas);
  }

  /** See `Arena`. @param {import("./arena.js").World} world */
  setWorld(world) {
    const scenario = /** @type {Scenario|null} */ (world?.scenario ?? null);
    if (this.#world) discard(this.#world);
    this.#world = scenario ? buildWorld(scenario, world.lift_m ?? 0) : null;
    this.#scenario = scenario;
    this.#mapModel.set(this.#map, scenario);
    for (const drone of this.#drones.values()) this.#setCone(drone);
    if (scenario) {
      this.#scene.add(/** @type {THREE.Group} */ (this.#world));
      this.#eye.setArena(scenario.arena, scenario.camera);
    }
    this.#ask();
  }

  /** See `Arena`. @param {import("./map.js").NavigationMap|null} map */
  setMap(map) {
    this.#map = map;
    this.#mapModel.set(map, this.#scenario);
    this.#ask();
  }

  /**
   * @param {Pose[]} poses
   * @param {ColourOf} colourOf
   * @param {boolean} [isExact] drawn there at once; else they move there smoothly
   */
  setPoses(poses, colourOf, isExact = false) {
    const now = performance.now();
    const there = new Set(poses.map((pose) => pose.id ?? 1));
    for (const [id, drone] of this.#drones) {
      if (there.has(id) || drone.began < 0) continue; // a trail may be known before the first pose
      drone.label.remove();
      drone.discard();
      this.#drones.delete(id);
    }
    for (const pose of poses) {
      const drone = this.#drone(pose.id ?? 1);
      drone.aim(pose, now, isExact);
      drone.setFresh(pose.fresh !== false);
      this.addTrail(pose.id ?? 1, [pose], colourOf);
    }
    this.#ask();
  }

  /**
   * Draw on at a trail where the motors are on.
   * @param {number} id
   * @param {Pose[]} poses
   * @param {ColourOf} colourOf
   */
  addTrail(id, poses, colourOf) {
    const { trail, truth } = this.#drone(id);
    for (const pose of poses.filter(({ on }) => on)) {
      trail.add(pose.p, rgbOf(colourOf(pose)));
      if (pose.truth) truth.add(pose.truth, rgbOf(TRUTH_COLOUR));
    }
    this.#ask();
  }

  /** @param {number} [id] */
  clearTrail(id) {
    for (const [each, drone] of this.#drones) {
      if (id !== undefined && id !== each) continue;
      drone.trail.clear();
      drone.truth.clear();
    }
    this.#ask();
  }

  /** @param {import("./arena.js").View} view */
  setView(view) {
    this.#eye.setView(view);
    this.#ask();
  }

  /** @param {number} id */
  select(id) {
    this.#selected = id;
    this.#ask();
  }

  /** @param {boolean} isTrue */
  setTrueSize(isTrue) {
    this.#isTrueSize = isTrue;
    this.#ask();
  }

  dispose() {
    this.#renderer.dispose();
  }

  /** @param {HTMLCanvasElement} canvas @param {WebGL2RenderingContext} context */
  #makeRenderer(canvas, context) {
    const told = context.getExtension("WEBGL_debug_renderer_info");
    const name = told ? String(context.getParameter(told.UNMASKED_RENDERER_WEBGL)) : "";
    this.#isSlow = /swiftshader|llvmpipe|software/i.test(name);
    if (this.#isSlow) setPeriod(SLOW_FRAME_MS);
    this.#box.dataset.renderer = this.#isSlow ? "software" : "hardware";
    const renderer = new THREE.WebGLRenderer({ canvas, context });
    renderer.setPixelRatio(this.#isSlow ? 1 : Math.min(1.5, devicePixelRatio || 1));
    renderer.setScissorTest(true);
    return renderer;
  }

  /** Draw again when the page, its theme or its size asks for it. @param {HTMLCanvasElement} canvas */
  #watch(canvas) {
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this.#ask());
    document.addEventListener("visibilitychange", () => this.#ask());
    const paint = () => {
      this.#paint = isDark(this.#box) ? DARK : LIGHT;
      this.#ask();
    };
    onTheme(paint);
    paint();
    const resize = () => {
      const { clientWidth: width, clientHeight: height } = this.#box;
      if (width === 0 || height === 0 || !this.#renderer) return;
      this.#renderer.setSize(width, height, false);
      this.#eye.setSize(width, height);
      this.#ask();
    };
    new ResizeObserver(resize).observe(this.#box);
    resize();
    new IntersectionObserver((entries) => {
      this.#isSeen = entries.at(-1)?.isIntersecting ?? false;
      this.#ask();
    }).observe(this.#box);
  }

  /** @param {number} id @returns {Labelled} */
  #drone(id) {
    let drone = this.#drones.get(id);
    if (!drone) {
      drone = /** @type {Labelled} */ (new DroneModel(this.#scene));
      drone.label = make("span", {}, String(id));
      this.#labels.append(drone.label);
      this.#drones.set(id, drone);
      this.#setCone(drone);
      this.#selected ??= id;
    }
    return drone;
  }

  /** @param {DroneModel} drone */
  #setCone(drone) {
    if (drone.cone) discard(drone.cone);
    drone.cone = this.#scenario ? buildCone(this.#scenario.camera) : null;
    if (drone.cone) drone.group.add(drone.cone);
  }

  #ask() {
    if (this.#renderer && this.#isSeen && !document.hidden) onBeat(this, (now) => this.#draw(now));
  }

  /** @param {number} now ms */
  #draw(now) {
    if (!this.#renderer) return;
    const passed_s = Math.min(0.2, (now - this.#drawn) / 1000);
    this.#drawn = now;
    const still = wantsStillness();
    let moves = false;
    for (const drone of this.#drones.values()) moves = drone.advance(now, SPAN_MS, still ? 0 : passed_s) || moves;
    const chosen = this.#drones.get(/** @type {number} */ (this.#selected)) ?? null;
    moves = this.#eye.look(chosen?.group ?? null, passed_s, still) || moves;
    this.#dressWorld();
    for (const [id, drone] of this.#drones) this.#dress(id, drone, chosen);
    const began = performance.now();
    const [x, y, width, height] = this.#eye.rectangle;
    this.#renderer.setViewport(x, y, width, height);
    this.#renderer.setScissor(x, y, width, height);
    this.#renderer.render(this.#scene, this.#eye.camera);
    this.#frames += 1;
    this.#box.dataset.frames = String(this.#frames);
    if (this.#isSlow && this.#frames % 16 === 3) this.#measure(began);
    if (moves) this.#ask();
  }

  /**
   * Wait for the picture, and draw the next ones no more often than the machine can bear.
   * @param {number} began ms
   */
  #measure(began) {
    const context = this.#renderer.getContext();
    context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array(4));
    const took_ms = performance.now() - began;
    setPeriod(Math.min(SLOWEST_FRAME_MS, Math.max(SLOW_FRAME_MS, SLOW_SHARE * took_ms)));
    this.#box.dataset.frameMs = took_ms.toFixed(1);
  }

  /** Sky, ground and what helps to see where things are, as this view wants them. */
  #dressWorld() {
    const isOnboard = this.#eye.view === "onboard";
    const sky = isOnboard ? SKY : this.#paint.sky;
    this.#renderer.setClearColor(sky);
    this.#fog.color.set(sky);
    [this.#fog.near, this.#fog.far] = [1.5 * this.#eye.overview_m, 5 * this.#eye.overview_m];
    this.#scene.fog = isOnboard ? null : this.#fog;
    const [, , wide, high] = this.#eye.rectangle;
    this.#mapModel.fit([wide, high]);
    if (!this.#world) return;
    this.#world.userData.ground.set(isOnboard ? GROUND : this.#paint.ground);
    this.#world.traverse((part) => {
      if (part.userData.isHelp) part.visible = !isOnboard;
      if (part.userData.isOnboard) part.visible = isOnboard;
      part.userData.ribbon?.fit(3, [wide, high]);
    });
  }

  /**
   * Size, label and parts of a drone as this view wants them.
   * @param {number} id
   * @param {Labelled} drone
   * @param {Labelled|null} chosen
   */
  #dress(id, drone, chosen) {
    const { camera, view, rectangle: [, , wide, high] } = this.#eye;
    const [isThere, isOnboard] = [drone.began >= 0, view === "onboard"];
    const isOwn = drone === chosen && isOnboard;
    drone.setVisible(isThere && !isOwn);
    if (isOnboard) drone.thread.visible = false;
    if (drone.cone) drone.cone.visible = drone === chosen && view === "orbit" && isThere;
    const away_m = camera.position.distanceTo(drone.group.position);
    const metre_px = high / (2 * away_m * Math.tan((camera.fov * Math.PI) / 360));
    const isLarge = view === "orbit" && !this.#isTrueSize;
    drone.setScale(isLarge ? Math.min(MOST_TIMES, Math.max(1, SEEN_PX / (SIZE_M * metre_px))) : 1);
    drone.trail.fit(high > 600 ? 5 : 4, [wide, high]);
    drone.truth.fit(2, [wide, high]);
    for (const line of [drone.trail, drone.truth]) line.mesh.visible = line.isDrawn && !isOnboard;
    const place = this.#drones.size > 1 && isThere && !isOwn ? this.#eye.toScreen(drone.group.position) : null;
    drone.label.hidden = place === null;
    setAttribute(drone.label, "data-selected", drone === chosen);
    if (place) drone.label.style.transform = `translate(${place[0] + 12}px, ${place[1] - 26}px)`;
    setText(drone.label, String(id));
  }
}

/** @type {Map<string, number[]>} */
const rgbs = new Map();

/** @param {string} colour */
function rgbOf(colour) {
  let rgb = rgbs.get(colour);
  if (!rgb) {
    rgb = channels(colour).map((channel) => channel / 255);
    rgbs.set(colour, rgb);
  }
  return rgb;
}
