/** The arena from above, in SVG: what is in it, drones with their tracks and heights, and what a navigator knows. */
import "./top_view.css";
import { svg } from "../diagram/shapes.js";
import { number } from "../dom.js";
import { colourOf, halfAxesOf, halfSizeOf, NORMAL_M, PATH_COLOUR, PLACE_COLOUR, TRUTH_COLOUR } from "./map.js";
import { allGates, prismsOf } from "./obstacles.js";

const MAP_PX = 190;
const [LEFT_PX, TOP_PX, BOTTOM_PX, SCALE_PX] = [30, 8, 32, 58]; // the last: width of the scale of heights
const MAX_LINES = 20; // of the grid, in each direction
const ARENA = { length_x_m: 10, width_y_m: 10, height_m: 4 }; // until the scenario is known
const ARROW = "M 9 0 L -6 6 L -3 0 L -6 -6 Z"; // a drone, its heading to the right
const DISC = "M 5 0 A 5 5 0 1 1 5 -0.01 Z"; // if that is not known
const ENGLISH = { label: "arena from above", x: "x, forward (m)", y: "y, left (m)", z: "height (m)" };

/**
 * @typedef {import("./obstacles.js").Scenario} Scenario
 * @typedef {[number, number, number]} Place x, y, z
 * @typedef {{group: SVGGElement, shape: SVGPathElement, words: SVGTextElement, mark: SVGPathElement}} Drawn
 */

export class TopView {
  picture;
  #words;
  #things = svg("g");
  #map = svg("g");
  #tracks = svg("g");
  #truth = svg("g");
  #hits = svg("g");
  #drones = svg("g");
  /** @type {Map<number, Drawn>} */
  #drawn = new Map();
  #arena = ARENA;
  #nameOf;

