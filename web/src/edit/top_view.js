/** A flight's track from above, with what is in the arena and the goals of a lesson, and the drone's height beside it. */
import { allFrames, prismsOf } from "../lib/arena/obstacles.js";
import { make, number } from "../lib/dom.js";
import { svg } from "../lib/diagram/shapes.js";
import { thingName } from "./verdict.js";
import { word } from "./words.js";

const MAP_PX = 190;
const [LEFT_PX, TOP_PX, BOTTOM_PX, SCALE_PX] = [30, 8, 32, 58]; // the last: width of the scale of heights
const MAX_LINES = 20; // of the grid, in each direction
const ARENA = { length_x_m: 10, width_y_m: 10, height_m: 4 }; // until the scenario is known
const ARROW = "M 9 0 L -6 6 L -3 0 L -6 -6 Z"; // the drone, its heading to the right
const DISC = "M 5 0 A 5 5 0 1 1 5 -0.01 Z"; // if that is not known

/** @typedef {{name: string, time_s: number}} Contact since the start of the flight */

export class TopView {
  #picture = svg("svg", { role: "img", "aria-label": word("top_view") });
  #legend = make("ul", { class: "t-legend" });
  #track = svg("polyline", { class: "t-track" });
  #hits = svg("g");
  #drone = svg("g", { class: "t-drone", visibility: "hidden" });
  #shape = svg("path");
  #words = svg("text", { class: "t-height" });
  #mark = svg("path", { class: "t-mark" });
  /** @type {number[][]} time, x, y and z */
  #points = [];
  /** @type {Contact[]} */
  #contacts = [];
  #arena = ARENA;
  #scenario = null;

  /** @param {HTMLElement} parent */
  constructor(parent) {
    this.#drone.append(this.#shape, this.#words, this.#mark);
    parent.append(this.#picture, this.#legend);
    this.setWorld(null);
  }

  /** Where the drone was: x, y and z of each place. */
  get places() {
    return this.#points.map(([, x, y, z]) => [x, y, z]);
  }

  /** Show an arena, and no flight. @param {any} scenario null: not known yet */
  setWorld(scenario) {
    this.#arena = scenario?.arena ?? ARENA;
    this.#points = [];
    this.#contacts = [];
    const { length_x_m, width_y_m } = this.#arena;
    const [width, height] = [length_x_m * this.#scale, width_y_m * this.#scale];
    this.#picture.setAttribute("viewBox", `0 0 ${LEFT_PX + width + SCALE_PX} ${TOP_PX + height + BOTTOM_PX}`);
    this.#picture.replaceChildren(...this.#ground(), ...this.#heights(), ...(scenario ? this.#contents(scenario) : []),
      this.#track, this.#hits, this.#drone);
    this.#drone.setAttribute("visibility", "hidden");
    this.#drawTrack();
    this.#showLegend(scenario);
  }

  /** Go on with a flight. @param {boolean} isAll @param {number[][]} trail time, x, y, z @param {number[]} pose @param {Contact[]} contacts times as the trail's */
  add(isAll, trail, pose, contacts) {
    if (isAll) {
      this.#points = [];
      this.#contacts = [];
    }
    this.#points.push(...trail);
    this.#contacts.push(...contacts);
    this.#drawTrack();
    this.#place(pose[0], pose[1], pose[2], pose[3]);
  }

  /**
   * Show a flight that is over.
   * @param {any} scenario
   * @param {{time_s: number[], x: number[], y: number[], z: number[]}} track
   * @param {Contact[]} contacts
   */
  show(scenario, track, contacts) {
    this.setWorld(scenario);
    this.#points = track.time_s.map((time_s, index) => [time_s, track.x[index], track.y[index], track.z[index]]);
    this.#contacts = contacts;
    this.#drawTrack();
    const last = this.#points.at(-1);
    if (last) this.#place(last[1], last[2], last[3], null);
  }

  get #scale() {
    return MAP_PX / Math.max(this.#arena.length_x_m, this.#arena.width_y_m);
  }

  /** @param {number} x_m */
  #x(x_m) {
    return LEFT_PX + (x_m + this.#arena.length_x_m / 2) * this.#scale;
  }

  /** @param {number} y_m */
  #y(y_m) {
    return TOP_PX + (this.#arena.width_y_m / 2 - y_m) * this.#scale;
  }

  /** Where a height is on its scale. @param {number} z_m */
  #z(z_m) {
    const { width_y_m, height_m } = this.#arena;
    return TOP_PX + width_y_m * this.#scale * (1 - Math.min(Math.max(z_m / height_m, 0), 1));
  }

  /** Where the scale of heights is. */
  get #scaleX() {
    return this.#x(this.#arena.length_x_m / 2) + 32;
  }

