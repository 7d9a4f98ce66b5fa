/** The page of recorded flights: a list, and one or two of them on one clock. */
import "../lib/flight/flight.css";
import "./replay.css";
import { make, setText } from "../lib/dom.js";
import { Bar } from "../lib/replay/bar.js";
import { Clock } from "../lib/replay/clock.js";
import { pageOf, RunList } from "./list.js";
import { Run } from "../lib/replay/run.js";
import { reasonOf, request } from "../lib/request.js";
import { Side } from "./side.js";
import { pageData, pageRoot } from "../lib/page_data.js";

const root = pageRoot("replay");
root.classList.add("m-live", "r-page");
const query = new URLSearchParams(location.search);
const chosen = [...new Set([query.get("a") ?? "", query.get("b") ?? ""].filter(Boolean))];

const line = make("p", { class: "m-line", role: "status", hidden: true });
const sides = make("div", { class: "r-sides" });
const foot = make("div", { class: "r-foot" });
const choice = make("details", { class: "m-panel r-choice", open: chosen.length === 0 });
root.append(line, sides, foot, choice);

/** Say something about the page as a whole; "" takes it away. @param {string} words */
function say(words) {
  setText(line, words);
  line.hidden = words === "";
}

async function list() {
  const hint = "No flight is recorded yet. Fly one: framerunner fly test-case-1. Then load this page again.";
  const without = "This monitor was given no folder of flights. Start it with --runs FOLDER; framerunner fly leaves its flights in runs/.";
  if (!pageData().hasRuns) return choice.append(make("summary", {}, "Flights"), make("p", { class: "r-none" }, without));
  try {
    /** @type {import("./list.js").RunInfo[]} */
    const runs = await request("/api/runs");
    choice.append(make("summary", {}, chosen.length ? "Choose another flight, or one to see beside" : "Choose a flight"));
    if (runs.length) new RunList(choice, runs, chosen);
    else choice.append(make("p", { class: "r-none" }, hint));
  } catch (error) {
    choice.append(make("summary", {}, "Flights"), make("p", { class: "r-none", role: "alert" }, reasonOf(error)));
  }
}

/** Keep the address a link to what is seen now. @param {Clock} clock @param {string[]} names */
function keepAddress(clock, names) {
  let last = "";
  let soon = 0;
  const write = () => {
    const address = `${pageOf(.../** @type {[string, string?]} */ (names))}&t=${clock.t.toFixed(1)}`;
    if (address !== last) history.replaceState(null, "", address);
    last = address;
  };
  clock.listen(() => {
    if (clock.isPlaying) return;
    clearTimeout(soon);
    soon = setTimeout(write, 400);
  });
}

async function show() {
  if (chosen.length === 0) return;
  say("reading the flight; one in lockstep is flown again for this, which takes some seconds");
  const read = await Promise.allSettled(chosen.map((name) => Run.fetch(name)));
  say(read.filter((each) => each.status === "rejected").map((each) => each.reason.message).join("; "));
  const runs = read.filter((each) => each.status === "fulfilled").map((each) => each.value).filter((run) => run.poses.length > 0);
  if (runs.length === 0) {
    choice.open = true;
    if (line.hidden) say("there is nothing to show of this flight: it has no place at any time");
    return;
  }
  const clock = new Clock();
  clock.setSpan(Math.min(...runs.map((run) => run.begin)), Math.max(...runs.map((run) => run.end)));
  const asked = Number.parseFloat(query.get("t") ?? "");
  clock.seek(Number.isFinite(asked) ? asked : Math.max(clock.begin, Math.min(0, clock.end)));
  sides.dataset.count = String(runs.length);
  const shown = runs.map((run, index) => new Side(sides, run, runs.length > 1 ? "AB"[index] : ""));
  clock.listen(({ t }) => shown.forEach((side) => side.show(t)));
  new Bar(foot, clock, runs);
  keepAddress(clock, runs.map((run) => run.name));
  shown.forEach((side) => side.show(clock.t));
  root.dataset.ready = "true";
}

await Promise.all([list(), show()]);
root.dataset.listed = "true";
