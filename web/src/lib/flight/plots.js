import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { onBeat } from "../beat.js";
import { make, number, onTheme, setText, themeColour } from "../dom.js";
import { yawOf } from "../yaw.js";

const WINDOW_S = 60;
const LINES_S = 15;
const REDRAW_MS = 220;
const MOST = 40000; // samples kept: half an hour at 20 a second
const PI = Math.PI;

/**
 * @typedef {object} Plot
 * @property {string} title
 * @property {string} unit
 * @property {number} measured index into a sample
 * @property {number} [commanded] likewise
 * @property {number} [span] the least range of values that is shown
 * @property {[number, number]} [range] that is always shown
 * @property {boolean} [wraps] an angle
 */

// What is plotted: index into a sample [t, x, y, z, yaw, vx, vy, vz, r, cx, cy, cz, cr].
/** @type {Plot[]} */
const PLOTS = [
  { title: "x", unit: "m", measured: 1, span: 1 },
  { title: "velX", unit: "m/s", measured: 5, commanded: 9, span: 0.4 },
  { title: "y", unit: "m", measured: 2, span: 1 },
  { title: "velY", unit: "m/s", measured: 6, commanded: 10, span: 0.4 },
  { title: "z", unit: "m", measured: 3, span: 1 },
  { title: "velZ", unit: "m/s", measured: 7, commanded: 11, span: 0.4 },
  { title: "yaw", unit: "rad", measured: 4, range: [-PI, PI], wraps: true },
  { title: "rotZ", unit: "rad/s", measured: 8, commanded: 12, span: 0.4 },
];

/** Place and speeds over the last minute: x, y, z, yaw, and what was commanded against what was measured. */
export class Plots {
  #element;
  #plots;
  /** @type {number[][]} */
  #samples = [];
  /** @type {number|null} */
  #until = null;
  #dirty = true;
  /** @type {Object<string, string>} */
  #colours = {};

