/** The course: the lessons with a pupil's progress, and for teachers the table of the class. */
import "./course.css";
import { askCourse, inLanguage, learner, loadLessons, loginAddress, setLearner } from "../lib/course.js";
import { make, number, setText } from "../lib/dom.js";
import { changeLanguage, translator } from "../lib/language.js";
import { translateHeader } from "../lib/navigation.js";
import { pageData, pageRoot } from "../lib/page_data.js";

const word = translator({
  en: {
    course: "Course", name: "Your name", language: "Español", start: "Begin", again: "Go on", done: "passed", minutes: "about {minutes} {minutes:minute|minutes}",
    need_name: "Write your name first.", class: "The class", pupil: "Pupil", flights: "{flights} {flights:flight|flights}", after: "passed after {minutes} min, {flights} {flights:flight|flights}",
    log_in: "Log in to take part.", nobody: "No pupil has begun yet.", progress: "{passed} of {all} lessons passed", begun: "begun, {flights} {flights:flight|flights}",
    you: "You are {name}. In another browser log in with your name and your own code word:", word: "Code word", reset: "Begin anew",
    reset_hint: "Forget what {name} has done in all lessons; the missions stay", reset_sure: "Forget what {name} has done in all lessons? The missions stay.", save_class: "Save as CSV",
  },
  es: {
    course: "Curso", name: "Tu nombre", language: "English", start: "Empezar", again: "Seguir", done: "conseguida", minutes: "unos {minutes} {minutes:minuto|minutos}",
    need_name: "Escribe antes tu nombre.", class: "La clase", pupil: "Alumno", flights: "{flights} {flights:vuelo|vuelos}", after: "conseguida tras {minutes} min, {flights} {flights:vuelo|vuelos}",
    log_in: "Inicia sesión para participar.", nobody: "Ningún alumno ha empezado aún.", progress: "{passed} de {all} lecciones conseguidas", begun: "empezada, {flights} {flights:vuelo|vuelos}",
    you: "Eres {name}. En otro navegador inicia sesión con tu nombre y tu propia palabra clave:", word: "Palabra clave", reset: "Empezar de nuevo",
    reset_hint: "Olvidar lo que {name} ha hecho en todas las lecciones; las misiones se quedan", reset_sure: "¿Olvidar lo que {name} ha hecho en todas las lecciones? Las misiones se quedan.", save_class: "Guardar como CSV",
  },
});
const REFRESH_MS = 5000;

const root = pageRoot("course");
const { mayAct, mayTeach, pupil, word: ownWord } = pageData();
translateHeader();

const input = /** @type {HTMLInputElement} */ (make("input", { id: "learner", type: "text", maxlength: "40", autocomplete: "name" }));
input.value = learner();
input.addEventListener("input", () => {
  setLearner(input.value.trim());
  showProgress();
});
const other = make("button", { type: "button" }, word("language"));
other.addEventListener("click", changeLanguage);
const problem = make("p", { class: "c-problem", role: "alert" });
const list = make("ol", { class: "c-lessons" });
const bar = make("progress", { "aria-label": word("course") });
const passedWords = make("span");
const progress = make("p", { class: "c-progress", hidden: !mayAct }, bar, passedWords);
const table = make("table", { class: "c-class" });
root.append(
  make("div", { class: "c-head" }, make("h1", {}, word("course")), other),
  whoTakesPart(),
  problem, progress, list,
  ...(mayTeach ? [make("h2", {}, word("class")), table, make("p", {}, make("a", { href: "/api/course/class.csv", download: true }, word("save_class")))] : []));

/** The field for the name; of a pupil who has logged in, what is needed in another browser. */
function whoTakesPart() {
  if (pupil) return make("p", { class: "c-name" }, word("you", { name: pupil }), " ", make("code", {}, ownWord));
  if (mayAct) return make("label", { class: "c-name", for: "learner" }, word("name"), input);
  return make("p", { class: "hint" }, make("a", { href: loginAddress() }, word("log_in")));
}

