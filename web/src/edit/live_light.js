/** Lights the chart of a mission that a drone flies now, as the live channel tells it. */
import { LiveChannel } from "../lib/live_channel.js";

/**
 * @param {() => string} name of the mission that is shown
 * @param {(active: string[], counts: Object<string, number>) => void} light told the active states, and how often
 *   transitions were taken, when they change; none when nobody flies it
 */
export function watchFlights(name, light) {
  const channel = new LiveChannel(["pose", "chart", "status", "guards"]);
  /** @type {Map<number, {name: string, states: string[]}>} */
  const charts = new Map();
  let shown = "";
  /** @type {Object<string, number>} */
  let counts = {};
  const show = (state) => {
    if (state === shown) return;
    shown = state;
    if (state === "") counts = {};
    light(state === "" ? [] : state.split(".").map((_, index, parts) => parts.slice(0, index + 1).join(".")), counts);
  };
  channel.on("guards", (message) => {
    if (charts.get(message.id)?.name === name()) counts = message.counts;
  });
  channel.on("chart", (chart) => charts.set(chart.id, chart));
  channel.on("pose", ({ drones }) => {
    const drone = drones.find(({ id, s }) => s >= 0 && charts.get(id)?.name === name());
    if (drone) show(charts.get(drone.id)?.states[drone.s] ?? "");
  });
  channel.on("status", ({ drones }) => {
    const isFlown = drones.some(({ mission }) => mission?.name === name() && mission.alive);
    if (!isFlown) show("");
  });
}
