/** A quadrotor with its shadow, the thread to the floor, and its trail. */
import * as THREE from "three";
import { Ribbon } from "./ribbon.js";

export const SIZE_M = 0.25; // over all, as the challenge's drone; its model is made for this
const TRAIL_POINTS = 6000; // four minutes at full speed; after that it gets coarser
const LATEST_MS = 600; // rotors stand still when no more poses come
const ROTOR_RAD_S = 26; // far slower than true, so that the eye sees it turn

/** @typedef {import("./arena.js").Pose} Pose */

/** A drone as it is drawn. */
export class DroneModel {
  /** @param {THREE.Scene} scene */
  constructor(scene) {
    this.group = new THREE.Group(); // place and attitude
    this.body = new THREE.Group(); // drawn larger from far away
    /** @type {THREE.Group[]} */
    this.rotors = [];
    this.#build();
    this.group.add(this.body);
    const dark = { color: "#000000", transparent: true, opacity: 0.35, depthWrite: false };
    this.shadow = new THREE.Mesh(new THREE.CircleGeometry(SIZE_M / 2, 24), new THREE.MeshBasicMaterial(dark));
    const thread = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(0, 0, 1)]);
    this.thread = new THREE.Line(thread, new THREE.LineBasicMaterial({ color: "#1c2733", transparent: true, opacity: 0.7 }));
    this.trail = new Ribbon(TRAIL_POINTS);
    this.truth = new Ribbon(TRAIL_POINTS, { rim: 0.8 }); // where a simulated drone truly was
    scene.add(this.group, this.shadow, this.thread, this.trail.mesh, this.truth.mesh);
    this.from = { p: new THREE.Vector3(), q: new THREE.Quaternion() };
    this.to = { p: new THREE.Vector3(), q: new THREE.Quaternion() };
    this.began = -1; // when it set out from `from`; -1: it has never been anywhere
    /** @type {Pose|null} */
    this.pose = null;
    /** @type {THREE.Group|null} */
    this.cone = null;
  }

  /**
   * Set where it is to be soon, from where it is drawn now; at once, if so exactly.
   * @param {Pose} pose
   * @param {number} now ms
   * @param {boolean} [isExact]
   */
  aim(pose, now, isExact = false) {
    this.pose = pose;
    const [w, x, y, z] = pose.q;
    this.to.p.fromArray(pose.p);
    this.to.q.set(x, y, z, w).normalize();
    const isFar = isExact || this.began < 0 || this.group.position.distanceTo(this.to.p) > 1.5;
    this.from.p.copy(isFar ? this.to.p : this.group.position);
    this.from.q.copy(isFar ? this.to.q : this.group.quaternion);
    this.began = now;
  }

  /**
   * Draw it where it is at a time; returns whether it moves on by itself.
   * @param {number} now ms
   * @param {number} span_ms from one pose to the next
   * @param {number} turn seconds for which the rotors turn on
   */
  advance(now, span_ms, turn) {
    const share = Math.min(1, Math.max(0, now - this.began) / span_ms);
    this.group.position.lerpVectors(this.from.p, this.to.p, share);
    this.group.quaternion.slerpQuaternions(this.from.q, this.to.q, share);
    const { x, y, z } = this.group.position;
    this.shadow.position.set(x, y, 0.004);
    this.thread.position.set(x, y, 0);
    this.thread.scale.z = Math.max(0.001, z);
    const turns = this.pose?.on && this.pose.fresh !== false && now - this.began < LATEST_MS;
    if (turns && turn > 0) for (const rotor of this.rotors) rotor.rotation.z += rotor.userData.sense * ROTOR_RAD_S * turn;
    return share < 1 || (turns && turn > 0);
  }

  /** Its size on the screen: true, or as large as it takes to be seen. @param {number} scale */
  setScale(scale) {
    this.body.scale.setScalar(scale);
    this.shadow.scale.setScalar(scale);
  }

  /** @param {boolean} fresh */
  setFresh(fresh) {
    if (this.isFresh === fresh) return;
    /** @type {boolean|undefined} */
    this.isFresh = fresh;
    this.body.traverse((/** @type {any} */ part) => {
      if (part.material) part.material.opacity = fresh ? part.material.userData.opacity : 0.3;
      if (part.material) part.material.transparent = !fresh || part.material.userData.opacity < 1;
      if (part.material) part.material.needsUpdate = true;
    });
  }

  /** @param {boolean} visible */
  setVisible(visible) {
    this.body.visible = this.shadow.visible = this.thread.visible = visible;
  }

  discard() {
    for (const part of [this.group, this.shadow, this.thread, this.trail.mesh, this.truth.mesh]) {
      part.traverse((/** @type {any} */ each) => { each.geometry?.dispose(); each.material?.dispose(); });
      part.removeFromParent();
    }
  }

  #build() {
    /** @param {string} color @param {number} [opacity] */
    const paint = (color, opacity = 1) => {
      const material = new THREE.MeshLambertMaterial({ color, opacity, transparent: opacity < 1, depthWrite: opacity === 1 });
      material.userData.opacity = opacity;
      return material;
    };
    const [dark, arm, nose, blade] = [paint("#2b3440"), paint("#4d5967"), paint("#ff8c1a"), paint("#11161c")];
    const disc = { front: paint("#ff8c1a", 0.45), rear: paint("#9fb2c8", 0.5) };
    /**
     * @param {THREE.BufferGeometry} geometry @param {THREE.Material} material
     * @param {number} x @param {number} y @param {number} z @param {number} [yaw]
     */
    const add = (geometry, material, x, y, z, yaw = 0) => {
      const part = new THREE.Mesh(geometry, material);
      part.position.set(x, y, z);
      part.rotation.z = yaw;
      this.body.add(part);
      return part;
    };
    add(new THREE.BoxGeometry(0.1, 0.06, 0.03), dark, 0, 0, 0);
    add(new THREE.BoxGeometry(0.05, 0.04, 0.02), arm, -0.02, 0, 0.022);
    add(new THREE.ConeGeometry(0.016, 0.045, 12), nose, 0.07, 0, 0.004).rotation.set(0, 0, -Math.PI / 2);
    for (const [x, y] of [[1, -1], [-1, 1], [1, 1], [-1, -1]]) {
      const [px, py] = [0.075 * x, 0.075 * y];
      add(new THREE.BoxGeometry(0.106, 0.012, 0.01), arm, px / 2, py / 2, 0, Math.atan2(y, x));
      const hub = new THREE.CylinderGeometry(0.009, 0.009, 0.022, 10).rotateX(Math.PI / 2);
      add(hub, dark, px, py, 0.006);
      add(new THREE.BoxGeometry(0.006, 0.006, 0.022), arm, px, py, -0.014);
      const rotor = new THREE.Group();
      rotor.position.set(px, py, 0.02);
      rotor.rotation.z = 0.6 * x * y;
      rotor.userData.sense = x * y;
      rotor.add(new THREE.Mesh(new THREE.BoxGeometry(0.094, 0.009, 0.002), blade));
      rotor.add(new THREE.Mesh(new THREE.CircleGeometry(0.05, 24), x > 0 ? disc.front : disc.rear));
      for (const part of /** @type {any[]} */ (rotor.children)) part.material.side = THREE.DoubleSide;
      this.rotors.push(rotor);
      this.body.add(rotor);
    }
  }
}
