import { buildCone, buildWorld, discard, GROUND, SKY } from "./arena_world.js";
import { DroneModel, SIZE_M } from "./arena_drone.js";
import { ArenaEye } from "./arena_eye.js";
import { channels, kindOf, stateColour } from "./colours.js";
import { isDark, isTyping, make, onTheme, setAttribute, setText, wantsStillness } from "./dom.js";
import { TopView } from "./topview.js";

/**
 * @typedef {object} Pose one drone, as in the live channel's message "pose"
 * @property {number} [id] 1 if there is none
 * @property {number} t seconds
 * @property {number[]} p x, y, z, metres, arena axes
 * @property {number[]} q w, x, y, z, body forward-left-up to arena
 * @property {boolean} on motors
 * @property {number} s index into the states of its mission; -1 if none
 * @property {boolean} [fresh] true if there is none
 */

const FRAME_MS = 1000 / 30;
const SLOW_FRAME_MS = 1000 / 12; // where the processor has to draw, it has other things to do too
const SPAN_MS = 60; // from one pose to the next, a little more than they are apart
const VIEWS = { orbit: "Orbit", follow: "Follow", onboard: "Onboard" };
// Sky and ground as they suit the page; the onboard view has the camera's.
const LIGHT = { sky: "#eef1f5", ground: "#b4b7b9" };
const DARK = { sky: "#161b22", ground: "#383c40" };

/** The arena in three dimensions, or from above where a browser cannot draw those. */
export class Arena {
  #box;
  #labels;
  #legend;
  #kinds = new Set();
  #buttons = {};
  #sizeButton;
  #flat = null;
  #THREE = null;
  #renderer = null;
  #scene;
  #eye;
  #world = null;
  #worldMessage = null;
  #drones = new Map();
  #orders = new Map();
  #view = "orbit";
  #selected = null;
  #isTrueSize = false;
  #asked = false;
  #drawn = 0;
  #frame_ms = FRAME_MS;
  #waiting = [];
  #paint = LIGHT;

