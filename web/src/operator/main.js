/** The page at /operator: go, land, stop motors, and whether this page reaches the flight. */

import "./operator.css";
import { LiveChannel } from "../lib/live_channel.js";
import { make, setAttribute, setText } from "../lib/dom.js";
import { ReconnectingSocket } from "../lib/reconnecting_socket.js";
import { pageData, pageRoot } from "../lib/page_data.js";
import { cardOf } from "./card.js";
import { HoldButton } from "./hold_button.js";
import { linkWords, stateOf } from "./words.js";

const SHOW_MS = 200;
const MOTORS_AFTER_MS = 500; // the button cannot be hit by the finger that has just landed the drone
const FIGURES = [["battery", "Battery"], ["link", "Drone's link"], ["mode", "Mode"], ["motors", "Motors"]];

/** @import {Operator} from "../lib/messages.js" */

class OperatorPage {
  #parts;
  /** @type {ReconnectingSocket<Operator.FromPage, Operator.ToPage>|null} */
  #socket = null;
  #go;
  #you = 0;
  /** @type {Operator.FlightMessage|null} */
  #flight = null;
  /** @type {Operator.BeatMessage|null} */
  #beat = null;
  #beatAt = 0;
  #ended = "";
  #isLost = false; // the flight has not ended for certain: it may be connected again
  #open = false;
  #refused = "";
  #stoppedAt = 0;
  #pendingStop = ""; // the flight that is to be stopped and has not said yet that it is
  /** @type {import("../lib/messages.js").Live.DroneStatus|null} */
  #status = null;

