/** The live page: joins the live channel with what is seen. */
import "../lib/flight/flight.css";
import { Arena } from "../lib/arena/arena.js";
import { mapIn } from "../lib/arena/map.js";
import { onBeat } from "../lib/beat.js";
import { CameraView } from "../lib/flight/camera.js";
import { stateColour } from "../lib/colours.js";
import { nameOf, orDash } from "../lib/contest/words.js";
import { interruptedFigures, tryOf, watchContest } from "../lib/contest/contest.js";
import { make } from "../lib/dom.js";
import { Figures } from "../lib/flight/figures.js";
import { Fleet } from "../lib/flight/fleet.js";
import { Flight, isFlying } from "../lib/flight/flight.js";
import { Messages } from "./messages.js";
import { Plots } from "../lib/flight/plots.js";
import { watchLive } from "../lib/watch_live.js";
import { Statechart } from "../lib/chart/statechart.js";
import { DroneStrip } from "./strip.js";
import { pageRoot } from "../lib/page_data.js";

/**
 * @import {Known} from "../lib/flight/fleet.js"
 * @import {FlownTry} from "../competition/answers"
 * @import {Contest as Views, Live} from "../lib/messages.js"
 * @typedef {Pick<Known, "id"|"status"|"chart"> & {pose?: Known["pose"]}} Looked
 */

const MOST_RECENT = 2000; // poses: more than the minute that is plotted

const root = pageRoot("live");
root.classList.add("m-live");

/**
 * A part of the page with a heading.
 * @param {HTMLElement} place @param {string} name @param {string} title
 */
function panel(place, name, title) {
  const body = make("div", { class: "m-body" });
  const section = make("section", { class: `m-panel m-${name}-panel`, "aria-labelledby": `m-${name}` }, make("h2", { id: `m-${name}` }, title), body);
  place.append(section);
  return body;
}

const line = make("p", { class: "m-line", role: "status", hidden: true });
const tabs = make("div", { class: "m-tabs small-buttons" });
const top = make("div", { class: "m-top" });
const side = make("div", { class: "m-side" });
const grid = make("div", { class: "m-grid" });
root.append(line, tabs, grid);
grid.append(top);

const team = make("p", { class: "m-team", hidden: true });
const strip = new DroneStrip(top);
const figuresBody = panel(side, "figures", "The try");
figuresBody.append(team);
const figures = new Figures(figuresBody);
const arena = new Arena(panel(grid, "arena", "Arena"));
const camera = new CameraView(panel(grid, "camera", "Camera"));
const plots = new Plots(panel(grid, "plots", "Place and speeds"));
const statechart = new Statechart(panel(grid, "chart", "Statechart"), { small: true });
grid.append(side);
const messages = new Messages(panel(side, "messages", "Messages"));

let isConnected = false;
/** @type {import("../lib/contest/contest.js").Contest} */
let contest = { running: [], stage: null };
/** @type {Map<string[], string[]>} */
const orders = new Map();

/** Kinds of a mission's states, in the order in which they stand in it. @param {string[]} states */
function orderOf(states) {
  if (!orders.has(states)) {
    /** @type {string[]} */
    const order = [];
    for (const state of states) stateColour(state, order);
    orders.set(states, order);
  }
  return /** @type {string[]} */ (orders.get(states));
}

/** The state at once, numbers with the next beat. @param {Looked} drone */
function showStatus(drone) {
  const { status } = drone;
  const state = status?.mission?.state || null;
  // A new state comes with a pose; the status may be behind that.
  const isAhead = drone.pose?.fresh && drone.chart?.states[drone.pose.s] && state !== statechart.active;
  if (!isAhead) statechart.setState(state, status?.mission?.seconds ?? 0);
  onBeat(strip, () => {
    strip.set(status, drone.chart ? orderOf(drone.chart.states) : []);
    figures.set(status?.figures ?? interruptedFigures(contest, drone.id), status ?? undefined);
    showTeam(drone);
    root.classList.toggle("m-flying", isFlying(status));
  });
}

/** Whose try it is, if the contest knows. @param {Looked} drone */
function showTeam(drone) {
  const flown = /** @type {Views.RunningView|FlownTry|null} */ (tryOf(contest, drone.id));
  team.hidden = !flown?.team_name;
  const shown = `${flown?.id} ${flown?.team_name}`;
  if (team.hidden || team.dataset.shown === shown) return;
  team.dataset.shown = shown;
  team.replaceChildren(nameOf(/** @type {FlownTry} */ (flown).team_name, { class: "m-team-name" }),
    make("span", { class: "m-team-where" }, orDash(/** @type {FlownTry} */ (flown).scenario)));
}

const flight = new Flight(arena, camera, {
  states: () => fleet.states(),
  passed(pose) {
    const drone = fleet.of(pose.id);
    const last = drone.recent.at(-1);
    if (last && pose.t <= last.t && pose.t > last.t - 0.5) return; // the history had it
    if (last && pose.t < last.t) drone.recent = [];
    drone.recent.push(pose);
    if (drone.recent.length > MOST_RECENT) drone.recent.splice(0, MOST_RECENT / 4);
    if (isChosen(pose.id)) plots.add(pose.t, pose); // begins anew by itself when time goes back
  },
});

/** @param {Known} drone */
function plot(drone) {
  plots.clear();
  for (const pose of drone.recent) plots.add(pose.t, pose);
}

/** @param {Known} drone */
function choose(drone) {
  arena.select(drone.id);
  arena.setMap(drone.map);
  plot(drone);
  statechart.setChart(drone.chart);
  statechart.setTransitions(drone.transitions);
  flight.choose(drone.id);
  flight.setStatus(drone.status);
  showStatus(drone);
}

const fleet = new Fleet(tabs, choose);
/** @param {number} id */
const isChosen = (id) => fleet.chosen?.id === id;
/** @type {Live.World|null} */
let world = null;

watchLive({
  world(message) {
    if (JSON.stringify(message) === JSON.stringify(world)) return; // told again after a loss
    world = message;
    arena.setWorld(message);
  },
  history(message) {
    const drone = fleet.of(message.id);
    drone.recent = flight.setHistory(message);
    if (isChosen(message.id)) plot(drone);
  },
  pose({ drones }) {
    for (const pose of drones) {
      const drone = fleet.of(pose.id);
      drone.pose = pose;
      // The state travels with the pose, and is lit at once: it is news, and no part of the picture.
      const state = drone.chart?.states[pose.s];
      if (isChosen(pose.id) && state && state !== statechart.active) statechart.setState(state, 0);
    }
    flight.addPoses(drones);
  },
  status({ drones }) {
    fleet.setStatus(drones);
    messages.setSeveral(fleet.several);
    flight.setStatus(fleet.chosen?.status ?? null);
    showStatus(fleet.chosen ?? { id: 0, status: null, chart: null });
  },
  detections(message) {
    if (isChosen(message.id)) flight.addDetections(message);
  },
  map(message) {
    const drone = fleet.of(message.id);
    drone.map = mapIn(message);
    if (isChosen(message.id)) arena.setMap(drone.map);
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

watchContest((known) => {
  contest = known;
  if (fleet.chosen) showStatus(fleet.chosen);
});

// The height that is left below the frame of the page: on a large screen everything has its place in it.
const frame = document.querySelector(".top") ?? root;
new ResizeObserver(() => root.style.setProperty("--above", `${root.getBoundingClientRect().top + scrollY}px`)).observe(frame);

setInterval(() => {
  const { pose, status } = fleet.chosen ?? {};
  root.classList.toggle("m-old", !isConnected || (pose?.fresh === false && !status?.over));
}, 500);
