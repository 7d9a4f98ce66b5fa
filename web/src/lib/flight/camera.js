import { onBeat } from "../beat.js";
import { make, number, setText } from "../dom.js";

/**
 * @import {Live} from "../messages.js"
 * @typedef {Pick<Live.Detections, "width"|"height"|"boxes"> & {t?: number|null}} Seen in an image
 * @typedef {[number, number, number, number, number|null, number|null]} Box edges
 *   n, s, e, w from the middle, pixels; distance, metres; angle, degrees
 * @typedef {{jpeg: Blob, t: number|null, detections: Seen|null}} ShownImage
 */

// Bright edges with dark ones beside them, so that they are seen on any image. The colour's name stands there too.
/** @type {Record<string, string>} */
const EDGES = { red: "#ff4d4d", green: "#3df03d", blue: "#6f9dff" };

/** The camera's image with what the app saw in it drawn over it. */
export class CameraView {
  #box;
  #image;
  #canvas;
  #words;
  /** @type {string|null} */
  #address = null;
  /** @type {string|null} */
  #owned = null;
  /** @type {Seen|null} */
  #message = null;
  #drawn = "";
  #again = 0;
  #note;
  /** @type {ImageBitmap|null} */
  #bitmap = null;
  /** @type {ShownImage|null} */
  #wanted = null;

