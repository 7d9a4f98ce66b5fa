/** The page on which pictures are labelled: four clicks a frame, and what they say at once. */
import "./label.css";
import { isTyping, make, number, setText } from "../lib/dom.js";
import { pageRoot } from "../lib/page_data.js";
import { reasonOf, request } from "../lib/request.js";
import { ordered, PictureView } from "./view.js";

/**
 * @typedef {[number, number]} Place column and row; whole numbers are the middles of pixels
 * @typedef {{colour: string, corners: Place[], whole: boolean}} Gate
 * @typedef {{problem: string, distance_m: number|null, angle_deg: number|null, error_px: number|null, outlines: Place[][]}} Shown
 * @typedef {{image: string, frames: Gate[]|null}} Picture
 */

const COLOURS = ["red", "green", "blue", "cyan", "magenta"];
const CORNERS = ["upper left", "upper right", "lower right", "lower left"];

const root = pageRoot("label");
root.classList.add("l-page");
const list = make("ul", { class: "l-list panel", "aria-label": "Pictures" });
const line = make("p", { class: "l-say", role: "status" });
const canvas = make("canvas", { tabindex: "0", "aria-label": "The picture: click the four corners of a frame" });
const colourChoice = choiceOf("red");
const gatesList = make("div", { class: "l-gates", "aria-label": "Frames in this picture" });
const none = make("button", { type: "button" }, "No frame in this picture");
const [smaller, larger] = [make("button", { type: "button", "aria-label": "Smaller" }, "−"), make("button", { type: "button", "aria-label": "Larger" }, "+")];
const [previous, next] = [make("button", { type: "button" }, "Previous"), make("button", { type: "button" }, "Next")];
root.append(
  list,
  make("div", { class: "l-middle" },
    make("div", { class: "l-bar" }, previous, next, smaller, larger, make("label", {}, "Next frame: ", colourChoice), none),
    line, make("div", { class: "l-view" }, canvas)),
  gatesList,
);

/** @type {Picture[]} */
let pictures = [];
let cornersOf = "outline";
let at = 0;
/** @type {Gate[]} */
let gates = [];
/** @type {Shown[]} */
let shown = [];
/** @type {Place[]} */
let begun = [];
let sent = 0; // the last of the changes that were sent; answers of those before it are old

const view = new PictureView(canvas, {
  click: (place) => {
    begun.push(place);
    if (begun.length < CORNERS.length) return draw();
    gates.push({ colour: colourChoice.value, corners: ordered(begun), whole: true });
    begun = [];
    return keep();
  },
  moved: (gate, corner, place) => {
    gates[gate].corners[corner] = place;
    draw();
  },
  released: () => keep(),
});

/** A choice of colours. @param {string} chosen */
function choiceOf(chosen) {
  const choice = make("select", {}, ...COLOURS.map((name) => make("option", { value: name }, name)));
  choice.value = chosen;
  return choice;
}

/** What to do next, or what went wrong. @param {string} [problem] */
function say(problem = "") {
  const which = cornersOf === "opening" ? "inner" : "outer";
  const words = begun.length
    ? `Click ${CORNERS.length - begun.length} more. Escape begins again.`
    : `Click the four ${which} corners of a frame, also those that are hidden. Drag a corner to move it.`;
  setText(line, problem || words);
  line.classList.toggle("problem", problem !== "");
}

function draw() {
  view.draw(gates, shown, begun);
  say();
}

/** Write the frames of this picture, and show what their corners say. */
async function keep() {
  const [mine, picture] = [++sent, at];
  draw();
  try {
    const answer = await request(`/api/pictures/${picture}`, { frames: gates });
    pictures[picture].frames = gates.filter((_, k) => !answer.shown[k].problem);
    if (mine === sent) show(answer.shown);
  } catch (error) {
    say(reasonOf(error));
  }
}

/** @param {Shown[]} said */
function show(said) {
  shown = said;
  gatesList.replaceChildren(...gates.map((gate, k) => gatePanel(gate, k)));
  if (!gates.length) gatesList.append(make("p", { class: "hint" }, pictures[at].frames ? "Labelled: no frame is in this picture." : "Not labelled yet."));
  listPictures();
  draw();
}

/** @param {Gate} gate @param {number} k its place */
function gatePanel(gate, k) {
  const choice = choiceOf(gate.colour);
  const whole = make("input", { type: "checkbox" });
  whole.checked = gate.whole;
  const remove = make("button", { type: "button" }, "Remove");
  choice.addEventListener("change", () => {
    gate.colour = choice.value;
    keep();
  });
  whole.addEventListener("change", () => {
    gate.whole = whole.checked;
    keep();
  });
  remove.addEventListener("click", () => {
    gates.splice(k, 1);
    keep();
  });
  const row = make("div", { class: "l-row" }, choice, make("label", {}, whole, " wholly in view"), remove);
  return make("div", { class: "l-gate panel" }, row, poseLine(shown[k]));
}

/** @param {Shown|undefined} one */
function poseLine(one) {
  if (!one) return null;
  if (one.problem) return make("p", { class: "l-pose problem" }, `Not written: ${one.problem}`);
  return make("p", { class: "l-pose" }, `${number(one.distance_m, 2)} m away, ${number(one.angle_deg, 0)}° off its normal; corners within ${number(one.error_px, 2)} pixels of such a frame`);
}

function listPictures() {
  list.replaceChildren(...pictures.map((picture, k) => {
    const words = picture.frames === null ? picture.image : `${picture.image} (${picture.frames.length})`;
    const button = make("button", { type: "button", "aria-current": k === at ? "true" : null, "data-labelled": picture.frames !== null }, words);
    button.addEventListener("click", () => open(k));
    return make("li", {}, button);
  }));
  list.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
}

/** @param {number} k which picture */
async function open(k) {
  if (k < 0 || k >= pictures.length) return;
  at = k;
  sent += 1;
  const mine = sent;
  gates = structuredClone(pictures[k].frames ?? []);
  begun = [];
  show([]);
  try {
    await view.load(`/api/pictures/${k}.png`);
    const answer = await request(`/api/pictures/${k}/shown`);
    if (mine === sent) show(answer.shown);
  } catch (error) {
    say(reasonOf(error));
  }
}

none.addEventListener("click", () => {
  gates = [];
  begun = [];
  keep();
});
previous.addEventListener("click", () => open(at - 1));
next.addEventListener("click", () => open(at + 1));
smaller.addEventListener("click", () => view.zoom(-1));
larger.addEventListener("click", () => view.zoom(1));
document.addEventListener("keydown", (event) => {
  if (isTyping(event) || event.ctrlKey || event.metaKey || event.altKey) return;
  const colour = COLOURS.find((name) => name[0] === event.key);
  if (colour) colourChoice.value = colour;
  else if (event.key === "Escape") {
    begun = [];
    draw();
  } else if (event.key === "+") view.zoom(1);
  else if (event.key === "-") view.zoom(-1);
  else if (event.key === "n") open(at + 1);
  else if (event.key === "p") open(at - 1);
});

async function begin() {
  try {
    const overview = await request("/api/pictures");
    ({ pictures, corners_of: cornersOf } = overview);
    const first = pictures.findIndex((picture) => picture.frames === null);
    await open(Math.max(first, 0));
    root.dataset.ready = "";
  } catch (error) {
    say(reasonOf(error));
  }
}

begin();
