/** The lesson beside the chart: what to do, and whether the mission does it. */
import { askCourse, checkLesson, inLanguage, learner, loadLessons } from "../lib/course.js";
import { make, setText } from "../lib/dom.js";
import { button } from "./fields.js";
import { waitingWords, word } from "./words.js";

export class LessonPanel {
  #root;
  #name;
  #listener;
  /** @type {import("../lib/course.js").Lesson|null} */
  #next = null;
  #isChecking = false;
  #line = make("p", { role: "status", class: "e-lesson-line" }, word("check_hint"));

  /**
   * @param {HTMLElement} root
   * @param {string} name of the lesson
   * @param {{text: () => Promise<string>, save: () => Promise<void>, mistake: () => string,
   *   scenario: (name: string, isLast: boolean) => void, flown: (flight: any) => string}} listener flown: shows a flight and says what it was worth
   */
  constructor(root, name, listener) {
    this.#root = root;
    this.#name = name;
    this.#listener = listener;
    this.#load();
  }

  async #load() {
    const lessons = await loadLessons();
    const lesson = lessons.find(({ name }) => name === this.#name);
    if (!lesson) return;
    this.#next = lessons.find(({ number }) => number === lesson.number + 1) ?? null;
    const { title, goal, steps, hints } = lesson;
    this.#listener.scenario(lesson.name, this.#next === null);
    /** @param {import("../lib/course.js").Words[]} list */
    const items = (list) => list.map((each) => make("li", {}, inLanguage(each)));
    this.#root.append(
      make("div", { class: "e-lesson-head" },
        make("h2", {}, `${lesson.number}. ${inLanguage(title)}`, make("a", { href: "/course" }, word("next_lesson"))),
        make("div", { class: "e-verdict" }, button(word("check_lesson"), () => this.#check(), { class: "e-first" }), this.#line)),
      make("p", { class: "e-goal" }, inLanguage(goal)),
      make("ol", {}, ...items(steps)),
      make("details", {}, make("summary", {}, word("hints")), make("ul", {}, ...items(hints))));
  }

  /** @param {string} name of another lesson */
  async #open(name) {
    await this.#listener.save();
    const told = await askCourse("open", { learner: learner(), lesson: name });
    if (told.detail) setText(this.#line, told.detail);
    else location.href = `/edit?file=${encodeURIComponent(told.file)}&lesson=${encodeURIComponent(name)}`;
  }

  async #check() {
    if (!learner()) {
      this.#line.replaceChildren(word("whose"), " ", make("a", { href: "/course" }, word("next_lesson")));
      return;
    }
    if (this.#isChecking) return;
    this.#isChecking = true;
    try {
      await this.#checkNow();
    } finally {
      this.#isChecking = false;
    }
  }

  async #checkNow() {
    this.#line.removeAttribute("data-passed");
    setText(this.#line, word("checking"));
    const text = await this.#listener.text();
    const mistake = this.#listener.mistake();
    if (mistake) {
      setText(this.#line, word("mistake", { mistake }));
      return;
    }
    const told = await checkLesson({ learner: learner(), lesson: this.#name, text }, (place) => setText(this.#line, waitingWords(place)));
    if (told.detail !== undefined) {
      setText(this.#line, told.detail);
      return;
    }
    this.#line.setAttribute("data-passed", String(told.passed));
    const worth = told.flight?.result ? this.#listener.flown(told.flight) : told.reason;
    setText(this.#line, `${word(told.passed ? "passed" : "not_yet")} ${worth}`);
    if (told.passed && this.#next) {
      const { name } = this.#next;
      this.#line.append(" ", button(word("next_one"), () => this.#open(name), { class: "e-first" }));
    }
  }
}
