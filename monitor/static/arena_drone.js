/** A quadrotor with its shadow, the thread to the floor, and its trail. */

const SIZE_M = 0.25; // over all, as the challenge's drone; its model is made for this
const POINTS = 6000; // of a trail; when it is full every second one goes
const STEP_M = 0.02; // no nearer together than this
const ROTOR_RAD_S = 26; // far slower than true, so that the eye sees it turn

/** A drone as it is drawn. */
export class DroneModel {
  /** @param {object} THREE @param {object} scene */
  constructor(THREE, scene) {
    this.THREE = THREE;
    this.group = new THREE.Group(); // place and attitude
    this.body = new THREE.Group(); // drawn larger from far away
    this.rotors = [];
    this.#build();
    this.group.add(this.body);
    const dark = { color: "#000000", transparent: true, opacity: 0.35, depthWrite: false };
    this.shadow = new THREE.Mesh(new THREE.CircleGeometry(SIZE_M / 2, 24), new THREE.MeshBasicMaterial(dark));
    const thread = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(0, 0, 1)]);
    this.thread = new THREE.Line(thread, new THREE.LineBasicMaterial({ color: "#1c2733", transparent: true, opacity: 0.7 }));
    this.trail = new Trail(THREE);
    scene.add(this.group, this.shadow, this.thread, this.trail.mesh);
    this.from = { p: new THREE.Vector3(), q: new THREE.Quaternion() };
    this.to = { p: new THREE.Vector3(), q: new THREE.Quaternion() };
    this.began = -1; // when it set out from `from`; -1: it has never been anywhere
    this.pose = null;
    this.cone = null;
  }

  /** Set where it is to be soon, from where it is drawn now. */
  aim(pose, now, jump) {
    this.pose = pose;
    const [w, x, y, z] = pose.q;
    this.to.p.set(...pose.p);
    this.to.q.set(x, y, z, w).normalize();
    const isFar = this.began < 0 || this.group.position.distanceTo(this.to.p) > 1.5;
    this.from.p.copy(jump || isFar ? this.to.p : this.group.position);
    this.from.q.copy(jump || isFar ? this.to.q : this.group.quaternion);
    this.began = now;
  }

  /** Draw it where it is at a time; returns whether it moves on by itself. */
  advance(now, span_ms, turn) {
    const share = Math.min(1, (now - this.began) / span_ms);
    this.group.position.lerpVectors(this.from.p, this.to.p, share);
    this.group.quaternion.slerpQuaternions(this.from.q, this.to.q, share);
    const { x, y, z } = this.group.position;
    this.shadow.position.set(x, y, 0.004);
    this.thread.position.set(x, y, 0);
    this.thread.scale.z = Math.max(0.001, z);
    const turns = this.pose?.on && this.pose.fresh !== false;
    if (turns && turn > 0) for (const rotor of this.rotors) rotor.rotation.z += rotor.userData.sense * ROTOR_RAD_S * turn;
    return share < 1 || turns;
  }

  /** Its size on the screen: true, or as large as it takes to be seen. */
  setScale(scale) {
    this.body.scale.setScalar(scale);
    this.shadow.scale.setScalar(scale);
  }

  setFresh(fresh) {
    if (this.isFresh === fresh) return;
    this.isFresh = fresh;
    this.body.traverse((part) => {
      if (part.material) part.material.opacity = fresh ? part.material.userData.opacity : 0.3;
      if (part.material) part.material.transparent = !fresh || part.material.userData.opacity < 1;
      if (part.material) part.material.needsUpdate = true;
    });
  }

  setVisible(visible) {
    this.body.visible = this.shadow.visible = this.thread.visible = visible;
  }

  discard() {
    for (const part of [this.group, this.shadow, this.thread, this.trail.mesh]) {
      part.traverse((each) => { each.geometry?.dispose(); each.material?.dispose(); });
      part.removeFromParent();
    }
  }

  #build() {
    const { THREE } = this;
    const paint = (color, opacity = 1) => {
      const material = new THREE.MeshLambertMaterial({ color, opacity, transparent: opacity < 1, depthWrite: opacity === 1 });
      material.userData.opacity = opacity;
      return material;
    };
    const [dark, arm, nose, blade] = [paint("#2b3440"), paint("#4d5967"), paint("#ff8c1a"), paint("#11161c")];
    const disc = { front: paint("#ff8c1a", 0.45), rear: paint("#9fb2c8", 0.5) };
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
      for (const part of rotor.children) part.material.side = THREE.DoubleSide;
      this.rotors.push(rotor);
      this.body.add(rotor);
    }
  }
}

