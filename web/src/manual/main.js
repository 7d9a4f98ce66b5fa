/** The page at /pilot: sticks, switch, orders, and what the drone does. */

import "../lib/flight/flight.css";
import "./manual.css";
import { LiveChannel } from "../lib/live_channel.js";
import { make, setAttribute, setText } from "../lib/dom.js";
import { Gamepads } from "./gamepad.js";
import { Keys } from "./keys.js";
import { layOut } from "./layout.js";
import { ManualControlSocket } from "./socket.js";
import { ScreenStick } from "./sticks.js";
import { StopButton } from "./stop.js";
import { AXES, neutral, shaped, strongest } from "./values.js";
import { ManualViews } from "./views.js";
import { figuresOf, whoFlies } from "./words.js";
import { pageData, pageRoot } from "../lib/page_data.js";

/**
 * @import {Live, ManualControl} from "../lib/messages.js"
 * @import {Sticks} from "./values.js"
 * @typedef {ManualControl.Order["what"]} What
 */

const PERIOD_MS = 40;
const LONGEST_LOG = 5;
const FREE = { holder: "", yours: false, flying: false };
/** @type {What[]} */
const WORDS = ["take", "give", "arm", "disarm", "take_off", "land", "hold"];
const SPEED_KEY = "framerunner.pilot.top-speed";

class ManualPage {
  #parts;
  #views;
  /** @type {ManualControlSocket|null} */
  #socket = null;
  #keys = new Keys();
  #gamepads = new Gamepads();
  #left;
  #right;
  #stop;
  /** @type {Map<number|null, ManualControl.ControlMessage>} */
  #controls = new Map();
  /** @type {Live.DroneStatus[]} */
  #drones = [];
  /** @type {number|null} */
  #id = null;
  /** @type {Live.DronePose|null} */
  #pose = null;
  #connection = "away";
  #shownAt = 0;