  /** @param {HTMLElement} element an empty box; the view takes its width */
  constructor(element) {
    this.#image = make("img", { alt: "what the drone's camera sees", draggable: "false" });
    this.#canvas = make("canvas", { "aria-hidden": "true" });
    this.#words = make("p", { class: "m-camera-words" }, "no video");
    this.#note = make("p", { class: "m-camera-note", hidden: true });
    this.#box = make("div", { class: "m-camera" }, this.#image, this.#canvas, this.#words, this.#note);
    element.append(this.#box);
    this.#image.hidden = true;
    this.#image.addEventListener("load", () => this.#showImage(true));
    this.#image.addEventListener("error", () => this.#failed());
    new ResizeObserver(() => this.#draw()).observe(this.#box);
  }

  /**
   * @param {string|Blob|null} image address of an image or of MJPEG, or a JPEG; null: there is none
   * @param {string} [words] what to say if there is none
   */
  setImage(image, words = "no video") {
    if (typeof image === "string" && image === this.#address) return;
    clearTimeout(this.#again);
    const old = this.#owned;
    this.#owned = image instanceof Blob ? URL.createObjectURL(image) : null;
    this.#address = typeof image === "string" ? image : null;
    const address = this.#owned ?? this.#address;
    if (address === null) {
      this.#image.removeAttribute("src"); // ends a stream that is being received
      this.#showImage(false);
      setText(this.#words, words);
    } else {
      this.#image.src = address;
      if (this.#owned === null) {
        this.#showImage(false);
        setText(this.#words, "waiting for the first image");
      }
    }
    if (old) URL.revokeObjectURL(old);
  }

  /**
   * Show an image and what was detected in this very image, both at once.
   * @param {ShownImage} frame
   */
  async showFrame(frame) {
    this.#wanted = frame;
    let bitmap;
    try {
      bitmap = await createImageBitmap(frame.jpeg);
    } catch {
      return; // it is no image; the one before stays
    }
    if (this.#wanted !== frame) return bitmap.close();
    this.#bitmap?.close();
    this.#bitmap = bitmap;
    this.#message = frame.detections;
    this.#box.style.setProperty("--shape", `${bitmap.width} / ${bitmap.height}`);
    this.#box.dataset.time = String(frame.t ?? "");
    /** @type {Record<string, any>} */ (this.#box.dataset).boxesTime = frame.detections?.t ?? "";
    this.#words.hidden = true;
    this.#draw();
  }

  /** Forget the image. @param {string} words what to say instead */
  clearFrame(words) {
    this.#wanted = null;
    this.#bitmap?.close();
    this.#bitmap = null;
    this.#message = null;
    this.#words.hidden = false;
    setText(this.#words, words);
    this.#draw();
  }

  /**
   * Say something about the image, such as that it is the last one; "" takes it away.
   * @param {string} words
   */
  setNote(words) {
    setText(this.#note, words);
    this.#note.hidden = words === "";
  }

  /** @param {Seen|null} message null: nothing known */
  setDetections(message) {
    this.#message = message;
    if (message && message.width > 0 && message.height > 0) {
      this.#box.style.setProperty("--shape", `${message.width} / ${message.height}`);
    }
    const told = JSON.stringify([message?.width, message?.height, message?.boxes]);
    if (told === this.#drawn) return;
    this.#drawn = told;
    onBeat(this, () => this.#draw());
  }

  /** @param {boolean} shown */
  #showImage(shown) {
    this.#image.hidden = !shown;
    this.#words.hidden = shown;
  }

  #failed() {
    if (!this.#image.hasAttribute("src")) return;
    this.#showImage(false);
    setText(this.#words, "no image comes from the camera, trying again");
    const address = this.#address;
    if (address === null) return;
    this.#again = setTimeout(() => {
      if (this.#address === address) this.#image.src = address;
    }, 2000);
  }

  #draw() {
    const canvas = this.#canvas;
    const { clientWidth: width, clientHeight: height } = this.#box;
    const ratio = Math.min(2, devicePixelRatio || 1);
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const [message, bitmap] = [this.#message, this.#bitmap];
    if (bitmap) {
      pen.drawImage(bitmap, 0, 0, width, height);
    }
    if (!message || !(message.width > 0)) return;
    const scale = width / message.width;
    for (const colour of ["red", "green", "blue"]) {
      const box = message.boxes?.[colour];
      if (box) this.#drawBox(pen, colour, /** @type {Box} */ (box), message, scale);
    }
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {string} colour
   * @param {Box} box
   * @param {Seen} message
   * @param {number} scale
   */
  #drawBox(pen, colour, [n, s, e, w, d, a], message, scale) {
    if ([n, s, e, w].some((edge) => edge === null)) return;
    const [cu, cv] = [message.width / 2, message.height / 2];
    const [left, right] = [(cu + w) * scale, (cu + e) * scale];
    const [top, bottom] = [(cv - n) * scale, (cv - s) * scale];
    const [x, y, size] = [(left + right) / 2, (top + bottom) / 2, 5];
    const path = new Path2D();
    path.rect(left, top, Math.max(1, right - left), Math.max(1, bottom - top));
    path.moveTo(x - size, y);
    path.lineTo(x + size, y);
    path.moveTo(x, y - size);
    path.lineTo(x, y + size);
    pen.lineJoin = "round";
    pen.strokeStyle = "rgba(0, 0, 0, 0.75)";
    pen.lineWidth = 4;
    pen.stroke(path);
    pen.strokeStyle = EDGES[colour];
    pen.lineWidth = 2;
    pen.stroke(path);
    const alpha = a === null ? "–" : `${number(a, 0)}°`;
    this.#label(pen, `${colour}  d ${d === null ? "–" : `${number(d, 2)} m`}  α ${alpha}`, left, top, bottom, EDGES[colour]);
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {string} text
   * @param {number} left
   * @param {number} top
   * @param {number} bottom
   * @param {string} edge its colour
   */
  #label(pen, text, left, top, bottom, edge) {
    const { clientWidth: width, clientHeight: height } = this.#box;
    const size = Math.max(12, Math.min(26, width / 36)); // read from afar on a large picture
    const high = 1.5 * size;
    pen.font = `600 ${size}px system-ui, sans-serif`;
    const wide = pen.measureText(text).width + size;
    const x = Math.max(0, Math.min(width - wide, left - 1));
    let y = top - high - 3;
    if (y < 0) y = bottom + 4 + high <= height ? bottom + 4 : 2;
    pen.fillStyle = "rgba(0, 0, 0, 0.75)";
    pen.fillRect(x, y, wide, high);
    pen.fillStyle = edge;
    pen.fillRect(x, y, 0.25 * size, high);
    pen.fillStyle = "#ffffff";
    pen.textBaseline = "middle";
    pen.fillText(text, x + 0.6 * size, y + 0.53 * high);
  }
}
