/** The page for an audience: what flies now, what just ended, who is next, who won. It follows by itself. */
import "../lib/flight/flight.css";
import "./stage.css";
import { Arena } from "../lib/arena/arena.js";
import { mapIn } from "../lib/arena/map.js";
import { CameraView } from "../lib/flight/camera.js";
import { watchContest } from "../lib/contest/contest.js";
import { make } from "../lib/dom.js";
import { Fleet } from "../lib/flight/fleet.js";
import { Flight, isFlying } from "../lib/flight/flight.js";
import { watchLive } from "../lib/watch_live.js";
import { Podium, StageRanking } from "./board.js";
import { StageHead, Splits } from "./flight.js";
import { pageRoot } from "../lib/page_data.js";

/**
 * @import {Contest as Views, Live} from "../lib/messages.js"
 * @import {FlownTry, Stage} from "../competition/answers"
 * @typedef {Views.RunningView|FlownTry} Flown
 */

const RESULT_MS = 30_000; // a result stays at least this long, unless the next flight begins
const LOOK_MS = 1000;

class StagePage {
  #root;
  #fleet;
  #flight;
  #head = new StageHead();
  #splits = new Splits();
  #board = new StageRanking();
  #podium = new Podium();
  /** @type {import("../lib/contest/contest.js").Contest} */
  #contest = { running: [], stage: null };
  /** @type {FlownTry|null} */
  #against = null; // the best try when the present one began
  #isFlying = false;
  /** @type {number|null} */
  #endedAt = null; // performance.now() of the end of the last flight seen; null: none was seen

  /** @param {HTMLElement} root an empty box */
  constructor(root) {
    this.#root = root;
    const line = make("p", { class: "m-line s-line", role: "status", hidden: true });
    const [arenaBox, cameraBox] = [make("div", { class: "s-arena" }), make("div", { class: "s-camera" })];
    const pictures = make("div", { class: "s-pictures" }, arenaBox, cameraBox);
    root.append(this.#head.element, pictures, this.#splits.element, this.#board.element, this.#podium.element, line);
    root.dataset.phase = "waiting";
    const arena = new Arena(arenaBox);
    this.#flight = new Flight(arena, new CameraView(cameraBox), {
      states: () => this.#fleet.states(), passed: () => {},
    });
    this.#fleet = new Fleet(make("div"), (drone) => {
      arena.select(drone.id);
      arena.setMap(drone.map);
      this.#flight.choose(drone.id);
    });
    this.#hear(arena, line);
    watchContest((contest) => {
      this.#contest = contest;
      this.#show();
    });
    setInterval(() => this.#show(), LOOK_MS);
  }

  /** @param {Arena} arena @param {HTMLElement} line */
  #hear(arena, line) {
    let world = "";
    watchLive({
      world: (message) => {
        const text = JSON.stringify(message);
        if (text !== world) arena.setWorld(message);
        world = text;
      },
      history: (message) => this.#flight.setHistory(message),
      chart: (message) => { this.#fleet.of(message.id).chart = message; },
      pose: ({ drones }) => this.#flight.addPoses(drones),
      map: (message) => {
        const drone = this.#fleet.of(message.id);
        drone.map = mapIn(message);
        if (this.#fleet.chosen === drone) arena.setMap(drone.map);
      },
      detections: (message) => {
        if (this.#fleet.chosen?.id === message.id) this.#flight.addDetections(message);
      },
      status: ({ drones }) => {
        this.#fleet.setStatus(drones);
        const flying = drones.find(isFlying);
        if (flying && !isFlying(this.#fleet.chosen?.status)) this.#fleet.choose(flying.id);
        this.#flight.setStatus(this.#fleet.chosen?.status ?? null);
        this.#show();
      },
    }, line);
  }

  /** The try that is shown as the contest knows it; null if it does not. @returns {Flown|null} */
  get #try() {
    const { running, stage } = this.#contest;
    const id = this.#fleet.chosen?.id;
    const now = running.find((each) => each.drone_id === id);
    return now ?? (!this.#isFlying && stage?.last?.drone_id === id ? stage.last : null);
  }

  #show() {
    const status = this.#fleet.chosen?.status ?? null;
    const { stage } = this.#contest;
    this.#follow(status);
    const phase = this.#phase(status);
    this.#root.dataset.phase = phase;
    if (phase === "flying" || phase === "ended") {
      const flown = this.#try;
      const figures = status?.figures ?? null;
      const scenario = flown?.scenario ?? "";
      const rank = phase === "ended" ? rankOf(stage, flown?.team_name) : null;
      this.#head.show({ team: flown?.team_name ?? "", scenario, figures, isOver: phase === "ended", rank });
      this.#splits.show(figures, flown?.frames ?? ["red", "green", "blue"], this.#best(flown));
    } else if (phase === "podium") {
      this.#podium.show(stage.ranking);
    } else {
      this.#board.show(stage);
    }
  }

  /** Notice the beginning and the end of a flight. @param {Live.DroneStatus|null} status */
  #follow(status) {
    const flying = isFlying(status);
    if (flying && !this.#isFlying) {
      this.#endedAt = null;
      this.#against = null;
    }
    const isOver = !flying && Boolean(status?.figures)
      && /** @type {{figures: {try_time_s: number}}} */ (status).figures.try_time_s > 0;
    if (isOver && this.#endedAt === null) this.#endedAt = performance.now();
    this.#isFlying = flying;
  }

  /** @param {Live.DroneStatus|null} status @returns {"flying"|"ended"|"podium"|"waiting"} */
  #phase(status) {
    const { running, stage } = this.#contest;
    if (isFlying(status)) return "flying";
    const isContest = Boolean(stage?.called || stage?.queue?.teams.length || stage?.ranking?.rows.length);
    const isNews = this.#endedAt !== null && performance.now() - this.#endedAt < RESULT_MS;
    if (this.#endedAt !== null && (isNews || !isContest)) return "ended";
    return stage?.complete && running.length === 0 ? "podium" : "waiting";
  }

  /**
   * The try to compare with: the best at the scenario, as it was before this one.
   * @param {Flown|null} flown
   */
  #best(flown) {
    const { stage } = /** @type {{stage: Stage|null}} */ (this.#contest);
    if (!stage || !flown) return this.#against;
    const isOver = stage.last?.id === flown.id;
    const found = isOver ? stage.last_against : stage.best.find((each) => each.scenario === flown.scenario);
    this.#against = found ?? (isOver ? null : this.#against);
    return this.#against;
  }
}

/**
 * A team's rank in the present round, with its rows' total; null if it has none.
 * @param {Stage|null} stage @param {string|undefined} team its name
 */
function rankOf(stage, team) {
  const row = team ? stage?.ranking?.rows.find((each) => each.name === team) : null;
  return row && row.flown > 0 ? row.rank : null;
}

const root = pageRoot("stage");
root.classList.add("s-stage", "m-live");
new StagePage(root);
