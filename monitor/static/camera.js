/** The camera's image with what the app saw in it drawn over it. */
export class CameraView {
  /** @param {HTMLElement} element an empty box; the view takes its width */
  constructor(element) { this.element = element; }

  /**
   * @param {string|Blob|null} image address of an image or of MJPEG, or a JPEG; null: there is none
   * @param {string} [words] what to say if there is none
   */
  setImage(image, words = "no video") {}

  /** @param {{width: number, height: number, boxes: object}|null} message as "detections"; null: nothing known */
  setDetections(message) {}
}
