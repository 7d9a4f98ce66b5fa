/** What the course's pages share: the lessons, and the pupil's name. */
import { language, translator } from "./language.js";
import { pageData } from "./page_data.js";
import { request } from "./request.js";

const KEPT = "framerunner-learner";

/**
 * @typedef {{en: string, es: string}} Words
 * @typedef {{number: number, name: string, minutes: number, title: Words, goal: Words, steps: Words[],
 *   hints: Words[], introduces: string[]}} Lesson
 */

/**
 * @typedef {{place: number, seconds: number|null}} Place in the line of what waits to be flown; seconds until its turn
 */

/** @returns {string} the pupil's name: the one who logged in, else what was written in this browser; empty: not known */
export const learner = () => pageData().pupil || (localStorage.getItem(KEPT) ?? "");

/** The address of the log-in, which comes back to this page. */
export const loginAddress = () => `/login?next=${encodeURIComponent(location.pathname + location.search)}`;

/** @param {string} name */
export const setLearner = (name) => localStorage.setItem(KEPT, name);

/** @param {Words} words */
export const inLanguage = (words) => words[language()];

/** @returns {Promise<Lesson[]>} */
export async function loadLessons() {
  return (await request("/api/course").catch(() => ({ lessons: [] }))).lessons;
}

const word = translator({
  en: { lost: "no connection to the monitor; is it running? Try again" },
  es: { lost: "no hay conexión con el monitor; ¿está en marcha? Inténtalo de nuevo" },
});

/** @param {string} what @param {object} content @returns {Promise<Response>} an error without a connection */
function post(what, content) {
  return fetch(`/api/course/${what}?language=${language()}`, {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content),
  }).catch(() => Response.json({ detail: word("lost") }, { status: 503 }));
}

/** Ask the course for something. @param {string} what @param {object} content @returns {Promise<any>} `detail` says why not */
export async function askCourse(what, content) {
  const answer = await post(what, content);
  return answer.ok ? answer.json() : refusal(answer);
}

/**
 * Have a mission of a lesson flown, after those that others have asked for.
 * @param {object} content
 * @param {(place: Place) => void} waits told the place in the line whenever it changes
 * @returns {Promise<any>} `detail` says why it was not flown
 */
export async function checkLesson(content, waits) {
  const answer = await post("check", content);
  if (!answer.ok) return refusal(answer);
  let rest = "";
  const reader = /** @type {ReadableStream} */ (answer.body).pipeThrough(new TextDecoderStream()).getReader();
  for (;;) {
    const { value, done } = await reader.read().catch(() => ({ value: "", done: true }));
    const lines = (rest + (value ?? "")).split("\n");
    rest = lines.pop() ?? "";
    for (const told of lines.map((line) => JSON.parse(line))) {
      if (told.place === undefined) return told;
      waits(told);
    }
    if (done) return { detail: word("lost") };
  }
}

/** @param {Response} answer @returns {Promise<{detail: string}>} */
async function refusal(answer) {
  const { detail } = await answer.json().catch(() => ({}));
  return { detail: typeof detail === "string" ? detail : answer.statusText };
}
