/** A line that stays as wide on the screen from wherever it is seen; WebGL's own lines are one pixel wide. */
import * as THREE from "three";

const STEP_M = 0.02; // points lie no nearer together than this

/** Given in place of a colour: no line goes to this place from the last one. */
export const GAP = [-1, 0, 0];

/** A line of any width through places, each stretch in a colour of its own; its memory is set aside once. */
export class Ribbon {
  #array;
  #most;
  #buffer;
  #count = 0;
  #step_m = STEP_M;

  /**
   * @param {number} most points; when it is full every second one goes
   * @param {{rim?: number}} [options] rim: how pale its edges are, 0..1
   */
  constructor(most, { rim = 0.4 } = {}) {
    this.#most = most;
    this.#array = new Float32Array(6 * (most + 1)); // a stretch's end is read one point beyond its start
    this.#buffer = new THREE.InstancedInterleavedBuffer(this.#array, 6).setUsage(THREE.DynamicDrawUsage);
    this.geometry = new THREE.InstancedBufferGeometry();
    const corners = [0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0]; // share of the way, side
    this.geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
    this.geometry.setIndex([0, 1, 2, 0, 2, 3]);
    /** @param {number} size @param {number} offset */
    const part = (size, offset) => new THREE.InterleavedBufferAttribute(this.#buffer, size, offset);
    this.geometry.setAttribute("start", part(3, 0)); // a stretch reads its end from the next point
    this.geometry.setAttribute("finish", part(3, 6));
    this.geometry.setAttribute("tint", part(3, 9));
    this.geometry.instanceCount = 0;
    this.material = new THREE.ShaderMaterial({
      uniforms: { size: { value: new THREE.Vector2(1, 1) }, width: { value: 4 }, rim: { value: rim } },
      vertexShader: VERTEX, fragmentShader: FRAGMENT, side: THREE.DoubleSide,
    });
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
  }

  /**
   * Go on to a place.
   * @param {number[]} p metres
   * @param {number[]} rgb 0..1, or `GAP`
   * @returns {boolean} whether it was far enough from the last one
   */
  add(p, rgb) {
    const array = this.#array;
    const at = 6 * this.#count;
    const isNear = this.#count > 0
      && Math.hypot(p[0] - array[at - 6], p[1] - array[at - 5], p[2] - array[at - 4]) < this.#step_m;
    if (isNear) return false;
    if (this.#count === this.#most) {
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

  /**
   * Set how wide it is, pixels, on a picture of some size.
   * @param {number} width
   * @param {number[]} picture
   */
  fit(width, picture) {
    this.material.uniforms.width.value = width;
    this.material.uniforms.size.value.set(...picture);
  }

  /** Whether there is anything to see. */
  get isDrawn() {
    return this.#count > 1;
  }

  /** Keep every second point, and from now on lay them twice as far apart. */
  #thin() {
    const array = this.#array;
    const kept = Math.floor(this.#most / 2);
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
  gl_Position = tint.r < 0.0 ? vec4(2.0, 2.0, 2.0, 1.0) : place; // a gap is drawn outside of the picture
}`;

const FRAGMENT = `
uniform float rim;
varying vec3 vTint; varying float vSide;
void main() {
  float edge = smoothstep(0.55, 0.85, abs(vSide)); // a pale rim keeps dark colours apart from a dark ground
  gl_FragColor = vec4(mix(vTint, vec3(1.0), edge * rim), 1.0);
}`;
