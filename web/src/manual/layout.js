/** Makes the page's elements; what they do is `main.js`'s. */

import { make } from "../lib/dom.js";
import { AXES } from "./values.js";

const ORDERS = [
  ["arm", "Arm"],
  ["take_off", "Take off"],
  ["hold", "Hold"],
  ["land", "Land"],
  ["disarm", "Disarm"],
];
const FIGURES = ["mode", "motors", "height", "speed", "battery", "link"];
const ENDS = { forward: "Forward", right: "Right", up: "Up", yaw: "Turn" };
const HELP = [
  ["↑ ↓", "forward, back"],
  ["← →", "left, right"],
  ["W S", "up, down"],
  ["A D", "turn left, right"],
  ["+ −", "top speed"],
  ["Space", "hold"],
  ["Esc", "give the sticks back"],
  ["Gamepad", "left stick: up, turn; right stick: forward, right; A take, B give back, X hold"],
];

/**
 * @typedef {<E extends HTMLElement>(name: string, element: E) => E} Keep an element as a part of the page
 * @typedef {(name: string, words: string) => HTMLButtonElement} MakeButton
 */

/**
 * Fill the page.
 * @param {HTMLElement} root
 * @returns {Object<string, any>} the parts, which are elements, by name
 */
export function layOut(root) {
  /** @type {Object<string, any>} */
  const parts = {};
  /** @type {Keep} */
  const keep = (name, element) => {
    parts[name] = element;
    return element;
  };
  /** @type {MakeButton} */
  const button = (name, words) => keep(name, make("button", { type: "button" }, words));
  root.append(
    make(
      "section",
      { class: "p-state", "aria-label": "Who flies" },
      make(
        "p",
        { class: "p-who", role: "status" },
        keep("head", make("strong")),
        keep("words", make("span")),
      ),
      keep("choice", make("label", { class: "p-drone" }, "Drone ", keep("drone", make("select")))),
      make(
        "div",
        { class: "p-switch", role: "group", "aria-label": "Who has the sticks" },
        button("give", "Automatic"),
        button("take", "Manual"),
      ),
    ),
    keep("log", make("ol", { class: "p-log", role: "log", "aria-label": "Messages" })),
    make(
      "div",
      { class: "p-views" },
      keep("camera", make("div", { class: "p-camera" })),
      keep("arena", make("div", { class: "p-arena", role: "img", "aria-label": "The drone in the arena" })),
    ),
    keep("left", make("div", { class: "p-left" })),
    keep("right", make("div", { class: "p-right" })),
    make("section", { class: "p-middle", "aria-label": "Drone" }, figures(keep), orders(button), keep("stop", make("div"))),
    make("section", { class: "p-sent", "aria-label": "What is sent" }, sent(keep), speed(keep)),
    help(),
  );
  return parts;
}

/** @param {Keep} keep */
function figures(keep) {
  const list = make("dl", { class: "p-figures" });
  for (const name of FIGURES) {
    list.append(make("div", {}, make("dt", {}, name), keep(`figure-${name}`, make("dd", {}, "–"))));
  }
  return list;
}

/** @param {MakeButton} button */
function orders(button) {
  const row = make("div", { class: "p-orders", role: "group", "aria-label": "Orders" });
  for (const [what, words] of ORDERS) row.append(button(what, words));
  return row;
}

/** @param {Keep} keep */
function sent(keep) {
  const table = make("div", { class: "p-bars" });
  for (const axis of AXES) {
    table.append(
      make("span", { class: "name" }, ENDS[axis]),
      make("span", { class: "bar", "aria-hidden": "true" }, keep(`bar-${axis}`, make("i"))),
      keep(`value-${axis}`, make("output", { "data-axis": axis }, "0.00")),
    );
  }
  table.append(make("span", { class: "name" }, "Input"), keep("input", make("span", { class: "p-input" }, "–")));
  return table;
}

/** @param {Keep} keep */
function speed(keep) {
  const slider = make("input", { type: "range", min: "5", max: "100", step: "5", value: "15", id: "top-speed" });
  return make(
    "p",
    { class: "p-speed" },
    make("label", { for: "top-speed" }, "Top speed"),
    keep("speed", slider),
    keep("speedShown", make("output", { for: "top-speed" }, "15 %")),
  );
}

function help() {
  const list = make("dl");
  for (const [keys, words] of HELP) list.append(make("dt", {}, keys), make("dd", {}, words));
  return make("details", { class: "p-help" }, make("summary", {}, "Keys and gamepad"), list);
}
