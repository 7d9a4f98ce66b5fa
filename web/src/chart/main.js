/** The page of the statechart alone. */
import "../lib/flight/flight.css";
import { make } from "../lib/dom.js";
import { Fleet } from "../lib/flight/fleet.js";
import { watchLive } from "../lib/watch_live.js";
import { Statechart } from "../lib/chart/statechart.js";
import { pageRoot } from "../lib/page_data.js";

const root = pageRoot("chart");
root.classList.add("m-chart-page");
const line = make("p", { class: "m-line", role: "status", hidden: true });
const tabs = make("div", { class: "m-tabs small-buttons" });
const body = make("section", { class: "m-panel", "aria-label": "statechart" });
root.append(line, tabs, body);
const statechart = new Statechart(body);

const fleet = new Fleet(tabs, (drone) => {
  statechart.setChart(drone.chart);
  statechart.setTransitions(drone.transitions);
  statechart.setState(drone.status?.mission?.state || null, drone.status?.mission?.seconds);
});
/** @param {number} id */
const isChosen = (id) => fleet.chosen?.id === id;

watchLive({
  pose({ drones }) {
    for (const pose of drones) {
      const drone = fleet.of(pose.id);
      const state = drone.chart?.states[pose.s];
      if (isChosen(pose.id) && state && drone.pose && drone.pose.s !== pose.s) statechart.setState(state, 0);
      drone.pose = pose;
    }
  },
  status({ drones }) {
    fleet.setStatus(drones);
    const mission = fleet.chosen?.status?.mission;
    statechart.setState(mission?.state || null, mission?.seconds);
  },
  chart(message) {
    fleet.of(message.id).chart = message;
    if (isChosen(message.id)) statechart.setChart(message);
  },
  transitions({ id, list }) {
    fleet.of(id).transitions = list;
    if (isChosen(id)) statechart.setTransitions(list);
  },
}, line, (connected) => root.classList.toggle("m-stale", !connected));
