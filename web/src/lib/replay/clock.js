/** The time that is shown: stands still, or goes on as wall time does, times a speed. */

export const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];

export class Clock {
  #t = 0;
  /** @type {[number, number]|null} */
  #began = null; // wall time, seconds, and the time shown then
  #speed = 1;
  #begin = 0;
  #end = 0;
  /** @type {((clock: Clock) => void)[]} */
  #listeners = [];
  #asked = false;

  /** @param {() => number} [now] wall time, seconds */
  constructor(now = () => performance.now() / 1000) {
    this.now = now;
  }

  get t() { return this.#t; }
  get begin() { return this.#begin; }
  get end() { return this.#end; }
  get speed() { return this.#speed; }
  get isPlaying() { return this.#began !== null; }

  /** Hear of every change, at most once a picture. @param {(clock: Clock) => void} hear */
  listen(hear) {
    this.#listeners.push(hear);
  }

  /** @param {number} begin @param {number} end */
  setSpan(begin, end) {
    [this.#begin, this.#end] = [begin, end];
    this.seek(this.#t);
  }

  /** @param {number} t */
  seek(t) {
    this.#t = Math.min(this.#end, Math.max(this.#begin, t));
    if (this.isPlaying) this.#began = [this.now(), this.#t];
    this.#tell();
  }

  /** @param {number} speed */
  setSpeed(speed) {
    this.#advance();
    this.#speed = speed;
    if (this.isPlaying) this.#began = [this.now(), this.#t];
    this.#tell();
  }

  play() {
    if (this.isPlaying) return;
    if (this.#t >= this.#end) this.#t = this.#begin;
    this.#began = [this.now(), this.#t];
    this.#tell();
  }

  pause() {
    this.#advance();
    this.#began = null;
    this.#tell();
  }

  toggle() {
    if (this.isPlaying) this.pause();
    else this.play();
  }

  #advance() {
    if (!this.#began) return;
    const [wall, t] = this.#began;
    this.#t = Math.min(this.#end, t + (this.now() - wall) * this.#speed);
    if (this.#t >= this.#end) this.#began = null;
  }

  #tell() {
    if (this.#asked) return;
    this.#asked = true;
    requestAnimationFrame(() => {
      this.#asked = false;
      this.#advance();
      for (const hear of this.#listeners) hear(this);
      if (this.isPlaying) this.#tell();
    });
  }
}