  /** The floor with its grid, axes and north. */
  #ground() {
    const { length_x_m, width_y_m } = this.#arena;
    const [x0, x1, y0, y1] = [this.#x(-length_x_m / 2), this.#x(length_x_m / 2), this.#y(-width_y_m / 2), this.#y(width_y_m / 2)];
    const step = Math.ceil(Math.max(length_x_m, width_y_m) / MAX_LINES);
    const parts = [svg("rect", { x: x0, y: y1, width: x1 - x0, height: y0 - y1, class: "t-ground" })];
    const label = (at) => number(at, 0);
    for (let at = -Math.floor(length_x_m / 2 / step) * step; at <= length_x_m / 2; at += step) {
      parts.push(svg("path", { d: `M ${this.#x(at)} ${y0} V ${y1}`, class: at === 0 ? "t-axis" : "t-grid" }));
      if ((at / step) % 2 === 0) parts.push(svg("text", { x: this.#x(at), y: y0 + 12, class: "t-number" }, label(at)));
    }
    for (let at = -Math.floor(width_y_m / 2 / step) * step; at <= width_y_m / 2; at += step) {
      parts.push(svg("path", { d: `M ${x0} ${this.#y(at)} H ${x1}`, class: at === 0 ? "t-axis" : "t-grid" }));
      if ((at / step) % 2 === 0) parts.push(svg("text", { x: x0 - 7, y: this.#y(at) + 3, class: "t-number" }, label(at)));
    }
    const [middleX, middleY] = [(x0 + x1) / 2, (y0 + y1) / 2];
    parts.push(
      svg("text", { x: middleX, y: y0 + 26, class: "t-title" }, word("x_axis")),
      svg("text", { x: 9, y: middleY, class: "t-title", transform: `rotate(-90 9 ${middleY})` }, word("y_axis")),
      svg("path", { d: `M ${x1 - 34} ${y1 + 12} h 16 l -5 -4 m 5 4 l -5 4`, class: "t-north" }),
      svg("text", { x: x1 - 9, y: y1 + 16, class: "t-title" }, "N"));
    return parts;
  }

  /** The scale of heights. */
  #heights() {
    const [x, y0, y1] = [this.#scaleX, this.#z(0), this.#z(this.#arena.height_m)];
    const parts = [svg("path", { d: `M ${x} ${y0} V ${y1}`, class: "t-axis" })];
    const step = Math.ceil(this.#arena.height_m / MAX_LINES);
    for (let at = 0; at <= this.#arena.height_m; at += step) {
      parts.push(
        svg("path", { d: `M ${x - 3} ${this.#z(at)} h 6`, class: "t-axis" }),
        svg("text", { x: x - 10, y: this.#z(at) + 3, class: "t-number" }, number(at, 0)));
    }
    parts.push(svg("text", { x: x - 6, y: y0 + 26, class: "t-title" }, word("z_axis")));
    return parts;
  }

  /** Base, obstacles, goals and frames. @param {any} scenario */
  #contents(scenario) {
    const { base } = scenario;
    const edge = base.edge_m * this.#scale;
    const parts = [svg("rect", { x: this.#x(base.x_m) - edge / 2, y: this.#y(base.y_m) - edge / 2, width: edge, height: edge, class: "t-base" })];
    for (const { centre, half, yaw } of prismsOf(scenario)) {
      const corners = [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([u, v]) => [u * half[0], v * half[1]]).map(([u, v]) => [
        this.#x(centre[0] + u * Math.cos(yaw) - v * Math.sin(yaw)), this.#y(centre[1] + u * Math.sin(yaw) + v * Math.cos(yaw))]);
      parts.push(svg("polygon", { points: corners.map((corner) => corner.join(",")).join(" "), class: "t-solid" }));
    }
    const frames = allFrames(scenario);
    parts.push(...(scenario.goals ?? []).flatMap((goal, index, { length }) => this.#goal(goal, length > 1 ? String(index + 1) : "", frames)));
    for (const { colour, x_m, y_m, z_m, yaw_rad, outer_width_m, outer_height_m } of frames) {
      const [dx, dy] = [-Math.sin(yaw_rad) * outer_width_m / 2, Math.cos(yaw_rad) * outer_width_m / 2];
      const line = { x1: this.#x(x_m - dx), y1: this.#y(y_m - dy), x2: this.#x(x_m + dx), y2: this.#y(y_m + dy), class: "t-frame", "data-colour": colour };
      const part = svg("line", line);
      part.append(svg("title", {}, thingName(colour)));
      const [top, bottom] = [this.#z(z_m + outer_height_m / 2), this.#z(z_m - outer_height_m / 2)];
      parts.push(part, svg("line", { x1: this.#scaleX + 6, x2: this.#scaleX + 6, y1: top, y2: bottom, class: "t-frame", "data-colour": colour }));
    }
    return parts;
  }

  /** A point to reach, or from where to look at a frame. */
  #goal({ hold_m, face, radius_m, distance_m }, label, frames) {
    if (hold_m) {
      const [x, y] = [this.#x(hold_m[0]), this.#y(hold_m[1])];
      return [
        svg("circle", { cx: x, cy: y, r: Math.max(radius_m * this.#scale, 6), class: "t-goal" }),
        svg("text", { x: x + 11, y: y + 13, class: "t-goal-name" }, [label, `${hold_m[2]} m`].filter(Boolean).join(": ")),
        svg("path", { d: `M ${this.#scaleX + 3} ${this.#z(hold_m[2])} h 9`, class: "t-goal" }),
      ];
    }
    const frame = frames.find(({ colour }) => colour === face);
    if (!frame) return [];
    const [least, most] = distance_m;
    return [svg("circle", {
      cx: this.#x(frame.x_m), cy: this.#y(frame.y_m), r: (least + most) / 2 * this.#scale, "stroke-width": (most - least) * this.#scale, class: "t-goal-ring",
    })];
  }

  /** @param {any} scenario */
  #showLegend(scenario) {
    const goals = scenario?.goals ?? [];
    const rows = [
      ["➤", "t-of-drone", word("drone_legend")], ["―", "t-of-track", word("track_legend")], ["■", "t-of-base", word("base_legend")],
      goals.some(({ hold_m }) => hold_m) ? ["◌", "t-of-goal", word("goal_legend")] : null,
      goals.some(({ face }) => face) ? ["◯", "t-of-goal", word("ring_legend")] : null,
      ...(scenario ? allFrames(scenario) : []).map(({ colour }) => ["▬", `t-of-${colour}`, thingName(colour)]),
      this.#contacts.length > 0 ? ["✕", "t-of-hit", word("hit_legend")] : null,
    ];
    this.#legend.replaceChildren(...rows.flatMap((row) => (row ? [make("li", {}, make("span", { class: row[1], "aria-hidden": "true" }, row[0]), ` ${row[2]}`)] : [])));
    this.#legend.dataset.contacts = String(this.#contacts.length);
    this.#scenario = scenario;
  }

  /** @param {number|null} x_m @param {number|null} y_m @param {number|null} z_m @param {number|null} yaw_rad null: not known */
  #place(x_m, y_m, z_m, yaw_rad) {
    if (typeof x_m !== "number" || typeof y_m !== "number" || typeof z_m !== "number") return;
    const [x, y] = [this.#x(x_m), this.#y(y_m)];
    this.#drone.setAttribute("visibility", "visible");
    this.#shape.setAttribute("d", typeof yaw_rad === "number" ? ARROW : DISC);
    this.#shape.setAttribute("transform", `translate(${x} ${y}) rotate(${(-(yaw_rad ?? 0) * 180) / Math.PI})`);
    const isRight = x_m > this.#arena.length_x_m / 4;
    this.#words.setAttribute("x", x + (isRight ? -11 : 11));
    this.#words.setAttribute("y", y - 7);
    this.#words.setAttribute("text-anchor", isRight ? "end" : "start");
    this.#words.textContent = `${number(z_m, 1)} m`;
    this.#mark.setAttribute("d", `M ${this.#scaleX} ${this.#z(z_m)} l -8 -5 v 10 Z`);
  }

  #drawTrack() {
    const known = this.#points.filter((point) => point.every((each) => typeof each === "number"));
    this.#track.setAttribute("points", known.map(([, x, y]) => `${this.#x(x).toFixed(1)},${this.#y(y).toFixed(1)}`).join(" "));
    this.#hits.replaceChildren(...this.#contacts.flatMap(({ time_s }) => {
      const at = known.findLast(([time]) => time <= time_s);
      return at ? [svg("path", { d: `M ${this.#x(at[1])} ${this.#y(at[2])} m -6 -6 l 12 12 m 0 -12 l -12 12`, class: "t-hit" })] : [];
    }));
    if (this.#legend.dataset.contacts !== String(this.#contacts.length)) this.#showLegend(this.#scenario);
  }
}