  /** @param {HTMLElement} element an empty box with a size; its size is followed */
  constructor(element) {
    this.#box = make("div", { class: "m-arena", tabindex: "0", role: "group", "aria-label": "the arena" });
    this.#labels = make("div", { class: "m-arena-labels", "aria-hidden": "true" });
    const bar = this.#makeBar();
    this.#legend = make("ul", { class: "m-arena-legend", "aria-label": "colours of the trail" });
    this.#box.append(this.#labels, bar, this.#legend);
    element.append(this.#box);
    this.ready = this.#open();
  }

  /** @param {{scenario: object|null, lift_m: number, source: string}} world as in the message "world" */
  setWorld(world) {
    this.#worldMessage = world;
    this.#do(() => {
      if (this.#flat) return this.#flat.setWorld(world);
      if (this.#world) discard(this.#world);
      this.#world = null;
      for (const drone of this.#drones.values()) this.#setCone(drone);
      if (world?.scenario) {
        this.#world = buildWorld(this.#THREE, world.scenario, world.lift_m ?? 0);
        this.#scene.add(this.#world);
        this.#eye.setArena(world.scenario.arena, world.scenario.camera);
      }
      this.#ask();
    });
  }

  /**
   * Where the drones are now; moves on smoothly from where they were, and draws on at their trails.
   * A trail begins anew when the motors come on, and when time goes back.
   * @param {Pose[]} poses
   * @param {string[]|Object<number, string[]>} states ids of the mission's states, the same for all or by drone
   */
  setPoses(poses, states) {
    this.#do(() => {
      if (this.#flat) return this.#flat.setPoses(poses, (pose) => this.#colour(pose, states));
      const now = performance.now();
      const there = new Set(poses.map((pose) => pose.id ?? 1));
      for (const id of this.#drones.keys()) if (!there.has(id)) this.#remove(id);
      for (const pose of poses) this.#place(pose, now, states);
      this.#ask();
    });
  }

  /** @param {"orbit"|"follow"|"onboard"} view */
  setView(view) {
    this.#view = view;
    setAttribute(this.#box, "data-view", view);
    for (const [name, button] of Object.entries(this.#buttons)) setAttribute(button, "aria-pressed", name === view ? "true" : "false");
    this.#do(() => {
      this.#eye?.setView(view);
      this.#ask();
    });
  }

  /** Whom "follow" and "onboard" follow. @param {number} id */
  select(id) {
    this.#selected = id;
    this.#do(() => {
      this.#flat?.select(id);
      this.#ask();
    });
  }

  /** Forget the trails. @param {number} [id] only this drone's */
  clearTrail(id) {
    this.#do(() => {
      this.#forgetKinds();
      if (this.#flat) return this.#flat.clearTrail(id);
      for (const [each, drone] of this.#drones) if (id === undefined || id === each) drone.trail.clear();
      this.#ask();
    });
  }

  /**
   * Draw a whole trail at once, for a replay that jumps; the next `setPoses` goes on from its end.
   * @param {Pose[]} poses
   * @param {string[]} states
   * @param {number} [id]
   */
  setTrail(poses, states, id = 1) {
    this.#do(() => {
      if (this.#flat) return this.#flat.setTrail(poses, (pose) => this.#colour({ ...pose, id }, states), id);
      const drone = this.#drone(id);
      drone.trail.clear();
      this.#forgetKinds();
      for (const pose of poses) if (pose.on) drone.trail.add(pose.p, rgbOf(this.#colour({ ...pose, id }, states)));
      if (poses.length > 0) drone.pose = poses.at(-1);
      this.#ask();
    });
  }

  /** Let go of the graphics card. */
  dispose() {
    this.#renderer?.dispose();
    this.#box.remove();
    this.#renderer = null;
  }

  /** Done at once, or when the graphics are there. */
  #do(what) {
    if (this.#renderer || this.#flat) what();
    else this.#waiting.push(what);
  }

  async #open() {
    try {
      const { THREE, OrbitControls } = await import("/lib/three/index.js");
      this.#start(THREE, OrbitControls);
    } catch (error) {
      console.info(`no 3-D here (${error.message}); the arena is drawn from above`);
      const words = "This browser draws no 3-D here, so the arena is shown from above.";
      this.#flat = new TopView(this.#box, words);
      for (const button of [...Object.values(this.#buttons), this.#sizeButton]) button.hidden = true;
    }
    for (const what of this.#waiting.splice(0)) what();
  }

  #start(THREE, OrbitControls) {
    const canvas = make("canvas", { "aria-hidden": "true" });
    const context = canvas.getContext("webgl2", { antialias: true, powerPreference: "low-power" });
    if (!context) throw new Error("WebGL is missing");
    const told = context.getExtension("WEBGL_debug_renderer_info");
    const name = told ? String(context.getParameter(told.UNMASKED_RENDERER_WEBGL)) : "";
    const isSlow = /swiftshader|llvmpipe|software/i.test(name);
    this.#frame_ms = isSlow ? SLOW_FRAME_MS : FRAME_MS;
    this.#box.dataset.renderer = isSlow ? "software" : "hardware";
    const renderer = new THREE.WebGLRenderer({ canvas, context, antialias: true });
    renderer.setPixelRatio(isSlow ? 1 : Math.min(1.5, devicePixelRatio || 1));
    renderer.setScissorTest(true);
    this.#THREE = THREE;
    this.#scene = new THREE.Scene();
    this.#scene.add(new THREE.HemisphereLight("#ffffff", "#8a8578", 2.2));
    const sun = new THREE.DirectionalLight("#ffffff", 1.6);
    sun.position.set(5, -1, 9);
    this.#scene.add(sun);
    this.#eye = new ArenaEye(THREE, OrbitControls, this.#box, () => this.#ask());
    this.#box.prepend(canvas);
    this.#renderer = renderer;
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this.#ask());
    document.addEventListener("visibilitychange", () => this.#ask());
    onTheme(() => this.#paintSky());
    this.#paintSky();
    new ResizeObserver(() => this.#resize()).observe(this.#box);
    this.#resize();
  }

  #paintSky() {
    const dark = isDark(this.#box);
    this.#paint = dark ? DARK : LIGHT;
    this.#ask();
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.#box;
    if (width === 0 || height === 0) return;
    this.#renderer.setSize(width, height, false);
    this.#eye.setSize(width, height);
    this.#ask();
  }

  #makeBar() {
    const bar = make("div", { class: "m-views", role: "toolbar", "aria-label": "views" });
    Object.entries(VIEWS).forEach(([view, words], index) => {
      const key = make("kbd", { "aria-hidden": "true" }, String(index + 1));
      const pressed = view === "orbit" ? "true" : "false";
      const button = make("button", { type: "button", "aria-pressed": pressed, "data-view": view, "aria-keyshortcuts": String(index + 1) }, key, words);
      button.addEventListener("click", () => this.setView(view));
      this.#buttons[view] = button;
      bar.append(button);
    });
    this.#sizeButton = make("button", { type: "button", "aria-pressed": "false", title: "show the drone no larger than it is" }, "True size");
    this.#sizeButton.addEventListener("click", () => {
      this.#isTrueSize = !this.#isTrueSize;
      setAttribute(this.#sizeButton, "aria-pressed", String(this.#isTrueSize));
      this.#ask();
    });
    bar.append(this.#sizeButton);
    this.#box.dataset.view = "orbit";
    document.addEventListener("keydown", (event) => {
      const view = Object.keys(VIEWS)[Number(event.key) - 1];
      if (view && !event.ctrlKey && !event.metaKey && !event.altKey && !isTyping(event)) this.setView(view);
    });
    return bar;
  }

  #drone(id) {
    let drone = this.#drones.get(id);
    if (!drone) {
      drone = new DroneModel(this.#THREE, this.#scene);
      drone.label = make("span", {}, String(id));
      this.#labels.append(drone.label);
      this.#drones.set(id, drone);
      this.#setCone(drone);
      this.#selected ??= id;
    }
    return drone;
  }

  #remove(id) {
    const drone = this.#drones.get(id);
    drone.label.remove();
    drone.discard();
    this.#drones.delete(id);
  }

  #setCone(drone) {
    if (drone.cone) discard(drone.cone);
    const camera = this.#worldMessage?.scenario?.camera;
    drone.cone = camera ? buildCone(this.#THREE, camera) : null;
    if (drone.cone) drone.group.add(drone.cone);
  }

  #place(pose, now, states) {
    const drone = this.#drone(pose.id ?? 1);
    const before = drone.pose;
    const isBack = before !== null && pose.t < before.t - 0.5;
    if (isBack || (before && pose.on && !before.on)) {
      drone.trail.clear();
      this.#forgetKinds();
    }
    drone.aim(pose, now, isBack);
    drone.setFresh(pose.fresh !== false);
    if (pose.on) drone.trail.add(pose.p, rgbOf(this.#colour(pose, states)));
  }

  #forgetKinds() {
    this.#kinds.clear();
    this.#legend.replaceChildren();
  }

  /** Say in the legend which kind of state a colour is, once it is on a trail. */
  #explain(state, colour) {
    const kind = kindOf(state);
    if (this.#kinds.has(kind)) return;
    this.#kinds.add(kind);
    const swatch = make("span", { class: "m-swatch" });
    swatch.style.background = colour;
    this.#legend.append(make("li", {}, swatch, kind));
  }

  #colour(pose, states) {
    const id = pose.id ?? 1;
    const list = Array.isArray(states) ? states : states?.[id];
    const state = list?.[pose.s];
    if (state === undefined) return "#5c6773";
    // Kinds are numbered as they first stand in the mission, so that all who watch see the same colours.
    if (this.#orders.get(id)?.list !== list) {
      const order = [];
      list.forEach((each) => stateColour(each, order));
      this.#orders.set(id, { list, order });
    }
    const colour = stateColour(state, this.#orders.get(id).order);
    if (pose.on) this.#explain(state, colour);
    return colour;
  }

  #ask() {
    if (this.#asked || !this.#renderer || document.hidden) return;
    this.#asked = true;
    const wait_ms = this.#frame_ms - (performance.now() - this.#drawn);
    const draw = () => requestAnimationFrame((now) => this.#draw(now));
    if (wait_ms > 18) setTimeout(draw, wait_ms - 16);
    else draw();
  }

  #draw(now) {
    this.#asked = false;
    if (!this.#renderer) return;
    const passed_s = Math.min(0.2, (now - this.#drawn) / 1000);
    this.#drawn = now;
    const still = wantsStillness();
    let moves = false;
    for (const drone of this.#drones.values()) moves = drone.advance(now, still ? 1 : SPAN_MS, still ? 0 : passed_s) && !(still && !drone.pose) || moves;
    const chosen = this.#drones.get(this.#selected) ?? null;
    moves = this.#eye.look(chosen?.group ?? null, passed_s, still) || moves;
    const { camera, rectangle } = this.#eye;
    const sky = new this.#THREE.Color(this.#eye.view === "onboard" ? SKY : this.#paint.sky);
    this.#scene.background = sky;
    this.#scene.fog = this.#eye.view === "onboard" ? null : new this.#THREE.Fog(sky, 1.5 * this.#eye.overview_m, 5 * this.#eye.overview_m);
    for (const [id, drone] of this.#drones) this.#dress(id, drone, chosen, camera);
    this.#dressWorld();
    const renderer = this.#renderer;
    renderer.setViewport(...rectangle);
    renderer.setScissor(...rectangle);
    renderer.render(this.#scene, camera);
    this.#box.dataset.frames = String(Number(this.#box.dataset.frames ?? 0) + 1);
    if (moves && !(still && !this.#isMoving(now))) this.#ask();
  }

  #isMoving(now) {
    return [...this.#drones.values()].some((drone) => now - drone.began < SPAN_MS);
  }

  #dressWorld() {
    if (!this.#world) return;
    const isOnboard = this.#eye.view === "onboard";
    this.#world.userData.ground.set(isOnboard ? GROUND : this.#paint.ground);
    const [, , wide, high] = this.#eye.rectangle;
    this.#world.traverse((part) => {
      if (part.userData.isHelp) part.visible = !isOnboard;
      part.userData.ribbon?.fit(3, [wide, high]);
    });
  }

  /** Size, label and parts of a drone as this view wants them. */
  #dress(id, drone, chosen, camera) {
    const isOwn = drone === chosen && this.#eye.view === "onboard";
    drone.setVisible(drone.began >= 0 && !isOwn);
    if (drone.cone) drone.cone.visible = drone === chosen && this.#eye.view === "orbit" && drone.began >= 0;
    const [, , wide, high] = this.#eye.rectangle;
    const away_m = camera.position.distanceTo(drone.group.position);
    const metre_px = high / (2 * away_m * Math.tan((camera.fov * Math.PI) / 360));
    const wanted = this.#eye.view === "orbit" && !this.#isTrueSize ? Math.min(5, Math.max(1, 40 / (SIZE_M * metre_px))) : 1;
    drone.setScale(wanted);
    drone.trail.fit(high > 600 ? 5 : 4, [wide, high]);
    drone.thread.visible = drone.thread.visible && this.#eye.view !== "onboard";
    drone.trail.mesh.visible = drone.trail.isDrawn && this.#eye.view !== "onboard";
    const shown = this.#drones.size > 1 && drone.began >= 0 && !isOwn;
    const place = shown ? this.#eye.toScreen(drone.group.position) : null;
    drone.label.hidden = place === null;
    setAttribute(drone.label, "data-selected", drone === chosen);
    if (place) drone.label.style.transform = `translate(${place[0] + 12}px, ${place[1] - 26}px)`;
    setText(drone.label, String(id));
  }
}

const rgbs = new Map();

function rgbOf(colour) {
  let rgb = rgbs.get(colour);
  if (!rgb) {
    rgb = channels(colour).map((channel) => channel / 255);
    rgbs.set(colour, rgb);
  }
  return rgb;
}
