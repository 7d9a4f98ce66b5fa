/** The arena from above, on a plain canvas: for browsers that draw no 3-D. */
import { drawMap } from "./map.js";
import { FRAME_COLOURS } from "../colours.js";
import { make } from "../dom.js";
import { allFrames, PRISM, prismsOf } from "./obstacles.js";
import { yawOf } from "../yaw.js";

/** Does what `ArenaScene` does, as far as a plain canvas can. */
export class TopView {
  #box;
  #canvas;
  #scenario = null;
  #map = null;
  #trails = new Map();
  #poses = [];
  #selected = null;
  #asked = false;

  constructor(box, words) {
    this.#box = box;
    this.#canvas = make("canvas", { class: "m-topview", "aria-hidden": "true" });
    box.prepend(this.#canvas);
    box.append(make("p", { class: "m-arena-words" }, words));
    new ResizeObserver(() => this.#ask()).observe(box);
  }

  setWorld(world) {
    this.#scenario = world?.scenario ?? null;
    this.#ask();
  }

  setMap(map) {
    this.#map = map;
    this.#ask();
  }

  setPoses(poses, colourOf) {
    this.#poses = poses;
    for (const pose of poses) this.addTrail(pose.id ?? 1, [pose], colourOf);
    this.#ask();
  }

  addTrail(id, poses, colourOf) {
    for (const pose of poses) if (pose.on) this.#extend(id, pose, colourOf(pose));
    this.#ask();
  }

  clearTrail(id) {
    if (id === undefined) this.#trails.clear();
    else this.#trails.delete(id);
    this.#ask();
  }

  select(id) {
    this.#selected = id;
    this.#ask();
  }

  /** There is one view only, and everything is as large as it has to be. */
  setView() {}

  setTrueSize() {}

  dispose() {}

  #extend(id, { p }, colour) {
    if (!this.#trails.has(id)) this.#trails.set(id, []);
    const trail = this.#trails.get(id);
    const last = trail.at(-1);
    if (!last || Math.hypot(p[0] - last.x, p[1] - last.y) > 0.03) trail.push({ x: p[0], y: p[1], colour });
    if (trail.length > 6000) trail.splice(0, 1000);
  }

  #ask() {
    if (this.#asked) return;
    this.#asked = true;
    requestAnimationFrame(() => this.#draw());
  }

  #draw() {
    this.#asked = false;
    const { clientWidth: width, clientHeight: height } = this.#box;
    if (width === 0) return;
    const ratio = Math.min(2, devicePixelRatio || 1);
    this.#canvas.width = Math.round(width * ratio);
    this.#canvas.height = Math.round(height * ratio);
    const pen = this.#canvas.getContext("2d");
    const arena = this.#scenario?.arena ?? { length_x_m: 10, width_y_m: 10 };
    const scale = Math.min((width - 40) / arena.length_x_m, (height - 90) / arena.width_y_m);
    // x to the right and y up, as on the pictures that a flight leaves; everything below is in metres.
    pen.setTransform(ratio * scale, 0, 0, -ratio * scale, (ratio * width) / 2, (ratio * height) / 2);
    pen.lineWidth = 2 / scale;
    pen.fillStyle = "#e2b038";
    pen.fillRect(-arena.length_x_m / 2, -arena.width_y_m / 2, arena.length_x_m, arena.width_y_m);
    this.#drawThings(pen);
    for (const trail of this.#trails.values()) drawTrail(pen, trail);
    if (this.#map) drawMap(pen, this.#map, this.#scenario, 1 / scale);
    for (const pose of this.#poses) this.#drawDrone(pen, pose);
  }

  #drawThings(pen) {
    if (!this.#scenario) return;
    const { base } = this.#scenario;
    pen.fillStyle = "#acaaa8";
    pen.fillRect(base.x_m - base.edge_m / 2, base.y_m - base.edge_m / 2, base.edge_m, base.edge_m);
    pen.fillStyle = `rgb(${PRISM.join(" ")})`;
    for (const { centre, half, yaw } of prismsOf(this.#scenario)) {
      pen.save();
      pen.translate(centre[0], centre[1]);
      pen.rotate(yaw);
      pen.fillRect(-half[0], -half[1], 2 * half[0], 2 * half[1]);
      pen.restore();
    }
    for (const frame of allFrames(this.#scenario)) {
      pen.save();
      pen.translate(frame.x_m, frame.y_m);
      pen.rotate(frame.yaw_rad);
      pen.fillStyle = FRAME_COLOURS[frame.colour];
      pen.fillRect(-0.06, -frame.outer_width_m / 2, 0.12, frame.outer_width_m);
      pen.restore();
    }
  }

  #drawDrone(pen, { id = 1, p, q, fresh = true }) {
    pen.save();
    pen.translate(p[0], p[1]);
    pen.rotate(yawOf(q));
    pen.globalAlpha = fresh ? 1 : 0.4;
    pen.beginPath();
    for (const [px, py] of [[0.35, 0], [-0.22, 0.2], [-0.12, 0], [-0.22, -0.2]]) pen.lineTo(px, py);
    pen.closePath();
    pen.fillStyle = id === this.#selected || this.#selected === null ? "#1c2733" : "#5c6773";
    pen.fill();
    pen.strokeStyle = "#ffffff";
    pen.stroke();
    pen.restore();
  }
}

function drawTrail(pen, trail) {
  for (let index = 1; index < trail.length; index += 1) {
    pen.strokeStyle = trail[index].colour;
    pen.beginPath();
    pen.moveTo(trail[index - 1].x, trail[index - 1].y);
    pen.lineTo(trail[index].x, trail[index].y);
    pen.stroke();
  }
}
