/** What a mission's navigator knows, drawn in the arena: frames as it estimates them, and the path that it plans. */
import { channels, FRAME_COLOURS } from "./colours.js";
import { GAP, Ribbon } from "./ribbon.js";

/**
 * @typedef {object} MappedFrame as in the live channel's message "map"
 * @property {string} colour
 * @property {number[]} p centre, metres, arena axes
 * @property {number} yaw of its normal
 * @property {number[]|null} std standard deviations along x, y, z, metres; null: not known
 * @property {boolean} certain known well enough to fly through
 */

/**
 * @typedef {object} NavigationMap
 * @property {string} goal what the navigator does
 * @property {MappedFrame[]} frames
 * @property {number[][]} path
 */

export const SIGMAS = 2; // how many standard deviations an ellipse reaches
export const PATH_COLOUR = "#b3007d";
const OTHER_COLOUR = "#7a7a7a"; // of a frame that is no part of the task
const OUTER_M = [0.42, 0.22]; // width and height of a frame that the scenario does not have
const AROUND = 1.35; // an outline is drawn so much larger, around the frame where the estimate is right
const NORMAL_M = 0.3; // how far the line along its normal goes, to each side
const DASHES = 3; // of each edge
const [LEAST_M, MOST_M] = [0.005, 4]; // half axes of an ellipsoid
const MOST_POINTS = 4000;

/** The map of a message "map"; null if it is empty, which it is where there is no navigator. */
export function mapIn(message) {
  return message.frames.length > 0 || message.path.length > 0 || message.goal !== "" ? message : null;
}

/** The colour in which a frame is drawn. @param {string} colour */
export function colourOf(colour) {
  return Object.hasOwn(FRAME_COLOURS, colour) ? FRAME_COLOURS[colour] : OTHER_COLOUR;
}

/**
 * Half the width and the height of a frame's outline, metres.
 * @param {MappedFrame} frame
 * @param {object|null} scenario
 */
export function halfSizeOf(frame, scenario) {
  const known = scenario?.frames.find((each) => each.colour === frame.colour);
  const [width, height] = known ? [known.outer_width_m, known.outer_height_m] : OUTER_M;
  return [(AROUND * width) / 2, (height + (AROUND - 1) * width) / 2];
}

/** Half axes of the ellipsoid of a frame's place along x, y, z, metres; null if not known. */
export function halfAxesOf({ std }) {
  return std ? std.map((sigma) => Math.min(MOST_M, Math.max(LEAST_M, SIGMAS * sigma))) : null;
}

/** The map in three dimensions. */
export class MapModel {
  #THREE;
  #outlines;
  #path;
  #ball;
  #balls = [];

  /** @param {object} THREE @param {object} scene */
  constructor(THREE, scene) {
    this.#THREE = THREE;
    this.#outlines = new Ribbon(THREE, MOST_POINTS, { rim: 0.5 });
    this.#path = new Ribbon(THREE, MOST_POINTS, { rim: 0.6 });
    this.#ball = new THREE.SphereGeometry(1, 24, 16);
    this.group = new THREE.Group();
    this.group.add(this.#outlines.mesh, this.#path.mesh);
    scene.add(this.group);
  }

  /**
   * Draw a map in place of the last one.
   * @param {NavigationMap|null} map
   * @param {object|null} scenario
   */
  set(map, scenario) {
    this.#outlines.clear();
    this.#path.clear();
    for (const ball of this.#balls.splice(0)) {
      ball.material.dispose();
      ball.removeFromParent();
    }
    for (const frame of map?.frames ?? []) this.#addFrame(frame, scenario);
    for (const point of map?.path ?? []) this.#path.add(point, rgbOf(PATH_COLOUR));
  }

  /** Set the lines' width for a picture of some size. @param {number[]} picture width and height, pixels */
  fit(picture) {
    this.#outlines.fit(3, picture);
    this.#path.fit(2.5, picture);
  }

  #addFrame(frame, scenario) {
    const [wide, high] = halfSizeOf(frame, scenario);
    const [c, s] = [Math.cos(frame.yaw), Math.sin(frame.yaw)];
    const [x, y, z] = frame.p;
    const at = (ahead, left, up) => [x + c * ahead - s * left, y + s * ahead + c * left, z + up];
    const corners = [[-wide, -high], [wide, -high], [wide, high], [-wide, high]].map(([left, up]) => at(0, left, up));
    const rgb = rgbOf(colourOf(frame.colour));
    corners.forEach((corner, index) => this.#addLine(corner, corners[(index + 1) % 4], rgb, frame.certain ? 1 : DASHES));
    this.#addLine(at(-NORMAL_M, 0, 0), at(NORMAL_M, 0, 0), rgb, 1);
    const axes = halfAxesOf(frame);
    if (axes) this.#addBall(frame, axes);
  }

  /** A line in some dashes; one is the whole line. */
  #addLine(from, to, rgb, dashes) {
    const parts = 2 * dashes - 1;
    for (let index = 0; index <= parts; index += 1) {
      const place = from.map((value, axis) => value + (index / parts) * (to[axis] - value));
      this.#outlines.add(place, index % 2 === 0 ? GAP : rgb);
    }
  }

  #addBall(frame, axes) {
    const paint = { color: colourOf(frame.colour), transparent: true, opacity: 0.3, depthWrite: false };
    const ball = new this.#THREE.Mesh(this.#ball, new this.#THREE.MeshBasicMaterial(paint));
    ball.position.set(...frame.p);
    ball.scale.set(...axes);
    this.#balls.push(ball);
    this.group.add(ball);
  }
}

/**
 * Draw a map from above.
 * @param {CanvasRenderingContext2D} pen its units are metres, x to the right and y up
 * @param {NavigationMap} map
 * @param {object|null} scenario
 * @param {number} pixel_m the size of a pixel
 */
export function drawMap(pen, map, scenario, pixel_m) {
  pen.save();
  for (const frame of map.frames) {
    const [wide] = halfSizeOf(frame, scenario);
    const axes = halfAxesOf(frame);
    pen.strokeStyle = pen.fillStyle = colourOf(frame.colour);
    pen.lineWidth = 2 * pixel_m;
    pen.save();
    pen.translate(frame.p[0], frame.p[1]);
    if (axes) {
      pen.globalAlpha = 0.25;
      pen.beginPath();
      pen.ellipse(0, 0, axes[0], axes[1], 0, 0, 2 * Math.PI);
      pen.fill();
      pen.globalAlpha = 1;
    }
    pen.rotate(frame.yaw);
    pen.setLineDash(frame.certain ? [] : [4 * pixel_m, 3 * pixel_m]);
    pen.strokeRect(-0.1, -wide, 0.2, 2 * wide);
    pen.setLineDash([]);
    pen.beginPath();
    pen.moveTo(-NORMAL_M, 0);
    pen.lineTo(NORMAL_M, 0);
    pen.stroke();
    pen.restore();
  }
  pen.strokeStyle = PATH_COLOUR;
  pen.lineWidth = 1.5 * pixel_m;
  pen.beginPath();
  for (const [x, y] of map.path) pen.lineTo(x, y);
  pen.stroke();
  pen.restore();
}

function rgbOf(colour) {
  return channels(colour).map((channel) => channel / 255);
}
