/** One flight on the replay's page: all that the live page shows of it, at any time. */
import { Arena } from "../lib/arena/arena.js";
import { CameraView } from "../lib/flight/camera.js";
import { make, number, setAttribute, setText } from "../lib/dom.js";
import { Figures } from "../lib/flight/figures.js";
import { Plots } from "../lib/flight/plots.js";
import { Images } from "./images.js";
import { addressOf } from "../lib/replay/run.js";
import { Statechart } from "../lib/chart/statechart.js";

let count = 0;

export class Side {
  #run;
  #arena;
  #camera;
  #images;
  #figures;
  #plots;
  #statechart;
  #place;
  #drawn = 0; // poses that are in the trail
  /** @type {number|null} */
  #last = null;
  #told = -1;

  /**
   * @param {HTMLElement} element where it goes
   * @param {import("../lib/replay/run.js").Run} run
   * @param {string} letter "A" or "B"; "" if there is only one
   */
  constructor(element, run, letter) {
    this.#run = run;
    count += 1;
    const id = `r-run-${count}`;
    const title = make("h2", { id }, letter ? make("span", { class: "r-letter" }, letter) : null, run.name);
    this.#place = make("p", { class: "r-place" });
    const grid = make("div", { class: "r-panels" });
    this.root = make("section", { class: "r-side", "aria-labelledby": id }, make("div", { class: "r-head" }, title, this.#result()), grid);
    element.append(this.root);
    /** @param {string} name @param {string} words */
    const panel = (name, words) => {
      const body = make("div", { class: "m-body" });
      grid.append(make("section", { class: `m-panel r-${name}` }, make("h3", {}, words), body));
      return body;
    };
    const arena = panel("arena", "Arena");
    this.#arena = new Arena(arena);
    arena.append(this.#place);
    this.#camera = new CameraView(panel("camera", "Camera"));
    this.#figures = new Figures(panel("figures", "The try"));
    this.#statechart = new Statechart(panel("chart", "Statechart"), { small: true, live: false });
    this.#plots = new Plots(panel("plots", "Place and speeds"));
    this.#images = new Images(this.#camera, run.name, run.images.length);
    this.#arena.setWorld(run.world);
    this.#statechart.setChart(run.chart);
    for (const pose of run.poses) this.#plots.add(pose.t, pose);
  }

  /** Show a time; a flight that is over stands still. @param {number} now seconds since motors on */
  show(now) {
    const run = this.#run;
    const t = Math.min(now, run.end);
    this.#moveTo(t);
    this.#images.want(run.imageAt(t));
    this.#camera.setDetections(run.detectionsAt(t));
    this.#arena.setMap(run.mapAt(t));
    this.#figures.set(run.figuresAt(t));
    const [state, seconds] = run.stateAt(t);
    this.#statechart.setState(state, seconds);
    const [list, told] = run.transitionsAt(t);
    if (told !== this.#told) this.#statechart.setTransitions(list);
    this.#told = told;
    this.#plots.showUntil(t);
    setAttribute(this.root, "data-state", state ?? "");
    setAttribute(this.root, "data-ended", now > run.end);
  }

  /** @param {number} t seconds since motors on */
  #moveTo(t) {
    const { poses, states } = this.#run;
    const pose = this.#run.poseAt(t);
    if (!pose) return;
    const until = this.#run.posesUntil(t);
    const isJump = this.#last === null || t < this.#last || until - this.#drawn > 40;
    if (isJump) this.#arena.setTrail(poses.slice(0, until), states);
    else for (const each of poses.slice(this.#drawn, until)) this.#arena.setPoses([each], states);
    this.#arena.setPoses([pose], states);
    [this.#drawn, this.#last] = [until, t];
    const [x, y, z] = pose.p;
    setText(this.#place, `x ${number(x, 2)}  y ${number(y, 2)}  z ${number(z, 2)} m`);
  }

  /** The outcome in words, and the way to all its numbers. */
  #result() {
    const { result, name } = this.#run;
    if (!result) return make("p", { class: "r-outcome" }, "not judged: this flight left no result");
    const time = typeof result.total_time_s === "number" ? `, ${number(result.total_time_s)} s` : "";
    const link = make("a", { href: `${addressOf(name)}/result.json` }, "result");
    return make("p", { class: "r-outcome" }, `${result.verdict ?? "no verdict"}${time} · `, link);
  }
}
