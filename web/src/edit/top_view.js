/** A flight's track from above, with the scenario's frames and base. */

const SVG = "http://www.w3.org/2000/svg";
const HALF_M = 5.6;
const COLOURS = { red: "#d22", green: "#1a9a3a", blue: "#26d" };

/** @param {string} tag @param {Object<string, string|number>} attributes @returns {any} */
function svg(tag, attributes) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  return element;
}

export class TopView {
  #solids;
  #track;
  #drone;
  /** @type {number[][]} */
  #points = [];

  /** @param {HTMLElement} parent */
  constructor(parent) {
    const picture = svg("svg", { viewBox: `${-HALF_M} ${-HALF_M} ${2 * HALF_M} ${2 * HALF_M}`, role: "img", "aria-label": "track from above" });
    // Arena axes: x to the right, y up.
    const world = svg("g", { transform: "scale(1,-1)" });
    this.#solids = svg("g", {});
    this.#track = svg("polyline", { class: "e-track" });
    this.#drone = svg("circle", { r: 0.14, class: "e-drone", visibility: "hidden" });
    world.append(svg("rect", { x: -5, y: -5, width: 10, height: 10, class: "e-arena" }), this.#solids, this.#track, this.#drone);
    picture.append(world);
    parent.append(picture);
  }

  clear() {
    this.#points = [];
    this.#solids.replaceChildren();
    this.#drawTrack();
    this.#drone.setAttribute("visibility", "hidden");
  }

  /** Go on with a flight. @param {boolean} isAll @param {number[][]} trail @param {number[]} pose */
  add(isAll, trail, pose) {
    if (isAll) this.#points = [];
    this.#points.push(...trail.map(([, x, y]) => [x, y]));
    this.#drawTrack();
    this.#drone.setAttribute("visibility", "visible");
    this.#drone.setAttribute("cx", pose[0] ?? 0);
    this.#drone.setAttribute("cy", pose[1] ?? 0);
  }

  /** Show a flight that is over. @param {any} layout the scenario @param {{x: number[], y: number[]}} track */
  show(layout, track) {
    this.clear();
    this.#points = track.x.map((x, index) => [x, track.y[index]]);
    this.#drawTrack();
    const base = layout?.base ?? {};
    const edge = base.edge_m ?? 0.5;
    this.#solids.append(svg("rect", { x: (base.x_m ?? 0) - edge / 2, y: (base.y_m ?? 0) - edge / 2, width: edge, height: edge, class: "e-base" }));
    for (const { x_m, y_m, yaw_rad = 0, colour } of layout?.frames ?? []) {
      const [dx, dy] = [-Math.sin(yaw_rad) * 0.5, Math.cos(yaw_rad) * 0.5];
      this.#solids.append(svg("line", { x1: x_m - dx, y1: y_m - dy, x2: x_m + dx, y2: y_m + dy, stroke: COLOURS[colour], "stroke-width": 0.14 }));
    }
  }

  #drawTrack() {
    this.#track.setAttribute("points", this.#points.filter(([x, y]) => x !== null && y !== null).map(([x, y]) => `${x},${y}`).join(" "));
  }
}
