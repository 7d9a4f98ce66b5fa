/** The navigator's map in three dimensions. */
import * as THREE from "three";
import { channels } from "../colours.js";
import { colourOf, halfAxesOf, halfSizeOf, NORMAL_M, PATH_COLOUR, PLACE_COLOUR } from "./map.js";
import { GAP, Ribbon } from "./ribbon.js";

/**
 * @typedef {import("./map.js").MappedFrame} MappedFrame
 * @typedef {import("./map.js").NavigationMap} NavigationMap
 * @typedef {import("./obstacles.js").Scenario} Scenario
 */

const DASHES = 3; // of each edge of a gate that is not certain
const MOST_POINTS = 4000;

/** Draws one map at a time. */
export class MapModel {
  #outlines;
  #path;
  #ball;
  /** @type {THREE.Mesh<THREE.SphereGeometry, THREE.MeshBasicMaterial>[]} */
  #balls = [];

  /** @param {THREE.Scene} scene */
  constructor(scene) {
    this.#outlines = new Ribbon(MOST_POINTS, { rim: 0.5 });
    this.#path = new Ribbon(MOST_POINTS, { rim: 0.6 });
    this.#ball = new THREE.SphereGeometry(1, 24, 16);
    this.group = new THREE.Group();
    this.group.add(this.#outlines.mesh, this.#path.mesh);
    scene.add(this.group);
  }

  /**
   * Draw a map in place of the last one.
   * @param {NavigationMap|null} map
   * @param {Scenario|null} scenario
   */
  set(map, scenario) {
    this.#outlines.clear();
    this.#path.clear();
    for (const ball of this.#balls.splice(0)) {
      ball.material.dispose();
      ball.removeFromParent();
    }
    for (const gate of map?.frames ?? []) this.#addGate(gate, scenario);
    if (map?.place) this.#addBall(map.place, PLACE_COLOUR, 0.6);
    for (const point of map?.path ?? []) this.#path.add(point, rgbOf(PATH_COLOUR));
  }

  /** Set the lines' width for a picture of some size. @param {number[]} picture width and height, pixels */
  fit(picture) {
    this.#outlines.fit(3, picture);
    this.#path.fit(2.5, picture);
  }

  /** @param {MappedFrame} gate @param {Scenario|null} scenario */
  #addGate(gate, scenario) {
    const [wide, high] = halfSizeOf(gate, scenario);
    const [c, s] = [Math.cos(gate.yaw), Math.sin(gate.yaw)];
    const [x, y, z] = gate.p;
    /** @param {number} ahead @param {number} left @param {number} up */
    const at = (ahead, left, up) => [x + c * ahead - s * left, y + s * ahead + c * left, z + up];
    const corners = [[-wide, -high], [wide, -high], [wide, high], [-wide, high]].map(([left, up]) => at(0, left, up));
    const rgb = rgbOf(colourOf(gate.colour));
    corners.forEach((corner, index) => this.#addLine(corner, corners[(index + 1) % 4], rgb, gate.certain ? 1 : DASHES));
    this.#addLine(at(-NORMAL_M, 0, 0), at(NORMAL_M, 0, 0), rgb, 1);
    this.#addBall(gate, colourOf(gate.colour));
  }

  /**
   * A line in some dashes; one is the whole line.
   * @param {number[]} from @param {number[]} to @param {number[]} rgb @param {number} dashes
   */
  #addLine(from, to, rgb, dashes) {
    const parts = 2 * dashes - 1;
    for (let index = 0; index <= parts; index += 1) {
      const place = from.map((value, axis) => value + (index / parts) * (to[axis] - value));
      this.#outlines.add(place, index % 2 === 0 ? GAP : rgb);
    }
  }

  /** @param {{p: number[], std: number[]|null}} place @param {string} colour @param {number} [opacity] */
  #addBall(place, colour, opacity = 0.3) {
    const axes = halfAxesOf(place);
    if (!axes) return;
    const paint = { color: colour, transparent: true, opacity, depthWrite: false };
    const ball = new THREE.Mesh(this.#ball, new THREE.MeshBasicMaterial(paint));
    ball.position.fromArray(place.p);
    ball.scale.fromArray(axes);
    this.#balls.push(ball);
    this.group.add(ball);
  }
}

/** @param {string} colour */
function rgbOf(colour) {
  return channels(colour).map((channel) => channel / 255);
}
