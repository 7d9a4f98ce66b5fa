/** The words and the dot in the header: whether drones and monitor are reached. */

import "./shell.css";
import { LiveChannel } from "../lib/live_channel.js";

/**
 * How the link is, in words.
 * @param {{link?: {state: string}, over?: boolean}[]} drones of the message "status"
 * @returns {[string, string]} state and words
 */
export function linkWords(drones) {
  if (!drones.length) return ["lost", "no drone"];
  if (drones.every((drone) => drone.over && drone.link?.state !== "live")) return ["over", "flight over"];
  const live = drones.filter((drone) => drone.link?.state === "live").length;
  if (live === drones.length) return ["live", "live"];
  if (drones.length === 1) return ["lost", "link lost"];
  return ["lost", `link lost: ${drones.length - live} of ${drones.length}`];
}

/**
 * Load the page again after the monitor was restarted: its scripts may be other ones, and a log-in may have ended.
 * A page with work that is not saved keeps itself by `preventDefault` of the event "monitor-restarted".
 */
async function reloadIfRestarted() {
  const known = document.documentElement.dataset.instance;
  const answer = await fetch("/api/instance", { cache: "no-store" }).catch(() => null);
  if (!answer?.ok || (await answer.json()).instance === known) return;
  if (document.dispatchEvent(new Event("monitor-restarted", { cancelable: true }))) location.reload();
}

/** @type {Record<string, string>} */
const SPANISH = { "no drone": "sin dron", "flight over": "vuelo acabado", "live": "en vivo", "link lost": "enlace perdido", "reconnecting": "conectando de nuevo" };

/**
 * Shows the link; a change is told to screen readers, the same again is not.
 * @param {[string, string]} link state and words
 */
function show([state, words]) {
  const place = document.getElementById("link"); // a page for a projector has no header
  if (!place) return;
  const element = place.querySelector(".words");
  place.dataset.state = state;
  const said = document.documentElement.lang === "es" ? SPANISH[words] ?? words.replace("link lost", SPANISH["link lost"]).replace(" of ", " de ") : words; // few pages have two languages
  if (element && element.textContent !== said) element.textContent = said;
}

// On a narrow screen the navigation is a row that is moved sideways: begin where we are.
const here = /** @type {HTMLElement|null} */ (document.querySelector(".top nav [aria-current]"));
const row = here?.closest("nav");
if (here && row) row.scrollLeft = here.offsetLeft - row.offsetLeft - 40;

let wasAway = false;
const channel = new LiveChannel(["status"]);
channel.on("status", (message) => show(linkWords(message.drones)));
channel.onState((state) => {
  if (state === "away") show(["away", "reconnecting"]);
  else if (wasAway) reloadIfRestarted();
  wasAway = state === "away";
});
