/** One mission in the editor: its diagram, its text and what is selected in both, with all panels around them. */
import { loginAddress } from "../lib/course.js";
import { isTyping, make, setText } from "../lib/dom.js";
import { DiagramView } from "../lib/diagram/diagram_view.js";
import { changeLanguage, language } from "../lib/language.js";
import { pageData } from "../lib/page_data.js";
import { leadTransition, moveState, writtenAt } from "./chart_edits.js";
import { takeMouse } from "./diagram_mouse.js";
import { divider } from "./divider.js";
import { button } from "./fields.js";
import { mistakeIn, showFindings, signOf } from "./findings.js";
import { flownId } from "./flights.js";
import { Inspector } from "./inspector.js";
import { LessonPanel } from "./lesson_panel.js";
import { watchFlights } from "./live_light.js";
import { LivePanel } from "./live_panel.js";
import { showNames } from "./names.js";
import { savePicture } from "./picture.js";
import { ReplayPanel } from "./replay_panel.js";
import { RunPanel } from "./run_panel.js";
import { EditSession } from "./session.js";
import { Tabs } from "./tabs.js";
import { TextView } from "./text_view.js";
import { word } from "./words.js";

/** @typedef {import("../lib/diagram/diagram_view.js").Selection} Selection */

export class Editor {
  #root;
  /** @type {Selection} */
  #selection = { kind: "mission", id: "" };
  #refusal = ""; // code of the last one
  #line = make("p", { class: "e-message", role: "status", hidden: true });
  #state = make("span", { class: "e-saved", role: "status" });
  #undo = button(word("undo"), () => this.#session.undo(), { "aria-keyshortcuts": "Control+Z" });
  #redo = button(word("redo"), () => this.#session.redo(), { "aria-keyshortcuts": "Control+Y" });
  #findings = make("div");
  #names = make("div", { class: "e-names" });
  #tabs;
  #session;
  #text;
  #diagram;
  #inspector;

