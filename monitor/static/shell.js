/** The words and the dot in the header: whether drones and monitor are reached. */

import { LiveChannel } from "./channel.js";

/**
 * How the link is, in words.
 * @param {{link: {state: string}}[]} drones of the message "status"
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

const place = document.getElementById("link");

/** Shows it; a change is told to screen readers, the same again is not. */
function show([state, words]) {
  const element = place.querySelector(".words");
  place.dataset.state = state;
  if (element.textContent !== words) element.textContent = words;
}

// On a phone the navigation is a row that is moved sideways: begin where we are.
const here = document.querySelector(".top nav [aria-current]");
if (here) here.closest("nav").scrollLeft = here.offsetLeft - 40;

if (place) {
  const channel = new LiveChannel(["status"]);
  channel.on("status", (message) => show(linkWords(message.drones)));
  channel.onState((state) => {
    if (state === "away") show(["away", "reconnecting"]);
  });
}
