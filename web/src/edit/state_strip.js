/** The time line of states: a strip with a part for each time in which a state was active. */
import { make, number } from "../lib/dom.js";

/** @typedef {{state: string, from_s: number, to_s: number}} Span */

/**
 * Draw a time line.
 * @param {HTMLElement} strip
 * @param {Span[]} spans in order
 * @param {{end_s: number, seek?: (time_s: number) => void}} options end_s: of the whole line; seek: told where it was
 *   clicked
 */
export function drawStrip(strip, spans, { end_s, seek }) {
  const start = spans[0]?.from_s ?? 0;
  const whole = Math.max(end_s - start, 0.001);
  strip.replaceChildren(...spans.map(({ state, from_s, to_s }) => {
    const part = make("span", { title: `${state}: ${number(from_s - start, 1)}–${number(to_s - start, 1)} s` }, state.split(".").at(-1) ?? "");
    part.style.width = `${100 * Math.max(to_s - from_s, 0) / whole}%`;
    if (seek) part.addEventListener("click", () => seek(from_s));
    return part;
  }));
}
