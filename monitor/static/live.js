/** The live page: joins the live channel with what is seen. */
import { Arena } from "./arena.js";
import { onBeat } from "./beat.js";
import { CameraView } from "./camera.js";
import { stateColour } from "./colours.js";
import { make, whenThere } from "./dom.js";
import { Figures } from "./figures.js";
import { Fleet } from "./fleet.js";
import { Messages } from "./messages.js";
import { Plots } from "./plots.js";
import { watchLive } from "./socket.js";
import { Statechart } from "./statechart.js";
import { DroneStrip } from "./strip.js";

const OLD_IMAGE_MS = 1000; // boxes of an image older than this are not drawn any more

const root = await whenThere("#live");
root.classList.add("m-live");

/** A part of the page with a heading. */
function panel(name, title) {
  const body = make("div", { class: "m-body" });
  const section = make("section", { class: `m-panel m-${name}-panel`, "aria-labelledby": `m-${name}` }, make("h2", { id: `m-${name}` }, title), body);
  grid.append(section);
  return body;
}

const line = make("p", { class: "m-line", role: "status", hidden: true });
const tabs = make("div", { class: "m-tabs" });
const top = make("div", { class: "m-top" });
const grid = make("div", { class: "m-grid" });
root.append(line, tabs, grid);
grid.append(top);

const strip = new DroneStrip(top);
const figures = new Figures(panel("figures", "The try"));
const arena = new Arena(panel("arena", "Arena"));
const camera = new CameraView(panel("camera", "Camera"));
const plots = new Plots(panel("plots", "Place and speeds"));
const statechart = new Statechart(panel("chart", "Statechart"), { small: true });
const messages = new Messages(panel("messages", "Messages"));

let isConnected = false;
const orders = new Map();

/** Kinds of a mission's states, in the order in which they stand in it. */
function orderOf(states) {
  if (!orders.has(states)) {
    const order = [];
    for (const state of states) stateColour(state, order);
    orders.set(states, order);
  }
  return orders.get(states);
}

/** The state at once, numbers with the next beat. */
function showStatus(drone) {
  const { status } = drone;
  statechart.setState(status?.mission?.state || null, status?.mission?.seconds ?? 0);
  camera.setImage(status?.video ? `/video/${drone.id}` : null);
  onBeat(strip, () => {
    strip.set(status, drone.chart ? orderOf(drone.chart.states) : []);
    figures.set(status?.figures ?? null, status ?? undefined);
  });
}

function choose(drone) {
  arena.select(drone.id);
  plots.clear();
  statechart.setChart(drone.chart);
  statechart.setTransitions(drone.transitions);
  camera.setDetections(drone.detections);
  showStatus(drone);
}

const fleet = new Fleet(tabs, choose);
const isChosen = (id) => fleet.chosen?.id === id;
let world = null;

watchLive({
  world(message) {
    if (JSON.stringify(message) === JSON.stringify(world)) return; // told again after a loss
    world = message;
    arena.setWorld(message);
  },
  pose({ drones }) {
    for (const pose of drones) {
      const drone = fleet.of(pose.id);
      // The state travels with the pose, so that a new one is lit at once and not with the next status.
      const state = drone.chart?.states[pose.s];
      if (isChosen(pose.id) && state && drone.pose && drone.pose.s !== pose.s) statechart.setState(state, 0);
      const isRestarted = drone.pose !== null && pose.t < drone.pose.t - 0.5;
      drone.pose = pose;
      if (!isChosen(pose.id)) continue;
      if (isRestarted) plots.clear();
      plots.add(pose.t, pose);
    }
    arena.setPoses(drones, fleet.states());
  },
  status({ drones }) {
    fleet.setStatus(drones);
    messages.setSeveral(fleet.several);
    if (fleet.chosen) showStatus(fleet.chosen);
    else showStatus({ id: 0, status: null, chart: null });
  },
  detections(message) {
    const drone = fleet.of(message.id);
    drone.detections = message;
    drone.detectedAt = performance.now();
    if (isChosen(message.id)) camera.setDetections(message);
  },
  chart(message) {
    const drone = fleet.of(message.id);
    const isSame = JSON.stringify(drone.chart) === JSON.stringify(message);
    if (!isSame) drone.chart = message;
    if (isChosen(message.id)) statechart.setChart(drone.chart);
  },
  transitions({ id, list }) {
    fleet.of(id).transitions = list;
    if (isChosen(id)) statechart.setTransitions(list);
  },
  text: (message) => messages.addText(message),
  notice: (message) => messages.addNotice(message),
}, line, (connected) => {
  isConnected = connected;
  root.classList.toggle("m-stale", !connected);
  if (connected) messages.clear(); // the last ones are sent again
});

setInterval(() => {
  const drone = fleet.chosen;
  if (!drone || document.hidden) return;
  if (drone.detections && performance.now() - drone.detectedAt > OLD_IMAGE_MS) {
    drone.detections = null;
    camera.setDetections(null);
  }
  root.classList.toggle("m-old", !isConnected || drone.pose?.fresh === false);
}, 500);
