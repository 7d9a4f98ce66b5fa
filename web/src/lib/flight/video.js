/** Reads a drone's camera image by image, each with the vehicle time of its exposure. */

/** @typedef {{t: number|null, jpeg: Blob}} VideoImage t: seconds, vehicle time; null if not known */

const HEAD_BYTES = 12; // time in microseconds (int64, -1: not known) and length of the JPEG (uint32)
const MAX_IMAGE_BYTES = 8 << 20;
const RETRY_MS = 2000;

/** One connection to `/video/ID/frames`, made again when it ends. */
export class FrameStream {
  /** @type {string|null} */
  #address = null;
  #hear;
  /** @type {AbortController|null} */
  #control = null;

  /** @param {(image: VideoImage) => void} hear told each image */
  constructor(hear) {
    this.#hear = hear;
    addEventListener("pagehide", () => this.#control?.abort());
    addEventListener("pageshow", (event) => { if (event.persisted) this.#open(); });
  }

  /** @param {string|null} address to read from now on; null: none */
  watch(address) {
    if (address === this.#address) return;
    this.#address = address;
    this.#open();
  }

  async #open() {
    this.#control?.abort();
    const address = this.#address;
    if (address === null) return;
    const control = new AbortController();
    this.#control = control;
    while (!control.signal.aborted) {
      try {
        const answer = await fetch(address, { signal: control.signal, cache: "no-store" });
        if (answer.ok && answer.body) await this.#read(answer.body.getReader(), control.signal);
      } catch { /* the connection ended; it is made again */ }
      await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
    }
  }

  /** @param {ReadableStreamDefaultReader<Uint8Array<ArrayBuffer>>} reader @param {AbortSignal} signal */
  async #read(reader, signal) {
    let rest = new Uint8Array(0);
    for (;;) {
      const { done, value } = await reader.read();
      if (done || signal.aborted) return;
      rest = join(rest, value);
      for (;;) {
        if (rest.length < HEAD_BYTES) break;
        const head = new DataView(rest.buffer, rest.byteOffset, HEAD_BYTES);
        const length = head.getUint32(8, true);
        if (length > MAX_IMAGE_BYTES) throw new Error("this is no stream of images");
        if (rest.length < HEAD_BYTES + length) break;
        const time_us = Number(head.getBigInt64(0, true));
        const jpeg = new Blob([rest.subarray(HEAD_BYTES, HEAD_BYTES + length)], { type: "image/jpeg" });
        rest = rest.slice(HEAD_BYTES + length);
        this.#hear({ t: time_us < 0 ? null : time_us * 1e-6, jpeg });
      }
    }
  }
}

/** @param {Uint8Array<ArrayBuffer>} before @param {Uint8Array<ArrayBuffer>} after */
function join(before, after) {
  if (before.length === 0) return after;
  const joined = new Uint8Array(before.length + after.length);
  joined.set(before);
  joined.set(after, before.length);
  return joined;
}
