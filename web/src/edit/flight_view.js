/** A flight of the mission from above, with the goals of a lesson, and a legend. */
import { allGates } from "../lib/arena/obstacles.js";
import { TopView } from "../lib/arena/top_view.js";
import { make } from "../lib/dom.js";
import { thingName } from "./verdict.js";
import { word } from "./words.js";

/** @typedef {{name: string, time_s: number}} Contact since the start of the flight */

const DRONE = 1; // there is one only

export class FlightView {
  #view;
  #legend = make("ul", { class: "t-legend" });
  /** @type {(number|null)[][]} time, x, y and z */
  #points = [];
  /** @type {Contact[]} */
  #contacts = [];
  /** @type {any} */
  #scenario = null;

  /** @param {HTMLElement} parent */
  constructor(parent) {
    this.#view = new TopView(parent, { label: word("top_view"), x: word("x_axis"), y: word("y_axis"), z: word("z_axis") }, thingName);
    parent.append(this.#legend);
    this.setWorld(null);
  }

  /** Where the drone was: x, y and z of each place. */
  get places() {
    return this.#known.map(([, ...place]) => place);
  }

  /** Show an arena, and no flight. @param {any} scenario null: not known yet */
  setWorld(scenario) {
    this.#scenario = scenario;
    this.#view.setWorld(scenario);
    this.#take([], []);
  }

  /** Go on with a flight. @param {boolean} isAll @param {(number|null)[][]} trail time, x, y, z @param {(number|null)[]} pose @param {Contact[]} contacts times as the trail's */
  add(isAll, trail, pose, contacts) {
    this.#take([...(isAll ? [] : this.#points), ...trail], [...(isAll ? [] : this.#contacts), ...contacts]);
    this.#view.setDrone(DRONE, pose, pose[3]);
  }

  /** Show a flight that is over. @param {any} scenario @param {import("../lib/messages.js").Flights.FlownTrack} track @param {Contact[]} contacts */
  show(scenario, track, contacts) {
    this.setWorld(scenario);
    this.#take(track.time_s.map((time_s, index) => [time_s, track.x[index], track.y[index], track.z[index]]), contacts);
    const last = this.#points.at(-1);
    if (last) this.#view.setDrone(DRONE, last.slice(1), null);
  }

  /** The points of which all is known. */
  get #known() {
    return /** @type {number[][]} */ (this.#points.filter((point) => point.every((each) => typeof each === "number")));
  }

  /** @param {(number|null)[][]} points @param {Contact[]} contacts */
  #take(points, contacts) {
    this.#points = points;
    this.#contacts = contacts;
    const known = this.#known;
    this.#view.setTracks([{ places: known.map(([, x, y]) => [x, y]), colour: null }]);
    this.#view.setHits(contacts.flatMap(({ time_s }) => {
      const at = known.findLast(([time]) => time <= time_s);
      return at ? [at.slice(1)] : [];
    }));
    this.#showLegend();
  }

  #showLegend() {
    const goals = this.#scenario?.goals ?? [];
    const rows = [
      ["➤", "t-of-drone", word("drone_legend")], ["―", "t-of-track", word("track_legend")], ["■", "t-of-base", word("base_legend")],
      goals.some((/** @type {any} */ { hold_m }) => hold_m) ? ["◌", "t-of-goal", word("goal_legend")] : null,
      goals.some((/** @type {any} */ { face }) => face) ? ["◯", "t-of-goal", word("ring_legend")] : null,
      ...(this.#scenario ? allGates(this.#scenario) : []).map(({ colour }) => ["▬", `t-of-${colour}`, thingName(colour)]),
      this.#contacts.length > 0 ? ["✕", "t-of-hit", word("hit_legend")] : null,
    ];
    const shown = JSON.stringify(rows);
    if (this.#legend.dataset.shown === shown) return;
    this.#legend.dataset.shown = shown;
    this.#legend.replaceChildren(...rows.flatMap((row) => (row ? [make("li", {}, make("span", { class: row[1], "aria-hidden": "true" }, row[0]), ` ${row[2]}`)] : [])));
  }
}
