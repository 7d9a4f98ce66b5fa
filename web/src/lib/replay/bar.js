/** The controls of time: play, step, speed, and a slider with the crossings on it. */
import "./bar.css";
import { make, number, setAttribute, setText } from "../dom.js";
import { SPEEDS } from "./clock.js";

const STEP_S = 0.1;
const LONG_STEP_S = 5;

export class Bar {
  #clock;
  #runs;
  #play;
  #slider;
  #time;
  #speed;
  #marks;

  /**
   * @param {HTMLElement} element where it goes
   * @param {import("./clock.js").Clock} clock
   * @param {import("./run.js").Run[]} runs one or two
   * @param {{keys?: boolean}} [options] keys: it hears keys wherever the focus is (default)
   */
  constructor(element, clock, runs, { keys = true } = {}) {
    this.#clock = clock;
    this.#runs = runs;
    /** @param {string} words @param {string} label @param {() => void} act @param {string|null} [keys] */
    const button = (words, label, act, keys = /** @type {string|null} */ (null)) => {
      const made = make("button", { type: "button", "aria-label": label, title: keys ? `${label} (${keys})` : label }, words);
      made.addEventListener("click", act);
      return made;
    };
    this.#play = button("▶", "play", () => clock.toggle(), keys ? "space" : null);
    this.#play.classList.add("r-play");
    const back = button("◂", "a step back", () => this.#step(-STEP_S), keys ? "," : null);
    const on = button("▸", "a step on", () => this.#step(STEP_S), keys ? "." : null);
    this.#time = make("output", { class: "r-time", "aria-live": "off" });
    this.#speed = make("select", { "aria-label": "speed", title: keys ? "speed (− and +)" : "speed" });
    for (const speed of SPEEDS) this.#speed.append(make("option", { value: String(speed), selected: speed === 1 }, `${speed}×`));
    this.#speed.addEventListener("change", () => clock.setSpeed(Number(this.#speed.value)));
    this.#slider = make("input", {
      type: "range", min: String(clock.begin), max: String(clock.end), step: "any", class: "r-slider", "aria-label": "time since motors on",
    });
    this.#slider.addEventListener("input", () => clock.seek(Number(this.#slider.value)));
    this.#slider.addEventListener("keydown", (event) => this.#sliderKey(event));
    this.#marks = make("div", { class: "r-marks" });
    runs.forEach((run, row) => this.#addMarks(run, row));
    const track = make("div", { class: "r-track", "data-rows": String(runs.length) }, this.#slider, this.#marks);
    const buttons = make("div", { class: "r-buttons small-buttons" }, this.#play, back, on, this.#time, this.#speed);
    this.root = make("div", { class: "r-bar m-panel", role: "group", "aria-label": "time" }, buttons, track);
    element.append(this.root);
    if (keys) document.addEventListener("keydown", (event) => this.#key(event));
    clock.listen(() => this.#show());
    this.#show();
  }

  /**
   * A mark for each crossing: pressed, it goes there.
   * @param {import("./run.js").Run} run
   * @param {number} row
   */
  #addMarks(run, row) {
    const { begin, end } = this.#clock;
    run.crossings.forEach(({ t, colour }) => {
      const words = `${this.#runs.length > 1 ? `${"AB"[row]}: ` : ""}${colour} crossed, ${number(t)} s`;
      const mark = make("button", { type: "button", "data-colour": colour, "data-row": String(row), "aria-label": words, title: words });
      mark.style.left = `${(100 * (t - begin)) / Math.max(1e-6, end - begin)}%`;
      mark.addEventListener("click", () => this.#clock.seek(t));
      this.#marks.append(mark);
    });
  }

  /** @param {number} seconds */
  #step(seconds) {
    this.#clock.pause();
    this.#clock.seek(this.#clock.t + seconds);
  }

  /** @param {number} by */
  #changeSpeed(by) {
    const index = SPEEDS.indexOf(this.#clock.speed) + by;
    if (SPEEDS[index] === undefined) return;
    this.#speed.value = String(SPEEDS[index]);
    this.#clock.setSpeed(SPEEDS[index]);
  }

  /** What the slider would make of these keys is a hair's breadth. @param {KeyboardEvent} event */
  #sliderKey(event) {
    /** @type {Record<string, number|undefined>} */
    const steps = {
      ArrowLeft: -STEP_S, ArrowDown: -STEP_S, ArrowRight: STEP_S, ArrowUp: STEP_S, PageDown: -LONG_STEP_S, PageUp: LONG_STEP_S,
    };
    const step = steps[event.key];
    if (step === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.#clock.seek(this.#clock.t + (event.shiftKey ? 10 : 1) * step);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target instanceof Element ? event.target : null;
    const own = target?.closest("input:not([type=range]), textarea, select, summary, a, [contenteditable]");
    if (own) return;
    if (event.key === " ") {
      // A button that has the focus is pressed by the same key; the play button may be.
      if (target?.closest("button")) return;
      event.preventDefault();
      this.#clock.toggle();
    } else if (event.key === ",") this.#step(-STEP_S);
    else if (event.key === ".") this.#step(STEP_S);
    else if (event.key === "+") this.#changeSpeed(1);
    else if (event.key === "-" && !target?.closest(".m-chart-picture")) this.#changeSpeed(-1);
  }

  #show() {
    const { t, end, isPlaying } = this.#clock;
    this.#slider.value = String(t);
    const [state] = this.#runs[0].stateAt(t);
    setAttribute(this.#slider, "aria-valuetext", `${number(t)} seconds${state ? `, ${state}` : ""}`);
    setText(this.#time, `${number(t)} s`);
    setAttribute(this.#time, "data-value", t.toFixed(3));
    setText(this.#play, isPlaying ? "❚❚" : "▶");
    setAttribute(this.#play, "aria-label", isPlaying ? "pause" : t >= end ? "play from the start" : "play");
    setAttribute(this.root, "data-playing", String(isPlaying));
  }
}