  /** @param {HTMLElement} root @param {boolean} mayFly */
  constructor(root, mayFly) {
    this.#parts = layOut(root);
    this.root = root;
    const { go, land, motors } = this.#parts;
    this.#go = new HoldButton(go, { held: () => this.#send("go"), letGo: () => this.#send("let_go") });
    land.addEventListener("pointerdown", () => this.#stop());
    land.addEventListener("click", () => this.#stop()); // by keyboard or a screen reader
    motors.addEventListener("pointerdown", () => this.#send("stop_motors"));
    motors.addEventListener("click", () => this.#send("stop_motors"));
    addEventListener("keydown", (event) => this.#key(event, true), { capture: true });
    addEventListener("keyup", (event) => this.#key(event, false), { capture: true });
    if (mayFly) this.#connect();
    else this.#refuse("only judges and organisers may operate a flight");
    const live = new LiveChannel(["status"]);
    live.on("status", (message) => {
      this.#status = message.drones[0] ?? null;
      this.#show();
    });
    setInterval(() => this.#show(), SHOW_MS);
    this.#show();
  }

  #connect() {
    this.#socket = new ReconnectingSocket("/ws/operator", {
      message: (message) => this.#take(message),
      state: (state, reason) => {
        this.#open = state === "open";
        if (state === "refused") this.#refuse(reason);
        if (!this.#open) this.#go.release();
        this.#show();
      },
    });
  }

  /** @param {string} reason */
  #refuse(reason) {
    this.#refused = reason;
    this.#parts.login.hidden = false;
    this.#show();
  }

  /** @param {Operator.ToPage} message */
  #take(message) {
    if (message.kind === "you") this.#you = message.page;
    else if (message.kind === "none") this.#flight = this.#beat = null;
    else if (message.kind === "flight") this.#takeFlight(message);
    else if (message.kind === "beat") this.#takeBeat(message);
    else if (message.kind === "answer") setText(this.#parts.answer, message.text);
    else if (message.kind === "end") this.#end(message);
  }

  /** @param {Operator.FlightMessage} flight */
  #takeFlight(flight) {
    if (this.#flight?.flight !== flight.flight) {
      setText(this.#parts.answer, "");
      this.#beat = null;
    }
    if (this.#pendingStop !== flight.flight) this.#pendingStop = "";
    this.#flight = flight;
    this.#ended = "";
    if (this.#beat === null) this.#beatAt = performance.now(); // an app that hangs never sends the first one
    this.#parts.card.replaceChildren(...cardOf(flight.sections));
    this.#show();
  }

  /** @param {Operator.BeatMessage} beat */
  #takeBeat(beat) {
    if (!this.#flight) return;
    if (beat.stops && !this.#beat?.stops) this.#stoppedAt = performance.now();
    this.#beat = beat;
    this.#beatAt = performance.now();
    this.#send("here");
    if (beat.stops) this.#pendingStop = "";
    if (this.#pendingStop) this.#send("stop");
    this.#show();
  }

  /** @param {{words: string, lost?: boolean}} message */
  #end({ words, lost = false }) {
    this.#ended = words;
    this.#isLost = lost;
    this.#beat = null;
    if (!lost) this.#pendingStop = "";
    this.#go.release();
    this.#show();
  }

  /** @param {Operator.FromPage["kind"]} kind */
  #send(kind) {
    const flight = this.#flight?.flight ?? "";
    return this.#socket?.send({ kind, beat: this.#beat?.beat ?? -1, flight }) ?? false;
  }

  /**
   * Land. The stop is sent at each beat until the flight says that it is stopped, to the same flight only; it is
   * sent once more when it is pressed again.
   */
  #stop() {
    if (!this.#mayGoOn) return;
    if (!this.#beat?.stops) this.#pendingStop = this.#flight?.flight ?? "";
    this.#send("stop");
    this.#show();
  }

  /** Whether there is a flight that can be stopped, as far as it is known here. */
  get #mayGoOn() {
    return this.#flight !== null && (!this.#ended || this.#isLost);
  }

  get #isAlive() {
    return this.#open && this.#beat !== null && performance.now() - this.#beatAt <= 1000;
  }

  /** The keys of the terminal: G, Space, K. @param {KeyboardEvent} event @param {boolean} down */
  #key(event, down) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { key } = event;
    if (key === " ") {
      if (down && !event.repeat) this.#stop();
      event.preventDefault(); // it neither scrolls nor presses the button that has the focus
      event.stopPropagation();
    } else if (key.toLowerCase() === "g") {
      if (down && !event.repeat) this.#go.press();
      else if (!down) this.#go.release();
    } else if (key.toLowerCase() === "k" && down && !event.repeat && !this.#parts.motors.disabled) {
      this.#send("stop_motors");
    }
  }

  #show() {
    const { go, land, motors, head, words, link } = this.#parts;
    const state = stateOf(this.#flight, this.#beat, this.#ended);
    const hasFlight = this.#flight !== null && !this.#ended;
    const own = this.#beat?.pages.find(({ page }) => page === this.#you);
    const shown = linkWords({
      open: this.#open,
      refused: this.#refused,
      hasFlight,
      age_ms: performance.now() - this.#beatAt,
      delay_ms: own?.delay_ms ?? null,
      others: (this.#beat?.pages.length ?? 1) - 1,
    });
    setAttribute(this.root, "data-phase", state.phase);
    setAttribute(link, "data-look", shown.look);
    setText(link, shown.words);
    setText(head, state.head);
    setText(words, this.#flight ? state.words : `${state.words}: start one by framerunner fly --drone … --monitor`);
    setText(this.#parts.title, this.#flight?.title ?? "");
    const stops = this.#beat?.stops ?? 0;
    go.disabled = !(this.#isAlive && this.#beat?.asks);
    const areOff = ["motors stopped", "ended"].includes(this.#beat?.phase ?? "");
    land.disabled = !this.#mayGoOn || areOff;
    setText(land.firstElementChild, this.#pendingStop ? "Land: being sent" : stops ? "Land again" : "Land");
    motors.disabled = areOff || !(this.#isAlive && stops > 0 && performance.now() - this.#stoppedAt > MOTORS_AFTER_MS);
    setText(motors.firstElementChild, stops > 1 && !areOff ? "Stop motors again" : "Stop motors");
    this.#showFigures();
  }

  #showFigures() {
    const status = this.#status;
    const percent = status?.battery_percent;
    const figures = {
      battery: typeof percent === "number" ? `${percent.toFixed(0)} %` : "–",
      link: status?.link?.state ?? "–",
      mode: status?.mode || "–",
      motors: status ? (status.armed ? "on" : "off") : "–",
    };
    for (const [name, value] of Object.entries(figures)) setText(this.#parts.figures[name], value);
  }
}

/** @param {HTMLElement} root */
function layOut(root) {
  const parts = {
    link: make("p", { class: "o-link", role: "status" }),
    title: make("span", {}),
    head: make("strong", {}),
    words: make("span", {}),
    answer: make("p", { class: "o-answer problem", role: "alert" }),
    go: make("button", { type: "button", class: "o-go" }, make("span", {}, "Go"), make("small", {}, "hold 1 s")),
    land: make("button", { type: "button", class: "o-land" }, make("span", {}, "Land"), make("small", {}, "at once, where it is")),
    motors: make("button", { type: "button", class: "o-motors" }, make("span", {}, "Stop motors"), make("small", {}, "after Land; it falls")),
    card: make("section", { class: "o-card", "aria-label": "Flight card" }),
    figures: /** @type {Object<string, HTMLElement>} */ ({}),
    login: make("a", { href: "/login", class: "o-login", hidden: true }, "Log in"),
  };
  const figures = FIGURES.map(([name, title]) => {
    parts.figures[name] = make("dd", {}, "–");
    return make("div", {}, make("dt", {}, title), parts.figures[name]);
  });
  root.append(
    parts.link,
    parts.login,
    make("section", { class: "o-state" }, parts.title, parts.head, parts.words),
    make("dl", { class: "o-figures" }, ...figures),
    parts.answer,
    make("section", { class: "o-controls", "aria-label": "Controls" }, parts.go, parts.land, parts.motors),
    parts.card,
  );
  return parts;
}

new OperatorPage(pageRoot("operator"), pageData().mayFly !== false);