  /**
   * @param {HTMLElement} parent
   * @param {{label: string, x: string, y: string, z: string}} [words] what it is, and the titles of the axes
   * @param {(thing: string) => string} [nameOf] the name of a frame by its colour
   */
  constructor(parent, words = ENGLISH, nameOf = (thing) => thing) {
    this.#words = words;
    this.#nameOf = nameOf;
    this.picture = svg("svg", { role: "img", class: "t-picture", "aria-label": words.label });
    this.picture.append(this.#things, this.#map, this.#tracks, this.#truth, this.#hits, this.#drones);
    parent.append(this.picture);
    this.setWorld(null);
  }

  /**
   * Show an arena, and no drone.
   * @param {Record<string, any>|null} scenario as the messages have it; null: not known yet
   */
  setWorld(scenario) {
    this.#arena = scenario?.arena ?? ARENA;
    const { length_x_m, width_y_m } = this.#arena;
    const [width, height] = [length_x_m * this.#scale, width_y_m * this.#scale];
    this.picture.setAttribute("viewBox", `0 0 ${LEFT_PX + width + SCALE_PX} ${TOP_PX + height + BOTTOM_PX}`);
    this.#things.replaceChildren(
      ...this.#ground(), ...this.#heights(),
      ...(scenario ? this.#contents(/** @type {Scenario} */ (scenario)) : []));
    for (const group of [this.#map, this.#tracks, this.#truth, this.#hits, this.#drones]) group.replaceChildren();
    this.#drawn.clear();
  }

  /**
   * Show where a drone is.
   * @param {number} id @param {(number|null)[]} place x, y, z; null: not known @param {number|null} yaw_rad null: not known
   * @param {string} look "": as it is; "old": not heard of any more; "other": not the one that was chosen
   */
  setDrone(id, [x_m, y_m, z_m], yaw_rad, look = "") {
    if (typeof x_m !== "number" || typeof y_m !== "number" || typeof z_m !== "number") return;
    const { group, shape, words, mark } = this.#droneOf(id);
    const [x, y] = [this.#x(x_m), this.#y(y_m)];
    group.setAttribute("data-look", look);
    shape.setAttribute("d", typeof yaw_rad === "number" ? ARROW : DISC);
    shape.setAttribute("transform", `translate(${x} ${y}) rotate(${(-(yaw_rad ?? 0) * 180) / Math.PI})`);
    const isRight = x_m > this.#arena.length_x_m / 4;
    words.setAttribute("x", String(x + (isRight ? -11 : 11)));
    words.setAttribute("y", String(y - 7));
    words.setAttribute("text-anchor", isRight ? "end" : "start");
    words.textContent = `${number(z_m, 1)} m`;
    mark.setAttribute("d", `M ${this.#scaleX} ${this.#z(z_m)} l -8 -5 v 10 Z`);
  }

  /** Show tracks, each in a colour; null: that of the page. @param {{places: number[][], colour: string|null}[]} tracks */
  setTracks(tracks) {
    this.#tracks.replaceChildren(...tracks.map(({ places, colour }) => {
      const track = svg("polyline", { points: this.#points(places), class: "t-track" });
      if (colour) track.style.stroke = colour;
      return track;
    }));
  }

  /** Show where simulated drones truly were. @param {number[][][]} paths */
  setTruth(paths) {
    this.#truth.replaceChildren(...paths.map((places) => svg("polyline", { points: this.#points(places), class: "t-truth", stroke: TRUTH_COLOUR })));
  }

  /** Mark where something was hit. @param {number[][]} places */
  setHits(places) {
    this.#hits.replaceChildren(...places.map(([x, y]) => svg("path", { d: `M ${this.#x(x)} ${this.#y(y)} m -6 -6 l 12 12 m 0 -12 l -12 12`, class: "t-hit" })));
  }

  /**
   * Show what a navigator knows.
   * @param {import("./map.js").NavigationMap|null} map null: nothing
   * @param {Record<string, any>|null} scenario
   */
  setMap(map, scenario) {
    const frames = (map?.frames ?? []).map(
      (gate) => this.#mappedFrame(gate, /** @type {Scenario|null} */ (scenario)));
    const path = map ? [svg("polyline", { points: this.#points(map.path), class: "t-path", stroke: PATH_COLOUR })] : [];
    const place = map?.place ? [this.#around(map.place, PLACE_COLOUR, { "data-place": "" })] : [];
    this.#map.replaceChildren(...frames, ...place, ...path);
  }

  /** @param {import("./map.js").MappedFrame} gate @param {Scenario|null} scenario */
  #mappedFrame(gate, scenario) {
    const [half] = halfSizeOf(gate, scenario), scale = this.#scale;
    const colour = colourOf(gate.colour);
    const outline = svg("g", { transform: `rotate(${(-gate.yaw * 180) / Math.PI})`, class: "t-mapped" },
      svg("rect", { x: -0.1 * scale, y: -half * scale, width: 0.2 * scale, height: 2 * half * scale, ...(gate.certain ? {} : { "stroke-dasharray": "4 3" }) }),
      svg("path", { d: `M ${-NORMAL_M * scale} 0 H ${NORMAL_M * scale}` }));
    const group = this.#around(gate, colour, { stroke: colour, "data-mapped": gate.colour });
    group.append(outline);
    return group;
  }

  /**
   * The ellipse of a place.
   * @param {{p: number[], std: number[]|null}} place @param {string} colour @param {Record<string, string>} attributes
   */
  #around(place, colour, attributes) {
    const axes = halfAxesOf(place), scale = this.#scale;
    const ellipse = axes ? [svg("ellipse", { rx: axes[0] * scale, ry: axes[1] * scale, fill: colour, "fill-opacity": 0.25 })] : [];
    return svg("g", { transform: `translate(${this.#x(place.p[0])} ${this.#y(place.p[1])})`, ...attributes }, ...ellipse);
  }

  /** @param {number} id @returns {Drawn} */
  #droneOf(id) {
    const known = this.#drawn.get(id);
    if (known) return known;
    const made = { group: svg("g", { class: "t-drone" }), shape: svg("path"), words: svg("text", { class: "t-height" }), mark: svg("path", { class: "t-mark" }) };
    made.group.append(made.shape, made.words, made.mark);
    this.#drones.append(made.group);
    this.#drawn.set(id, made);
    return made;
  }

  /** @param {number[][]} places */
  #points(places) {
    return places.map(([x, y]) => `${this.#x(x).toFixed(1)},${this.#y(y).toFixed(1)}`).join(" ");
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
    /** @type {SVGElement[]} */
    const parts = [svg("rect", { x: x0, y: y1, width: x1 - x0, height: y0 - y1, class: "t-ground" })];
    /** @param {number} at */
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
      svg("text", { x: middleX, y: y0 + 26, class: "t-title" }, this.#words.x),
      svg("text", { x: 9, y: middleY, class: "t-title", transform: `rotate(-90 9 ${middleY})` }, this.#words.y),
      svg("path", { d: `M ${x1 - 34} ${y1 + 12} h 16 l -5 -4 m 5 4 l -5 4`, class: "t-north" }),
      svg("text", { x: x1 - 9, y: y1 + 16, class: "t-title" }, "N"));
    return parts;
  }

  /** The scale of heights. */
  #heights() {
    const [x, y0, y1] = [this.#scaleX, this.#z(0), this.#z(this.#arena.height_m)];
    /** @type {SVGElement[]} */
    const parts = [svg("path", { d: `M ${x} ${y0} V ${y1}`, class: "t-axis" })];
    const step = Math.ceil(this.#arena.height_m / MAX_LINES);
    for (let at = 0; at <= this.#arena.height_m; at += step) {
      parts.push(
        svg("path", { d: `M ${x - 3} ${this.#z(at)} h 6`, class: "t-axis" }),
        svg("text", { x: x - 10, y: this.#z(at) + 3, class: "t-number" }, number(at, 0)));
    }
    parts.push(svg("text", { x: x - 6, y: y0 + 26, class: "t-title" }, this.#words.z));
    return parts;
  }

  /** Base, obstacles, goals and frames. @param {Scenario} scenario */
  #contents(scenario) {
    const { base } = scenario;
    const edge = base.edge_m * this.#scale;
    /** @type {SVGElement[]} */
    const parts = [svg("rect", { x: this.#x(base.x_m) - edge / 2, y: this.#y(base.y_m) - edge / 2, width: edge, height: edge, class: "t-base" })];
    for (const { centre, half, yaw } of prismsOf(scenario)) {
      const corners = [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([u, v]) => [u * half[0], v * half[1]]).map(([u, v]) => [
        this.#x(centre[0] + u * Math.cos(yaw) - v * Math.sin(yaw)), this.#y(centre[1] + u * Math.sin(yaw) + v * Math.cos(yaw))]);
      parts.push(svg("polygon", { points: corners.map((corner) => corner.join(",")).join(" "), class: "t-solid" }));
    }
    const frames = allGates(scenario);
    parts.push(...(scenario.goals ?? []).flatMap((goal, index, { length }) => this.#goal(goal, length > 1 ? String(index + 1) : "", frames)));
    for (const { colour, x_m, y_m, z_m, yaw_rad, outer_width_m, outer_height_m } of frames) {
      const [dx, dy] = [-Math.sin(yaw_rad) * outer_width_m / 2, Math.cos(yaw_rad) * outer_width_m / 2];
      const line = { x1: this.#x(x_m - dx), y1: this.#y(y_m - dy), x2: this.#x(x_m + dx), y2: this.#y(y_m + dy), class: "t-frame", "data-colour": colour };
      const part = svg("line", line);
      part.append(svg("title", {}, this.#nameOf(colour)));
      const [top, bottom] = [this.#z(z_m + outer_height_m / 2), this.#z(z_m - outer_height_m / 2)];
      parts.push(part, svg("line", { x1: this.#scaleX + 6, x2: this.#scaleX + 6, y1: top, y2: bottom, class: "t-frame", "data-colour": colour }));
    }
    return parts;
  }

  /**
   * A point to reach, or from where to look at a gate.
   * @param {import("./obstacles.js").Goal} goal
   * @param {string} label
   * @param {import("./obstacles.js").Frame[]} frames
   */
  #goal({ hold_m, face, radius_m, distance_m }, label, frames) {
    if (hold_m) {
      const [x, y] = [this.#x(hold_m[0]), this.#y(hold_m[1])];
      return [
        svg("circle", { cx: x, cy: y, r: Math.max(radius_m * this.#scale, 6), class: "t-goal" }),
        svg("text", { x: x + 11, y: y + 13, class: "t-goal-name" }, [label, `${hold_m[2]} m`].filter(Boolean).join(": ")),
        svg("path", { d: `M ${this.#scaleX + 3} ${this.#z(hold_m[2])} h 9`, class: "t-goal" }),
      ];
    }
    const gate = frames.find(({ colour }) => colour === face);
    if (!gate) return [];
    const [least, most] = distance_m;
    return [svg("circle", {
      cx: this.#x(gate.x_m), cy: this.#y(gate.y_m), r: (least + most) / 2 * this.#scale, "stroke-width": (most - least) * this.#scale, class: "t-goal-ring",
    })];
  }
}
