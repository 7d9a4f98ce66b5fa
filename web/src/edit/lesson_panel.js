/** The lesson beside the chart: what to do, and whether the mission does it. */
import { askCourse, inLanguage, learner, loadLessons } from "../lib/course.js";
import { make, setText } from "../lib/dom.js";
import { button } from "./fields.js";
import { word } from "./words.js";

export class LessonPanel {
  #root;
  #name;
  #listener;
  /** @type {import("../lib/course.js").Lesson|null} */
  #next = null;
  #line = make("p", { role: "status", class: "e-run-line" });

  /**
   * @param {HTMLElement} root
   * @param {string} name of the lesson
   * @param {{text: () => Promise<string>, save: () => Promise<void>, scenario: (name: string) => void, flown: (flight: any) => void}} listener
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
    this.#listener.scenario(lesson.name);
    const items = (list) => list.map((each) => make("li", {}, inLanguage(each)));
    this.#root.append(
      make("h2", {}, `${lesson.number}. ${inLanguage(title)}`),
      make("p", { class: "e-goal" }, inLanguage(goal)),
      make("div", { class: "e-row" }, button(word("check_lesson"), () => this.#check(), { class: "e-first" }),
        make("a", { href: "/course" }, word("next_lesson"))),
      this.#line,
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
    this.#line.removeAttribute("data-passed");
    setText(this.#line, word("checking"));
    const told = await askCourse("check", { learner: learner(), lesson: this.#name, text: await this.#listener.text() });
    if (told.detail) {
      setText(this.#line, told.detail);
      return;
    }
    this.#line.setAttribute("data-passed", String(told.passed));
    setText(this.#line, told.passed ? word("passed") : `${word("not_yet")}: ${told.reason}`);
    if (told.passed && this.#next) {
      const { name } = this.#next;
      this.#line.append(" ", button(word("next_one"), () => this.#open(name), { class: "e-first" }));
    }
    if (told.flight?.track) this.#listener.flown(told.flight);
  }
}
