/** Lights the chart of a mission that a drone flies now, as the live channel tells it. */
import { LiveChannel } from "../lib/live_channel.js";
import { yawOf } from "../lib/yaw.js";
import { withOuterStates } from "./flights.js";

/**
 * @param {() => string} name of the mission that is shown
 * @param {{light: (active: string[], counts: Object<string, number>) => void, moved: (place: number[], t: number, state: string) => void,
 *   world: (scenario: any) => void}} listener light: told the active states, and how often transitions were taken, when
 *   they change; none when nobody flies it. moved: where the drone that flies it is: x, y, z and yaw. world: the scenario that is flown
 */
export function watchFlights(name, listener) {
  const channel = new LiveChannel(["pose", "chart", "status", "guards", "world"]);
  /** @type {Map<number, {name: string, states: string[]}>} */
  const charts = new Map();
  let shown = "";
  /** @type {Object<string, number>} */
  let counts = {};
  /** @param {string} state "": nobody flies it */
  const show = (state) => {
    if (state === shown) return;
    shown = state;
    if (state === "") counts = {};
    listener.light(withOuterStates(state), counts);
  };
  channel.on("guards", (message) => {
    if (charts.get(message.id)?.name === name()) counts = message.counts;
  });
  channel.on("chart", (chart) => charts.set(chart.id, chart));
  channel.on("world", ({ scenario }) => listener.world(scenario));
  channel.on("pose", ({ drones }) => {
    const drone = drones.find(({ id, s }) => s >= 0 && charts.get(id)?.name === name());
    if (!drone) return;
    const state = charts.get(drone.id)?.states[drone.s] ?? "";
    show(state);
    if (drone.fresh) listener.moved([...drone.p, yawOf(drone.q)], drone.t, state);
  });
  channel.on("status", ({ drones }) => {
    const isFlown = drones.some(({ mission }) => mission?.name === name() && mission.alive);
    if (!isFlown) show("");
  });
}