  /** @param {HTMLElement} element an empty box; its width is followed */
  constructor(element) {
    this.#element = element;
    /** @param {string} look @param {string} words */
    const key = (look, words) => make("span", { class: "m-key", "data-look": look }, words);
    const reach = make("span", { class: "m-reach" }, `the last ${WINDOW_S} s, lines every ${LINES_S} s`);
    const legend = make("p", { class: "m-legend" }, key("measured", "measured"), key("commanded", "commanded"), reach);
    const grid = make("div", { class: "m-plots" });
    element.append(legend, grid);
    this.#readColours();
    this.#plots = PLOTS.map((plot) => this.#add(grid, plot));
    new ResizeObserver(() => this.#fit()).observe(grid);
    onTheme(() => this.#readColours());
    setInterval(() => onBeat(this, () => this.#tick()), REDRAW_MS);
  }

  /**
   * @param {number} t seconds; going back in time starts anew
   * @param {import("../arena/arena.js").Pose} pose with v (forward, left, up, m/s), r (rad/s to the left) and c or null
   */
  add(t, { p, q, v, r, c }) {
    const last = this.#samples.at(-1);
    if (last && t < last[0]) this.#samples = [];
    else if (last && t === last[0]) return;
    const yaw = yawOf(q);
    const sample = [t, ...p, yaw, ...(v ?? [null, null, null]), r ?? null, ...(c ?? [null, null, null, null])];
    this.#samples.push(sample.map((value) => value ?? NaN));
    if (this.#samples.length > MOST) this.#samples.splice(0, MOST / 2);
    this.#dirty = true;
  }

  /** Forget everything. */
  clear() {
    this.#samples = [];
    this.#dirty = true;
  }

  /**
   * Show the minute that ends at a time instead of the newest, for a replay.
   * @param {number|null} t seconds; null: the newest again
   */
  showUntil(t) {
    this.#until = t;
    this.#dirty = true;
  }

  #readColours() {
    const names = ["measured", "commanded", "line", "faint"];
    this.#colours = Object.fromEntries(names.map((name) => [name, themeColour(this.#element, `--${name}`)]));
    this.#dirty = true;
  }

  /** @param {HTMLElement} grid @param {Plot} plot */
  #add(grid, plot) {
    const value = make("output", { "aria-live": "off" });
    const aim = plot.commanded ? make("output", { class: "m-aim", "aria-live": "off", title: "commanded" }) : null;
    const box = make("div", { class: "m-plot", role: "img", "aria-label": `${plot.title} over the last minute, ${plot.unit}` });
    const title = make("span", {}, make("b", {}, plot.title), ` ${plot.unit}`);
    grid.append(make("figure", {}, make("figcaption", {}, title, make("span", {}, aim, " ", value)), box));
    return { ...plot, box, value, aim, chart: new uPlot(this.#options(plot), [[], [], []], box) };
  }

  /** @param {Plot} plot @returns {import("uplot").Options} */
  #options(plot) {
    /** @param {string} look @param {number} width @param {number[]|undefined} dash */
    const line = (look, width, dash) => (
      { stroke: () => this.#colours[look], width, dash, points: { show: false }, spanGaps: false }
    );
    const grid = { stroke: () => this.#colours.line, width: 1 };
    return {
      width: 100, height: 50, padding: [5, 3, 5, 0],
      cursor: { show: false }, legend: { show: false },
      scales: { x: { time: false }, y: { range: (_, low, top) => plot.range ?? rangeOf(low, top, plot) } },
      axes: [
        { size: 0, grid, ticks: { show: false }, values: () => [], splits: (_u, _axis, low, top) => everyLine(low, top) },
        {
          size: 38, gap: 4, grid, ticks: { show: false }, font: "11px system-ui, sans-serif",
          stroke: () => this.#colours.faint,
          splits: (_u, _axis, low, top) => [low, (low + top) / 2, top],
          values: (_u, [low, , top]) => [low, null, top].map((each) => (each === null ? "" : number(each, top - low >= 4 ? 0 : 1))),
        },
      ],
      series: [{}, line("commanded", 1.6, [4, 3]), line("measured", 1.8, undefined)],
    };
  }

  #fit() {
    for (const { box, chart } of this.#plots) {
      if (box.clientWidth > 0) chart.setSize({ width: box.clientWidth, height: box.clientHeight });
    }
    this.#dirty = true;
  }

  #tick() {
    if (!this.#dirty || document.hidden) return;
    this.#dirty = false;
    const end = this.#until ?? this.#samples.at(-1)?.[0] ?? 0;
    const first = this.#index(end - WINDOW_S);
    const last = this.#until === null ? this.#samples.length : this.#index(end + 1e-9);
    const shown = this.#samples.slice(Math.max(0, first - 1), last);
    const newest = shown.at(-1);
    for (const { chart, value, aim, ...plot } of this.#plots) {
      chart.batch(() => {
        chart.setData(columns(shown, plot), false);
        chart.setScale("x", { min: end - WINDOW_S, max: end });
      });
      setText(value, number(newest?.[plot.measured] ?? null, 2));
      const aimed = plot.commanded ? newest?.[plot.commanded] : NaN;
      if (aim) setText(aim, Number.isFinite(aimed) ? number(aimed, 2) : "");
    }
  }

  /** How many samples come before a time. @param {number} t */
  #index(t) {
    let [low, high] = [0, this.#samples.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.#samples[middle][0] < t) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}

/**
 * A plot's times, commanded and measured values; null breaks a line, also where an angle wraps.
 * @param {number[][]} samples
 * @param {Plot} plot
 * @returns {[number[], (number|null)[], (number|null)[]]}
 */
function columns(samples, { measured, commanded, wraps }) {
  /** @type {[number[], (number|null)[], (number|null)[]]} */
  const [times, aims, values] = [[], [], []];
  /** @param {number} value */
  const known = (value) => (Number.isFinite(value) ? value : null);
  for (const sample of samples) {
    const value = known(sample[measured]);
    if (wraps && value !== null && Math.abs(value - (values.at(-1) ?? value)) > PI) {
      times.push(sample[0]);
      aims.push(null);
      values.push(null);
    }
    times.push(sample[0]);
    aims.push(commanded ? known(sample[commanded]) : null);
    values.push(value);
  }
  return [times, aims, values];
}

/** Where the lines of time stand. @param {number} begin @param {number} end */
function everyLine(begin, end) {
  return Array.from({ length: 1 + Math.floor((end - begin) / LINES_S) }, (_, index) => begin + index * LINES_S);
}

/**
 * The least round range that holds all values.
 * @param {number|null} lowest
 * @param {number|null} highest
 * @param {Plot} plot
 * @returns {[number, number]}
 */
function rangeOf(lowest, highest, { commanded, span = 1 }) {
  let [low, top] = [lowest ?? 0, highest ?? 0];
  if (commanded) [low, top] = [Math.min(low, 0), Math.max(top, 0)];
  const missing = Math.max(0, span - (top - low));
  [low, top] = [low - missing / 2, top + missing / 2];
  const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500].find((each) => (top - low) / each <= 6) ?? 1000;
  return [Math.floor(low / step) * step, Math.ceil(top / step) * step];
}
