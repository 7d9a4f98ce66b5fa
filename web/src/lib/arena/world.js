/** What stands still in the arena, made once for each scenario: floor, base, gates, obstacles, shadows, the outline. */
import * as THREE from "three";
import { channels, GATE_COLOURS } from "../colours.js";
import { allGates, PRISM, prismsOf } from "./obstacles.js";
import { Ribbon } from "./ribbon.js";

/**
 * @typedef {import("./obstacles.js").Scenario} Scenario
 * @typedef {import("./obstacles.js").Frame} Frame
 * @typedef {import("./obstacles.js").Solid} Solid
 * @typedef {Solid & {colour: number[], isPure?: boolean}} Painted a pure colour is hardly shaded
 */

// Colours as the simulated camera paints them, so that the onboard view looks like its image.
export const SKY = "#d0dae4";
export const GROUND = "#868684";
const TATAMI = [226, 176, 56];
const MAT = [213, 164, 48];
const BASE = [172, 170, 168];
const BASE_MARK = [238, 238, 238];
const MAT_M = 2;
const DARKEST = 0.3; // no face is painted darker than this share of its colour
const PURE_SHADE = 0.35; // a gate keeps its colour, with just enough shade to have edges
const SHADOW = 0.4; // how much of the light is missing there
const GROUND_M = 120;
const SEEN_THROUGH = 0.45; // opacity of poles and walls, except in the onboard view: nothing may be lost behind them

/**
 * Make the world.
 * @param {Scenario} scenario
 * @param {number} lift_m how much higher the frames, the ceiling and the tops of obstacles are
 */
export function buildWorld(scenario, lift_m) {
  const group = new THREE.Group();
  const { arena, base, light } = scenario;
  const [floor, shadows] = [new Painter(light), new Painter(light)];
  const [half_x, half_y] = [arena.length_x_m / 2, arena.width_y_m / 2];
  floor.rectangle(-half_x, half_x, -half_y, half_y, TATAMI);
  paintMats(floor, arena);
  const solids = new Painter(light);
  const boxes = [baseBox(base), ...allGates(scenario).flatMap((gate) => gateBars(gate, lift_m))];
  for (const box of boxes) {
    solids.box(box);
    shadows.shadow(box);
  }
  const prisms = new Painter(light);
  for (const prism of prismsOf(scenario, lift_m)) {
    prisms.box({ ...prism, colour: PRISM });
    shadows.shadow(prism);
  }
  const mark = 0.35 * base.edge_m;
  solids.rectangle(base.x_m - mark, base.x_m + mark, base.y_m - mark, base.y_m + mark, BASE_MARK, base.top_m + 0.002);
  // The floor is painted first and in order, without depth: nothing lies below it, so nothing can flicker on it.
  const flat = { depthTest: false, depthWrite: false };
  const ground = new THREE.Mesh(new THREE.PlaneGeometry(2 * GROUND_M, 2 * GROUND_M), new THREE.MeshBasicMaterial({ color: GROUND, ...flat }));
  ground.renderOrder = -3;
  group.userData.ground = ground.material.color;
  const tatami = floor.mesh(flat);
  tatami.renderOrder = -2;
  const shade = shadows.mesh({ transparent: true, opacity: SHADOW, depthWrite: false });
  group.add(ground, tatami, shade, solids.mesh({ side: THREE.DoubleSide }));
  const massive = prisms.mesh({ side: THREE.DoubleSide });
  massive.userData.isOnboard = true;
  const glassy = prisms.mesh({ side: THREE.DoubleSide, transparent: true, opacity: SEEN_THROUGH, depthWrite: false });
  glassy.userData.isHelp = true;
  group.add(massive, glassy);
  group.add(outline(half_x, half_y, arena.height_m + lift_m));
  for (const gate of allGates(scenario)) group.add(gateLines(gate, lift_m));
  return group;
}

/**
 * The camera's view as four lines from its place and a pale window at some distance, in body axes.
 * @param {Scenario["camera"]} camera
 */
export function buildCone(camera) {
  const reach_m = 0.9;
  const right = reach_m * Math.tan(camera.horizontal_fov_rad / 2);
  const up = (right * camera.height_px) / camera.width_px;
  const corners = [[-right, up], [right, up], [right, -up], [-right, -up]].map(([y, z]) => new THREE.Vector3(reach_m, y, z));
  const eye = new THREE.Vector3();
  const points = corners.flatMap((corner, index) => [eye, corner, corner, corners[(index + 1) % 4]]);
  const lines = new THREE.LineSegments(
    new THREE.BufferGeometry().setFromPoints(points),
    new THREE.LineBasicMaterial({ color: "#1c2733", transparent: true, opacity: 0.6 }),
  );
  const faces = [0, 1, 2, 3].flatMap((index) => [eye, corners[index], corners[(index + 1) % 4]]);
  const pale = { color: "#ffffff", transparent: true, opacity: 0.13, side: THREE.DoubleSide, depthWrite: false };
  const cone = new THREE.Group();
  cone.add(lines, new THREE.Mesh(new THREE.BufferGeometry().setFromPoints(faces), new THREE.MeshBasicMaterial(pale)));
  cone.position.fromArray(camera.position_flu_m);
  return cone;
}

