import { onBeat } from "../beat.js";
import { make, number, onTheme, setText, themeColour } from "../dom.js";

const WINDOW_S = 60;
const REDRAW_MS = 220;
const MOST = 40000; // samples kept: half an hour at 20 a second
const PI = Math.PI;

// What is plotted: index into a sample [t, x, y, z, yaw, vx, vy, vz, r, cx, cy, cz, cr].
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
  #samples = [];
  #until = null;
  #dirty = true;
  #colours = null;

  /** @param {HTMLElement} element an empty box; its width is followed */
  constructor(element) {
    this.#element = element;
    const key = (look, words) => make("span", { class: "m-key", "data-look": look }, words);
    const reach = make("span", { class: "m-reach" }, `the last ${WINDOW_S} s, lines every 15 s`);
    const legend = make("p", { class: "m-legend" }, key("measured", "measured"), key("commanded", "commanded"), reach);
    const grid = make("div", { class: "m-plots" });
    this.#plots = PLOTS.map((plot) => this.#add(grid, plot));
    element.append(legend, grid);
    const redraw = () => { this.#dirty = true; this.#colours = null; };
    new ResizeObserver(redraw).observe(grid);
    onTheme(redraw);
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
    const [w, x, y, z] = q;
    const yaw = Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
    this.#samples.push([t, ...p, yaw, ...(v ?? [NaN, NaN, NaN]), r ?? NaN, ...(c ?? [NaN, NaN, NaN, NaN])]);
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

  #add(grid, plot) {
    const value = make("output", { "aria-live": "off" });
    const aim = plot.commanded ? make("output", { class: "m-aim", "aria-live": "off", title: "commanded" }) : null;
    const canvas = make("canvas", { role: "img", "aria-label": `${plot.title} over the last minute, ${plot.unit}` });
    const title = make("span", {}, make("b", {}, plot.title), ` ${plot.unit}`);
    grid.append(make("figure", {}, make("figcaption", {}, title, make("span", {}, aim, " ", value)), canvas));
    return { ...plot, canvas, value, aim };
  }

  #tick() {
    if (!this.#dirty || document.hidden) return;
    this.#dirty = false;
    this.#colours ??= {
      measured: themeColour(this.#element, "--measured"),
      commanded: themeColour(this.#element, "--commanded"),
      line: themeColour(this.#element, "--line"),
      faint: themeColour(this.#element, "--faint"),
    };
    const end = this.#until ?? this.#samples.at(-1)?.[0] ?? 0;
    const first = this.#index(end - WINDOW_S);
    const last = this.#until === null ? this.#samples.length : this.#index(end + 1e-9);
    const shown = this.#samples.slice(Math.max(0, first - 1), last);
    for (const plot of this.#plots) this.#draw(plot, shown, end);
  }

  /** How many samples come before a time. */
  #index(t) {
    let [low, high] = [0, this.#samples.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.#samples[middle][0] < t) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  #draw(plot, shown, end) {
    const { canvas } = plot;
    const { clientWidth: width, clientHeight: height } = canvas;
    if (width === 0) return;
    const ratio = Math.min(2, devicePixelRatio || 1);
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
    const pen = canvas.getContext("2d", { willReadFrequently: true });
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const [low, top] = plot.range ?? rangeOf(shown, plot);
    const [left, upper, lower] = [38, 5, height - 5];
    const toX = (t) => left + ((t - end + WINDOW_S) / WINDOW_S) * (width - left - 3);
    const toY = (value) => lower - ((value - low) / (top - low)) * (lower - upper);
    this.#drawGrid(pen, { low, top, width, left, upper, lower, toY });
    if (plot.commanded) this.#drawLine(pen, shown, plot.commanded, toX, toY, "commanded", left, false);
    this.#drawLine(pen, shown, plot.measured, toX, toY, "measured", left, plot.wraps);
    const newest = shown.at(-1);
    setText(plot.value, number(newest?.[plot.measured] ?? null, 2));
    if (plot.aim) setText(plot.aim, newest && Number.isFinite(newest[plot.commanded]) ? number(newest[plot.commanded], 2) : "");
  }

  #drawGrid(pen, { low, top, width, left, upper, lower, toY }) {
    pen.strokeStyle = this.#colours.line;
    pen.lineWidth = 1;
    pen.setLineDash([]);
    pen.beginPath();
    for (const value of [low, (low + top) / 2, top]) {
      const y = Math.round(toY(value)) + 0.5;
      pen.moveTo(left, y);
      pen.lineTo(width, y);
    }
    for (let share = 0; share <= 4; share += 1) {
      const x = Math.round(left + (share / 4) * (width - left - 3)) + 0.5;
      pen.moveTo(x, upper);
      pen.lineTo(x, lower);
    }
    pen.stroke();
    pen.fillStyle = this.#colours.faint;
    pen.font = "11px system-ui, sans-serif";
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const decimals = top - low >= 4 ? 0 : 1;
    pen.fillText(number(top, decimals), left - 5, upper + 4);
    pen.fillText(number(low, decimals), left - 5, lower - 4);
  }

  #drawLine(pen, shown, index, toX, toY, look, left, wraps) {
    pen.save();
    pen.beginPath();
    pen.rect(left, 0, 1e4, 1e4);
    pen.clip();
    pen.beginPath();
    let before = NaN;
    for (const sample of shown) {
      const value = sample[index];
      if (Number.isFinite(value)) {
        const isBroken = !Number.isFinite(before) || (wraps && Math.abs(value - before) > PI);
        if (isBroken) pen.moveTo(toX(sample[0]), toY(value));
        else pen.lineTo(toX(sample[0]), toY(value));
      }
      before = value;
    }
    pen.strokeStyle = this.#colours[look];
    pen.lineWidth = look === "measured" ? 1.8 : 1.6;
    pen.setLineDash(look === "measured" ? [] : [4, 3]);
    pen.lineJoin = "round";
    pen.stroke();
    pen.restore();
  }
}

/** The least round range that holds all values. */
function rangeOf(shown, { measured, commanded, span }) {
  let [low, top] = [Infinity, -Infinity];
  for (const sample of shown) {
    for (const index of commanded ? [measured, commanded] : [measured]) {
      const value = sample[index];
      if (value < low) low = value;
      if (value > top) top = value;
    }
  }
  if (low > top) [low, top] = [0, 0];
  if (commanded) [low, top] = [Math.min(low, 0), Math.max(top, 0)];
  const missing = Math.max(0, span - (top - low));
  [low, top] = [low - missing / 2, top + missing / 2];
  const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500].find((each) => (top - low) / each <= 6) ?? 1000;
  return [Math.floor(low / step) * step, Math.ceil(top / step) * step];
}