export { SIZE_M };

/** A line of any width through places, each stretch in a colour of its own; its memory is set aside once. */
export class Trail {
  #array = new Float32Array(6 * POINTS);
  #buffer;
  #count = 0;
  #step_m = STEP_M;

  constructor(THREE) {
    this.#buffer = new THREE.InstancedInterleavedBuffer(this.#array, 6).setUsage(THREE.DynamicDrawUsage);
    this.geometry = new THREE.InstancedBufferGeometry();
    const corners = [0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0]; // share of the way, side
    this.geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
    this.geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const part = (size, offset) => new THREE.InterleavedBufferAttribute(this.#buffer, size, offset);
    this.geometry.setAttribute("start", part(3, 0)); // a stretch reads its end from the next point
    this.geometry.setAttribute("finish", part(3, 6));
    this.geometry.setAttribute("tint", part(3, 9));
    this.geometry.instanceCount = 0;
    this.material = new THREE.ShaderMaterial({
      uniforms: { size: { value: new THREE.Vector2(1, 1) }, width: { value: 4 } },
      vertexShader: VERTEX, fragmentShader: FRAGMENT, side: THREE.DoubleSide,
    });
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
  }

  /**
   * Go on to a place.
   * @param {number[]} p metres
   * @param {number[]} rgb 0..1
   */
  add(p, rgb) {
    const array = this.#array;
    const at = 6 * this.#count;
    const isNear = this.#count > 0
      && Math.hypot(p[0] - array[at - 6], p[1] - array[at - 5], p[2] - array[at - 4]) < this.#step_m;
    if (isNear) return false;
    if (this.#count === POINTS) {
      this.#thin();
      return this.add(p, rgb);
    }
    array.set([...p, ...rgb], at);
    this.#count += 1;
    this.#buffer.addUpdateRange(at, 6);
    this.#publish();
    return true;
  }

  clear() {
    this.#count = 0;
    this.#step_m = STEP_M;
    this.#publish();
  }

  /** Keep every second point, and from now on lay them twice as far apart. */
  #thin() {
    const array = this.#array;
    const kept = POINTS / 2;
    for (let index = 0; index < kept; index += 1) array.copyWithin(6 * index, 12 * index, 12 * index + 6);
    this.#count = kept;
    this.#step_m *= 2;
    this.#buffer.clearUpdateRanges();
    this.#buffer.addUpdateRange(0, array.length);
  }

  #publish() {
    this.#buffer.needsUpdate = true;
    this.geometry.instanceCount = Math.max(0, this.#count - 1);
    this.mesh.visible = this.#count > 1;
  }
}

const VERTEX = `
attribute vec3 start; attribute vec3 finish; attribute vec3 tint;
uniform vec2 size; uniform float width;
varying vec3 vTint; varying float vSide;
void main() {
  vec4 a = projectionMatrix * modelViewMatrix * vec4(start, 1.0);
  vec4 b = projectionMatrix * modelViewMatrix * vec4(finish, 1.0);
  float near = 0.02; // a stretch that begins behind the eye is cut there
  if (a.w < near && b.w > near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  else if (b.w < near && a.w > near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 way = (b.xy / b.w - a.xy / a.w) * size;
  way = length(way) > 1e-4 ? normalize(way) : vec2(1.0, 0.0);
  vec4 place = position.x < 0.5 ? a : b;
  vec2 shift = vec2(-way.y, way.x) * position.y * width * 0.5 + way * (position.x - 0.5) * width * 0.5;
  place.xy += shift / size * 2.0 * place.w;
  vTint = tint;
  vSide = position.y;
  gl_Position = place;
}`;

const FRAGMENT = `
varying vec3 vTint; varying float vSide;
void main() {
  float rim = smoothstep(0.55, 0.85, abs(vSide)); // a pale rim keeps dark colours apart from a dark ground
  gl_FragColor = vec4(mix(vTint, vec3(1.0), rim * 0.55), 1.0);
}`;