/** Free what a group holds on the graphics card. @param {THREE.Object3D} group */
export function discard(group) {
  group.traverse((/** @type {any} */ part) => {
    part.geometry?.dispose();
    part.material?.dispose();
  });
  group.removeFromParent();
}

/** @param {Painter} floor @param {Scenario["arena"]} arena */
function paintMats(floor, arena) {
  const rows = Math.min(20, Math.max(1, Math.round(arena.length_x_m / MAT_M)));
  const columns = Math.min(20, Math.max(1, Math.round(arena.width_y_m / MAT_M)));
  const [x, y] = [
    (/** @type {number} */ i) => (i / rows - 0.5) * arena.length_x_m,
    (/** @type {number} */ j) => (j / columns - 0.5) * arena.width_y_m,
  ];
  for (let i = 0; i < rows; i += 1) {
    for (let j = (i + 1) % 2; j < columns; j += 2) floor.rectangle(x(i), x(i + 1), y(j), y(j + 1), MAT);
  }
}

/** @param {Scenario["base"]} base */
function baseBox({ x_m, y_m, edge_m, top_m }) {
  return { centre: [x_m, y_m, top_m / 2], half: [edge_m / 2, edge_m / 2, top_m / 2], yaw: 0, colour: BASE };
}

/**
 * The four bars: top and bottom over the whole width, left and right between them.
 * @param {Frame} gate
 * @param {number} lift_m
 */
function gateBars(gate, lift_m) {
  const bar = gate.bar_m / 2;
  const [wide, high, deep] = [gate.outer_width_m / 2, gate.outer_height_m / 2, (gate.depth_m ?? gate.bar_m) / 2];
  const colour = channels(GATE_COLOURS[gate.colour]);
  const [c, s] = [Math.cos(gate.yaw_rad), Math.sin(gate.yaw_rad)];
  const parts = [
    [0, high - bar, wide, bar], [0, bar - high, wide, bar],
    [wide - bar, 0, bar, high - 2 * bar], [bar - wide, 0, bar, high - 2 * bar],
  ];
  return parts.map(([y, z, half_y, half_z]) => ({
    centre: [gate.x_m - s * y, gate.y_m + c * y, gate.z_m + lift_m + z],
    half: [deep, half_y, half_z], yaw: gate.yaw_rad, colour, isPure: true,
  }));
}

/**
 * A gate's outline, which stays wide enough to be seen from far away, and a thread to the floor below it.
 * @param {Frame} gate
 * @param {number} lift_m
 */
function gateLines(gate, lift_m) {
  const [c, s] = [Math.cos(gate.yaw_rad), Math.sin(gate.yaw_rad)];
  const z = gate.z_m + lift_m;
  /** @param {number} y @param {number} up @returns {[number, number, number]} */
  const at = (y, up) => [gate.x_m - s * y, gate.y_m + c * y, z + up];
  const [wide, high] = [(gate.outer_width_m - gate.bar_m) / 2, (gate.outer_height_m - gate.bar_m) / 2];
  const ring = new Ribbon(5, { rim: 0 });
  const rgb = channels(GATE_COLOURS[gate.colour]).map((channel) => channel / 255);
  for (const [y, up] of [[-wide, -high], [wide, -high], [wide, high], [-wide, high], [-wide, -high]]) ring.add(at(y, up), rgb);
  ring.mesh.userData.ribbon = ring;
  const thread = [new THREE.Vector3(gate.x_m, gate.y_m, 0.01), new THREE.Vector3(...at(0, -high))];
  const faint = new THREE.LineBasicMaterial({ color: "#4a4a46", transparent: true, opacity: 0.55 });
  const line = new THREE.Line(new THREE.BufferGeometry().setFromPoints(thread), faint);
  const group = new THREE.Group();
  for (const part of [ring.mesh, line]) {
    part.userData.isHelp = true;
    group.add(part);
  }
  return group;
}

