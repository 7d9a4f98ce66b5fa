/** What the course's pages share: the lessons, and the pupil's name. */
import { language } from "./language.js";

const KEPT = "framerunner-learner";

/**
 * @typedef {{en: string, es: string}} Words
 * @typedef {{number: number, name: string, minutes: number, title: Words, goal: Words, steps: Words[],
 *   hints: Words[], introduces: string[]}} Lesson
 */

/** @returns {string} the pupil's name; empty: not known */
export const learner = () => localStorage.getItem(KEPT) ?? "";

/** @param {string} name */
export const setLearner = (name) => localStorage.setItem(KEPT, name);

/** @param {Words} words */
export const inLanguage = (words) => words[language()];

/** @returns {Promise<Lesson[]>} */
export async function loadLessons() {
  const answer = await fetch("/api/course");
  return answer.ok ? (await answer.json()).lessons : [];
}

/** Ask the course for something. @param {string} what @param {object} content @returns {Promise<any>} `detail` says why not */
export async function askCourse(what, content) {
  const answer = await fetch(`/api/course/${what}?language=${language()}`, {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content),
  });
  const told = await answer.json();
  return answer.ok ? told : { detail: typeof told.detail === "string" ? told.detail : answer.statusText };
}