  /** @param {HTMLElement} root @param {boolean} mayFly */
  constructor(root, mayFly) {
    this.#parts = layOut(root);
    this.root = root;
    this.#views = new ManualViews(this.#parts.camera, this.#parts.arena);
    this.#left = new ScreenStick(this.#parts.left, {
      label: "Left stick: up, down, turn",
      ends: ["up", "turn right", "down", "turn left"],
    });
    this.#right = new ScreenStick(this.#parts.right, {
      label: "Right stick: forward, back, left, right",
      ends: ["forward", "right", "back", "left"],
    });
    this.#stop = new StopButton(this.#parts.stop, {
      confirmed: () => this.#order("stop_motors", true),
      asking: () => this.#letGo(),
      question: () => `Stop the motors of drone ${this.#id}?`,
    });
    this.#listen();
    this.#hearLive();
    if (mayFly) this.#connect();
    else this.#refused();
    setInterval(() => this.#step(), PERIOD_MS);
  }

  get #control() {
    return this.#controls.get(this.#id) ?? FREE;
  }

  get #status() {
    return this.#drones.find((drone) => drone.id === this.#id);
  }

  #connect() {
    this.#socket = new ManualControlSocket({
      control: (message) => this.#takeControl(message),
      reply: (reply) => this.#say(`${reply.what.replace("_", " ")}: ${reply.text}`, reply.ok ? "good" : "bad"),
      state: (state, reason) => {
        if (state === this.#connection) return;
        if (state === "away") {
          this.#controls.clear();
          this.#letGo();
          this.#say(`not connected to the monitor${reason ? `: ${reason}` : ""}; trying again`, "bad");
        } else if (state === "refused") {
          this.#refused();
        } else if (this.root.querySelector(".p-log li")) {
          this.#say("connected", "good");
        }
        this.#connection = state;
        this.#show();
      },
    });
  }

  /** @param {ManualControl.ControlMessage} control */
  #takeControl(control) {
    const before = this.#control.yours;
    this.#controls.set(control.id, control);
    const now = this.#control.yours;
    if (!now) this.#letGo();
    if (now && !before) this.root.scrollIntoView({ block: "start" }); // brings the sticks under the thumbs
    this.#show();
  }

  #refused() {
    if (this.root.querySelector(".p-refused")) return;
    const link = make("a", { href: "/login" }, "Log in");
    this.root.prepend(
      make("p", { class: "p-refused problem", role: "alert" }, "Only judges and organisers may fly. ", link),
    );
    this.#show();
  }

  #hearLive() {
    const live = new LiveChannel(["status", "pose", "world", "chart", "detections", "notice", "text"]);
    live.on("status", (message) => this.#takeStatus(message.drones));
    live.on("pose", (message) => {
      this.#pose = message.drones.find((drone) => drone.id === this.#id) ?? null;
      this.#views.setPoses(message.drones);
    });
    live.on("world", (message) => this.#views.setWorld(message));
    live.on("chart", (message) => this.#views.setChart(message));
    live.on("detections", (message) => this.#views.setDetections(message));
    live.on("notice", (message) => {
      if (message.id === null || message.id === this.#id) this.#say(message.text, message.level === "info" ? "" : "bad");
    });
    const openedAt = performance.now();
    live.on("text", (message) => { // what was said before this page was opened is no news
      if (performance.now() - openedAt > 1000 && message.id === this.#id && message.severity <= 4) this.#say(`drone: ${message.text}`, "bad");
    });
  }

  /** @param {Live.DroneStatus[]} drones */
  #takeStatus(drones) {
    this.#drones = drones;
    if (this.#id === null && drones.length) this.#choose(drones[0].id);
    const ids = drones.map((drone) => drone.id).join(" ");
    if (this.#parts.drone.dataset.ids !== ids) {
      this.#parts.drone.dataset.ids = ids;
      this.#parts.drone.replaceChildren(
        ...drones.map((drone) => make("option", { value: String(drone.id) }, drone.name || String(drone.id))),
      );
      this.#parts.drone.value = String(this.#id);
      this.#parts.choice.hidden = drones.length < 2;
    }
    this.#views.setStatus(this.#status);
    this.#show();
  }

  /** @param {number} id of a drone */
  #choose(id) {
    this.#id = id;
    this.#views.choose(id);
    this.#views.setStatus(this.#status);
    this.#show();
  }

  /** @param {What} what @param {boolean} [confirmed] */
  #order(what, confirmed = false) {
    if (this.#id === null) this.#say("there is no drone; start one: framerunner sim", "bad");
    else if (!this.#socket?.order(this.#id, what, confirmed)) this.#say(`${what.replace("_", " ")}: not connected`, "bad");
  }

  #listen() {
    for (const what of WORDS) this.#parts[what].addEventListener("click", () => this.#order(what));
    this.#parts.drone.addEventListener("change", () => this.#choose(Number(this.#parts.drone.value)));
    addEventListener("keydown", (event) => this.#keyDown(event), { capture: true });
    addEventListener("keyup", (event) => this.#keyUp(event), { capture: true });
    addEventListener("blur", () => this.#letGo());
    document.addEventListener("visibilitychange", () => {
      if (document.hidden) this.#goAway();
    });
    const { speed } = this.#parts;
    speed.value = recall() ?? speed.value;
    speed.addEventListener("input", () => this.#showSpeed());
    this.#showSpeed();
  }

  /** The page is no longer seen: the drone is to hold now, and does so anyway when no sticks come. */
  #goAway() {
    this.#letGo();
    if (this.#control.yours && this.#control.flying) this.#order("hold");
  }

  /** All inputs are centred at once, and the drone is told so. */
  #letGo() {
    this.#keys.clear();
    this.#left.release();
    this.#right.release();
    this.#gamepads.clear();
    if (this.#control.yours) this.#send(neutral(), "");
  }

  /** @param {KeyboardEvent} event */
  #keyDown(event) {
    if (!this.#control.yours || this.#stop.asks || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target === this.#parts.drone) return;
    const speed = /** @type {Record<string, number>} */ ({ "+": 5, "=": 5, "-": -5 })[event.key];
    if (this.#keys.steers(event.code)) this.#keys.press(event.code);
    else if (speed) this.#changeSpeed(speed);
    else if (event.code === "Space" && !event.repeat) this.#order("hold");
    else if (event.code === "Escape" && !event.repeat) this.#order("give");
    else if (event.code !== "Space") return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {KeyboardEvent} event */
  #keyUp(event) {
    this.#keys.release(event.code);
    if (this.#control.yours && !this.#stop.asks && event.code === "Space") event.preventDefault(); // presses no button
  }

  /** @param {number} by percent */
  #changeSpeed(by) {
    this.#parts.speed.value = String(Number(this.#parts.speed.value) + by);
    this.#showSpeed();
  }

  #showSpeed() {
    setText(this.#parts.speedShown, `${this.#parts.speed.value} %`);
    remember(this.#parts.speed.value);
  }

  /** Look at the inputs and send. */
  #step() {
    const pad = this.#gamepads.read();
    const attended = document.hasFocus() && !document.hidden;
    if (attended && !this.#stop.asks) for (const what of pad.orders) this.#order(what);
    const inputs = [
      { name: "screen", sticks: this.#screen() },
      { name: "keys", sticks: this.#keys.read(performance.now()) },
      { name: "gamepad", sticks: pad.sticks },
    ];
    const { name, sticks } = attended && !this.#stop.asks ? strongest(inputs) : { name: "", sticks: neutral() };
    if (this.#control.yours && !document.hidden) this.#send(shaped(sticks, Number(this.#parts.speed.value) / 100), name);
    else if (!this.#control.yours) this.#showSent(neutral(), "");
    if (performance.now() - this.#shownAt > 200) this.#showFigures();
  }

  #screen() {
    return { forward: this.#right.up, right: this.#right.right, up: this.#left.up, yaw: this.#left.right };
  }

  /** @param {Sticks} sticks @param {string} name of the input; "" for none */
  #send(sticks, name) {
    this.#socket?.sticks(sticks);
    this.#showSent(sticks, name);
  }

  /** @param {Sticks} sticks @param {string} name of the input; "" for none */
  #showSent(sticks, name) {
    for (const axis of AXES) {
      setText(this.#parts[`value-${axis}`], sticks[axis].toFixed(2));
      this.#parts[`bar-${axis}`].style.setProperty("--value", sticks[axis]);
    }
    const pad = this.#gamepads.name ? "gamepad ready" : "";
    const words = name === "gamepad" ? `gamepad ${this.#gamepads.name}` : name || pad;
    setText(this.#parts.input, this.#control.yours ? words || "none" : pad || "–");
  }

  #showFigures() {
    this.#shownAt = performance.now();
    for (const [name, value] of Object.entries(figuresOf(this.#status, this.#pose))) {
      setText(this.#parts[`figure-${name}`], value);
    }
    setAttribute(this.#parts["figure-link"].parentElement, "data-state", this.#status?.link?.state ?? "lost");
  }

  #show() {
    const control = this.#control;
    const { look, head, words } = whoFlies(this.#status, control);
    setAttribute(this.root, "data-look", look);
    setText(this.#parts.head, head);
    setText(this.#parts.words, words);
    const steering = control.yours && control.flying;
    setText(this.#parts.give, control.yours ? "Give back" : "Automatic");
    setText(this.#parts.take, steering ? "Manual" : "Take sticks");
    setAttribute(this.#parts.take, "aria-pressed", String(steering));
    setAttribute(this.#parts.give, "aria-pressed", String(look === "auto"));
    this.#parts.give.disabled = !control.yours;
    this.#parts.drone.disabled = control.yours;
    const usable = this.#socket !== null && this.#connection === "open" && this.#id !== null;
    for (const what of WORDS) if (what !== "give") this.#parts[what].disabled = !usable;
    this.#stop.button.disabled = !usable;
  }

  /** @param {string} text @param {"good"|"bad"|""} look */
  #say(text, look) {
    const time = new Date().toLocaleTimeString([], { hour12: false });
    const line = make("li", { "data-look": look || null }, make("time", {}, time), " ", text);
    this.#parts.log.prepend(line);
    while (this.#parts.log.children.length > LONGEST_LOG) this.#parts.log.lastElementChild.remove();
  }
}

/** @param {string} value percent */
function remember(value) {
  try {
    localStorage.setItem(SPEED_KEY, value);
  } catch { /* it is chosen again next time */ }
}

function recall() {
  try {
    return localStorage.getItem(SPEED_KEY);
  } catch {
    return null;
  }
}

const root = pageRoot("manual");
new ManualPage(root, pageData().mayFly !== false);