/** @param {number} x @param {number} y @param {number} height */
function outline(x, y, height) {
  const plan = [[x, y], [-x, y], [-x, -y], [x, -y]];
  /** @type {THREE.Vector3[]} */
  const points = [];
  plan.forEach(([x0, y0], index) => {
    const [x1, y1] = plan[(index + 1) % 4];
    for (const z of [0.01, height]) points.push(new THREE.Vector3(x0, y0, z), new THREE.Vector3(x1, y1, z));
    points.push(new THREE.Vector3(x0, y0, 0), new THREE.Vector3(x0, y0, height));
  });
  const faint = new THREE.LineBasicMaterial({ color: "#8a9099", transparent: true, opacity: 0.6 });
  const lines = new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(points), faint);
  lines.userData.isHelp = true;
  return lines;
}

/** Collects flat polygons with one colour each, shaded by Lambert's law, and makes one mesh of them. */
class Painter {
  /** @type {number[]} */
  #places = [];
  /** @type {number[]} */
  #colours = [];
  #sun;
  #ambient;

  /** @param {Scenario["light"]} light */
  constructor(light) {
    const length = Math.hypot(...light.sun_direction_arena);
    this.#sun = light.sun_direction_arena.map((part) => part / length);
    this.#ambient = light.ambient;
  }

  /**
   * A convex polygon, its corners in order; a pure colour is hardly shaded.
   * @param {number[][]} corners @param {number[]} normal @param {number[]} rgb @param {boolean} [isPure]
   */
  polygon(corners, normal, rgb, isPure = false) {
    const facing = -(normal[0] * this.#sun[0] + normal[1] * this.#sun[1] + normal[2] * this.#sun[2]);
    const lit = Math.max(DARKEST, this.#ambient + (1 - this.#ambient) * Math.max(0, facing));
    const share = isPure ? 1 - PURE_SHADE * (1 - lit) : lit;
    const [r, g, b] = rgb.map((channel) => (channel * share) / 255);
    const colour = new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace);
    for (let index = 1; index + 1 < corners.length; index += 1) {
      for (const corner of [corners[0], corners[index], corners[index + 1]]) {
        this.#places.push(...corner);
        this.#colours.push(colour.r, colour.g, colour.b);
      }
    }
  }

  /**
   * A level rectangle that is seen from above.
   * @param {number} x0 @param {number} x1 @param {number} y0 @param {number} y1
   * @param {number[]} rgb @param {number} [z]
   */
  rectangle(x0, x1, y0, y1, rgb, z = 0) {
    this.polygon([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]], [0, 0, 1], rgb);
  }

  /** @param {Painted} box */
  box(box) {
    for (const axis of [0, 1, 2]) {
      for (const sign of [1, -1]) {
        const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map((pair) => {
          const signs = [...pair];
          signs.splice(axis, 0, sign);
          return placed(box, signs);
        });
        const normal = [0, 0, 0];
        normal[axis] = sign;
        const [c, s] = [Math.cos(box.yaw), Math.sin(box.yaw)];
        this.polygon(corners, [c * normal[0] - s * normal[1], s * normal[0] + c * normal[1], normal[2]], box.colour, box.isPure);
      }
    }
  }

  /** What a box keeps from the sun, on the floor. @param {Solid} box */
  shadow(box) {
    const sun = this.#sun;
    if (sun[2] >= -1e-3) return;
    /** @type {number[][]} */
    const cast = [];
    for (const a of [-1, 1]) {
      for (const b of [-1, 1]) {
        for (const c of [-1, 1]) {
          const [x, y, z] = placed(box, [a, b, c]);
          cast.push([x - (z / sun[2]) * sun[0], y - (z / sun[2]) * sun[1], 0.003]);
        }
      }
    }
    this.polygon(hull(cast), [0, 0, 1], [0, 0, 0]);
  }

  /** @param {THREE.MeshBasicMaterialParameters} settings */
  mesh(settings) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(this.#places, 3));
    geometry.setAttribute("color", new THREE.Float32BufferAttribute(this.#colours, 3));
    return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ vertexColors: true, ...settings }));
  }
}

/** A corner of a box. @param {Solid} box @param {number[]} signs which, by axis: -1 or 1 */
function placed({ centre, half, yaw }, signs) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  const [x, y, z] = signs.map((sign, axis) => sign * half[axis]);
  return [centre[0] + c * x - s * y, centre[1] + s * x + c * y, centre[2] + z];
}

/** Convex hull in the plane (Andrew's monotone chain), counter-clockwise. @param {number[][]} points */
function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  /** @param {number[]} o @param {number[]} a @param {number[]} b */
  const isRight = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]) <= 0;
  /** @param {number[][]} list */
  const half = (list) => {
    /** @type {number[][]} */
    const chain = [];
    for (const point of list) {
      while (chain.length > 1 && isRight(
        /** @type {number[]} */ (chain.at(-2)), /** @type {number[]} */ (chain.at(-1)), point,
      )) chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}
