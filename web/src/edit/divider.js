/** A bar between two parts of the page that is dragged, or moved with the arrow keys; where it was left is remembered. */
import { make } from "../lib/dom.js";

const STEP = 24; // pixels that an arrow key moves it

/**
 * @param {HTMLElement} area the grid whose custom property `--NAME` is the size of a part after the bar
 * @param {{name: string, part: HTMLElement, label: string, isRow: boolean, least: number, space: number}} options isRow: the parts are one above
 *   the other; least: pixels that the part keeps; space: pixels that the others keep
 */
export function divider(area, { name, part, label, isRow, least, space }) {
  const kept = `framerunner-edit-${name}`;
  const bar = make("div", {
    class: `e-divider e-divider-${name}`, role: "separator", tabindex: "0", "aria-label": label, title: label,
    "aria-orientation": isRow ? "horizontal" : "vertical",
  });
  const most = () => Math.max(least, (isRow ? area.clientHeight : area.clientWidth) - space);
  const size = () => part.getBoundingClientRect()[isRow ? "height" : "width"];
  /** @param {number} wanted pixels */
  const set = (wanted) => {
    const pixels = Math.round(Math.min(Math.max(wanted, least), most()));
    area.style.setProperty(`--${name}`, `${pixels}px`);
    bar.setAttribute("aria-valuenow", String(pixels));
    return pixels;
  };
  /** @param {number} wanted pixels */
  const keep = (wanted) => localStorage.setItem(kept, String(set(wanted)));
  bar.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    bar.focus();
    bar.setPointerCapture(event.pointerId);
    const [start, before] = [isRow ? event.clientY : event.clientX, size()];
    const move = (/** @type {PointerEvent} */ moved) => keep(before + start - (isRow ? moved.clientY : moved.clientX));
    bar.addEventListener("pointermove", move);
    bar.addEventListener("lostpointercapture", () => bar.removeEventListener("pointermove", move), { once: true });
  });
  bar.addEventListener("keydown", (event) => {
    const change = { [isRow ? "ArrowUp" : "ArrowLeft"]: STEP, [isRow ? "ArrowDown" : "ArrowRight"]: -STEP }[event.key];
    if (change === undefined) return;
    event.preventDefault();
    keep(size() + change);
  });
  bar.addEventListener("dblclick", () => {
    localStorage.removeItem(kept);
    area.style.removeProperty(`--${name}`);
  });
  const restore = () => {
    const wanted = Number(localStorage.getItem(kept));
    if (wanted > 0 && area.clientWidth > 0) set(wanted);
  };
  new ResizeObserver(restore).observe(area);
  return bar;
}