  /**
   * @param {HTMLElement} root
   * @param {string} file name of the mission's file
   * @param {string|null} lesson name of the lesson that it is for; null: none
   */
  constructor(root, file, lesson) {
    this.#root = root;
    const drawing = make("section", { class: "e-drawing", "aria-label": word("diagram") });
    const writing = make("section", { class: "e-writing", "aria-label": word("text") });
    const form = make("section", { class: "e-form panel", "aria-label": word("state") });
    const flying = make("div"), teaching = make("div"), replaying = make("div"), living = make("div");
    this.#tabs = new Tabs([
      ...(lesson ? [/** @type {[string, string, HTMLElement]} */ (["lesson", word("lesson"), teaching])] : []),
      ["findings", word("checker"), this.#findings], ["fly", word("fly"), flying], ["live", word("live"), living],
      ["replay", word("replay"), replaying], ["names", word("names"), this.#names],
    ]);
    root.replaceChildren(this.#tools(file, drawing), this.#line, panesOf(drawing, form, writing, this.#tabs.root));
    this.#session = this.#open(file);
    this.#text = new TextView(writing, {
      typed: (take) => this.#session.type(take),
      undo: () => this.#session.undo(),
      redo: () => this.#session.redo(),
      moved: (offset) => this.#follow(offset),
    });
    this.#diagram = new DiagramView(drawing, { done: word("done"), resume: word("resume") });
    this.#takeMouse();
    this.#inspector = new Inspector(form, this.#session, (chosen) => this.#select(chosen, true));
    const runs = this.#fly(flying, living, replaying, lesson !== null);
    if (lesson) this.#teach(teaching, lesson, runs);
    this.#takeKeys();
  }

  /** The row of buttons. @param {string} file @param {HTMLElement} drawing */
  #tools(file, drawing) {
    const stem = file.replace(/\.ya?ml$/, "");
    const picture = (/** @type {"png"|"svg"} */ kind) => button(kind.toUpperCase(), () => {
      this.#diagram.whole();
      savePicture(drawing, stem, kind);
    });
    const download = (/** @type {string} */ kind, /** @type {string} */ text) => make("a", {
      href: `/api/edit/export?kind=${kind}&language=${language()}&file=${encodeURIComponent(file)}`, download: true,
    }, text);
    return make("div", { class: "e-tools", role: "toolbar" },
      make("a", { href: "/edit" }, word("files")), make("strong", {}, file), this.#state,
      button(word("save"), () => this.#store(), { class: "e-first", "aria-keyshortcuts": "Control+S" }), this.#undo, this.#redo,
      button(word("new_state"), () => this.#inspector.add(false)),
      button(word("new_superstate"), () => this.#inspector.add(true)),
      button(word("new_template"), () => this.#inspector.addTemplate()),
      button(word("fit"), () => this.#diagram.whole()),
      button(word("arrange"), () => this.#arrange()),
      make("details", { class: "e-export" }, make("summary", {}, word("export")),
        picture("png"), picture("svg"), download("mermaid", "Mermaid"), download("scxml", "SCXML")),
      button(word("language"), changeLanguage));
  }

  /** Open the document. @param {string} file */
  #open(file) {
    return new EditSession(file, {
      changed: (changes, all, isOwn) => {
        if (all !== null) this.#text.setText(all);
        else this.#text.change(changes, isOwn);
        this.#tell(""); // what was said before concerned the mission as it was
        this.#refresh();
        if (isOwn) this.#settle();
        if (this.#text.cursor !== null) this.#follow(this.#text.cursor);
      },
      placed: () => this.#refresh(),
      connected: (connection, reason) => {
        this.#text.setReadOnly(connection !== "open"); // what is typed without a connection would be lost
        if (connection === "open") this.#tell("");
        else this.#tell(connection === "refused" ? reason : word("away"));
        if (connection === "refused" && !pageData().mayEdit) this.#line.append(" ", make("a", { href: loginAddress() }, word("log_in")));
      },
      refused: (reason, code) => {
        this.#refusal = code;
        this.#tell(reason);
      },
      text: () => this.#text.text,
      note: (note) => this.#tell(word(/** @type {any} */ (note))),
      status: () => this.#showStatus(),
    });
  }

  #takeMouse() {
    takeMouse(this.#diagram, {
      selected: (chosen) => this.#select(chosen, true, false),
      placed: (places) => {
        this.#settle();
        this.#session.place(places);
        this.#refresh();
      },
      joined: (from, to) => {
        if (this.#session.diagram.nodes.find(({ id }) => id === from)?.source) this.#inspector.addTransition(from, to);
        else this.#tell(word("foreign_note"));
      },
      moved: async (moved, parent, place) => {
        const selected = await moveState(this.#session, moved, parent, place);
        this.#refresh();
        if (selected) this.#select(selected, true);
      },
      led: async (id, end, to) => {
        const selected = await leadTransition(this.#session, id, end, to);
        if (selected === "foreign") this.#tell(word("foreign_note"));
        else if (selected) this.#select(selected, true);
      },
      opened: (chosen) => {
        this.#select(chosen, true);
        this.#inspector.focus();
      },
    });
  }

  /** The panels of flights: here, in the simulator, and recorded. @param {HTMLElement} flying @param {HTMLElement} living @param {HTMLElement} replaying @param {boolean} isSimple */
  #fly(flying, living, replaying, isSimple) {
    const mission = () => this.#session.mission.name ?? "";
    const text = () => this.#sentText();
    const lost = (/** @type {string} */ id) => this.#diagram.markLost(id);
    const lit = this.#light.bind(this);
    const runs = new RunPanel(flying, {
      text, lit, lost,
      mistake: () => mistakeIn(this.#session.findings),
      selected: () => (this.#selection.kind === "state" ? this.#selection.id : ""),
      live: (message) => live.hear(message),
    }, isSimple);
    const live = new LivePanel(living, { ask: (request) => runs.ask(request), text });
    const replay = new ReplayPanel(replaying, { lit, lost, mission });
    this.#tabs.onShow = (key) => {
      if (key === "replay") replay.load();
      else replay.pause();
    };
    watchFlights(mission, {
      light: (active, counts) => this.#light(active, counts, []),
      moved: (place, t, state) => live.move(place, t, state),
      world: (scenario) => live.setWorld(scenario),
    });
    return runs;
  }

  /** @param {HTMLElement} teaching @param {string} lesson @param {RunPanel} runs */
  #teach(teaching, lesson, runs) {
    new LessonPanel(teaching, lesson, {
      text: () => this.#sentText(),
      save: () => this.#store(),
      mistake: () => mistakeIn(this.#session.findings),
      scenario: (name, isLast) => runs.choose(name, !isLast),
      flown: (flight) => {
        this.#diagram.markLost(flight.lost_in);
        return runs.showFlight(flight);
      },
    });
  }

  #takeKeys() {
    addEventListener("beforeunload", (event) => {
      if (!this.#session.isSaved) event.preventDefault();
    });
    addEventListener("keydown", (event) => {
      if (event.defaultPrevented) return; // the text has taken it
      const isCommand = event.ctrlKey || event.metaKey;
      const key = event.key.toLowerCase();
      if (isCommand && key === "s") {
        event.preventDefault();
        this.#store();
      } else if (isCommand && (key === "z" || key === "y") && !isFilledIn(event.target)) {
        event.preventDefault();
        if (key === "y" || event.shiftKey) this.#session.redo();
        else this.#session.undo();
      } else if (event.key === "Delete" && !isTyping(event) && !this.#text.hasFocus) {
        this.#inspector.delete(this.#selection);
      } else if (event.key === "F2" && !isTyping(event)) this.#inspector.focus();
    });
  }

  /** @param {string[]} active @param {Object<string, number>} counts @param {string[]} taken ids as flights have them */
  #light(active, counts, taken) {
    const ids = new Map(this.#session.diagram.edges.map((edge) => [flownId(edge), edge.id]));
    this.#diagram.light(
      new Set(active),
      new Map(Object.entries(counts).map(([id, count]) => [ids.get(id) ?? "", count])),
      new Set(taken.map((id) => ids.get(id) ?? "")));
  }

  /** The text, when the server has checked it. */
  async #sentText() {
    await this.#session.flush();
    return this.#text.text;
  }

  /** Select what is written at the cursor. @param {number} offset */
  #follow(offset) {
    this.#select(writtenAt(this.#session.diagram, offset, this.#selection.id), false);
  }

  /** @param {Selection} chosen @param {boolean} showText @param {boolean} [showDiagram] */
  #select(chosen, showText, showDiagram = true) {
    const isOther = chosen.kind !== this.#selection.kind || chosen.id !== this.#selection.id;
    this.#selection = chosen;
    this.#diagram.select(chosen);
    if (showDiagram && isOther) this.#diagram.reveal(chosen);
    this.#inspector.show(chosen);
    const { nodes, edges } = this.#session.diagram;
    const { span } = (chosen.kind === "state" ? nodes : edges).find(({ id }) => id === chosen.id) ?? {};
    if (showText && span) this.#text.show(span.start, span.end);
  }

  /** Keep where new states are drawn: they stay there. */
  #settle() {
    if (this.#session.isReadable) this.#session.place(this.#diagram.unkept, true);
  }

  #arrange() {
    this.#settle(); // so that it can be undone
    this.#diagram.forget();
    this.#diagram.draw(this.#session.diagram, {}, this.#session.findings);
    this.#session.place(this.#diagram.unkept);
    this.#diagram.fit();
  }

  async #store() {
    if (await this.#session.save()) this.#tell("");
    else if (this.#refusal === "session.changed" && confirm(word("overwrite"))) await this.#session.save(true);
  }

  /** @param {string} words */
  #tell(words) {
    setText(this.#line, words);
    this.#line.hidden = words === "";
  }

  #showStatus() {
    const { isSaved, others, canUndo, canRedo } = this.#session;
    setText(this.#state, [isSaved ? word("saved") : word("unsaved"), others > 0 ? word("others") : ""].filter(Boolean).join(" – "));
    this.#undo.toggleAttribute("disabled", !canUndo);
    this.#redo.toggleAttribute("disabled", !canRedo);
  }

  #refresh() {
    const { findings, isReadable } = this.#session;
    this.#diagram.draw(this.#session.diagram, this.#session.layout, findings);
    this.#text.setFindings(findings);
    this.#inspector.show(this.#selection);
    this.#tabs.mark("findings", signOf(findings));
    showFindings(this.#findings, findings, ({ nodes: [node], event, index, start, end }) => {
      if (node) this.#select(event === null ? { kind: "state", id: node } : { kind: "transition", id: `${node}/${event}/${index}` }, false);
      this.#text.show(start, end);
    });
    showNames(this.#names, this.#session.catalogue);
    this.#root.classList.toggle("e-unreadable", !isReadable);
    if (!isReadable) this.#tell(word("unreadable"));
    else if (this.#line.textContent === word("unreadable")) this.#tell("");
  }
}

/** The panes, with dividers between them. @param {HTMLElement} drawing @param {HTMLElement} form @param {HTMLElement} writing @param {HTMLElement} tabs */
function panesOf(drawing, form, writing, tabs) {
  const panes = make("div", { class: "e-panes" }, drawing, form, writing, tabs);
  panes.append(
    divider(panes, { name: "tabs", part: tabs, label: word("divide_rows"), isRow: true, least: 120, space: 100 }),
    divider(panes, { name: "form", part: form, label: word("divide_form"), isRow: false, least: 180, space: 480 }),
    divider(panes, { name: "writing", part: writing, label: word("divide_text"), isRow: false, least: 120, space: 480 }));
  return panes;
}

/** Whether something was typed into a field, which the browser undoes. @param {EventTarget|null} field */
function isFilledIn(field) {
  return (field instanceof HTMLInputElement && field.type === "text" && field.value !== field.defaultValue)
    || (field instanceof HTMLElement && field.isContentEditable);
}