/** @type {import("../lib/course.js").Lesson[]} */
let lessons = [];
/** @typedef {{flights: number, passed_after_s: number|null, last_reason: string}} Progress with a lesson */

/** @type {{name: string, word: string, lessons: Record<string, Progress>}[]} */
let learners = [];
let shownClass = "";

/** @param {string} text */
function tell(text) {
  setText(problem, text);
}

/** @param {import("../lib/course.js").Lesson} lesson */
async function open(lesson) {
  if (!learner()) {
    tell(word("need_name"));
    input.focus();
    return;
  }
  const told = await askCourse("open", { learner: learner(), lesson: lesson.name });
  if (told.detail) tell(told.detail);
  else location.href = `/edit?file=${encodeURIComponent(told.file)}&lesson=${encodeURIComponent(lesson.name)}`;
}

function showProgress() {
  const own = learners.find(({ name }) => name === learner())?.lessons ?? {};
  const passed = lessons.filter(({ name }) => (own[name]?.passed_after_s ?? null) !== null).length;
  bar.max = lessons.length;
  bar.value = passed;
  setText(passedWords, word("progress", { passed: String(passed), all: String(lessons.length) }));
  list.replaceChildren(...lessons.map((lesson) => {
    const done = own[lesson.name];
    const isPassed = done !== undefined && done.passed_after_s !== null;
    const begin = make("button", { type: "button", disabled: !mayAct }, word(done ? "again" : "start"));
    begin.addEventListener("click", () => open(lesson));
    return make("li", { "data-passed": String(isPassed) },
      make("strong", {}, inLanguage(lesson.title)), ` (${word("minutes", { minutes: String(lesson.minutes) })}) `,
      isPassed ? make("span", { class: "c-done" }, `✓ ${word("done")}`)
        : done ? make("span", { class: "hint" }, word("begun", { flights: String(done.flights) })) : null,
      make("p", {}, inLanguage(lesson.goal)), begin);
  }));
}

function showClass() {
  const told = JSON.stringify([lessons, learners]);
  if (told === shownClass) return; // a selected code word and the focus stay
  shownClass = told;
  const head = make("tr", {}, make("th", {}, word("pupil")), make("th", {}, word("word")), ...lessons.map(({ number: each, title }) => make("th", {}, `${each}. ${inLanguage(title)}`)));
  /** @param {Progress|undefined} done */
  const cell = (done) => {
    if (!done) return make("td", {}, "");
    const { flights, passed_after_s, last_reason } = done;
    const text = passed_after_s === null ? word("flights", { flights: String(flights) })
      : `✓ ${word("after", { minutes: number(passed_after_s / 60, 1), flights: String(flights) })}`;
    return make("td", { title: last_reason, "data-passed": String(passed_after_s !== null) }, text);
  };
  const rows = learners.map((each) => make("tr", {}, make("th", { scope: "row" }, each.name), make("td", {}, make("code", {}, each.word)),
    ...lessons.map(({ name }) => cell(each.lessons[name])), make("td", {}, reset(each.name))));
  table.replaceChildren(head, ...(rows.length > 0 ? rows : [make("tr", {}, make("td", { colspan: String(lessons.length + 3), class: "hint" }, word("nobody")))]));
}

/** @param {string} name of a pupil who begins anew */
function reset(name) {
  const button = make("button", { type: "button", title: word("reset_hint", { name }) }, word("reset"));
  button.addEventListener("click", async () => {
    if (!confirm(word("reset_sure", { name }))) return;
    tell((await askCourse("reset", { learner: name, lesson: "" })).detail ?? "");
    await refresh();
  });
  return button;
}

async function refresh() {
  if (mayAct) {
    const answer = await fetch("/api/course/class");
    if (answer.ok) learners = (await answer.json()).learners;
    if (mayTeach) showClass();
  }
  if (document.activeElement?.closest(".c-lessons") === null || list.childElementCount === 0) showProgress();
}

loadLessons().then((loaded) => {
  lessons = loaded;
  refresh();
});
setInterval(refresh, REFRESH_MS);
