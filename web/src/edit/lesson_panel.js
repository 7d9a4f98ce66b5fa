/** The lesson beside the chart: what to do, and whether the mission does it. */
import { askCourse, inLanguage, learner, loadLessons } from "../lib/course.js";
import { make, setText } from "../lib/dom.js";
import { button } from "./fields.js";
import { word } from "./words.js";

export class LessonPanel {
  #root;
  #name;
  #listener;
  #line = make("p", { role: "status", class: "e-run-line" });

  /**
   * @param {HTMLElement} root
   * @param {string} name of the lesson
   * @param {{text: () => Promise<string>, scenario: (name: string) => void, flown: (flight: any) => void}} listener
   */
  constructor(root, name, listener) {
    this.#root = root;
    this.#name = name;
    this.#listener = listener;
    this.#load();
  }

  async #load() {
    const lesson = (await loadLessons()).find(({ name }) => name === this.#name);
    if (!lesson) return;
    const { title, goal, steps, hints, scenario } = lesson;
    this.#listener.scenario(scenario);
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

  async #check() {
    this.#line.removeAttribute("data-passed");
    setText(this.#line, word("checking"));
    const told = await askCourse("check", { learner: learner(), lesson: this.#name, text: await this.#listener.text() });
    if (told.detail) {
      setText(this.#line, told.detail);
      return;
    }
    this.#line.setAttribute("data-passed", String(told.passed));
    setText(this.#line, `${word(told.passed ? "passed" : "not_yet")}: ${told.reason}`);
    if (told.flight?.track) this.#listener.flown(told.flight);
  }
}
