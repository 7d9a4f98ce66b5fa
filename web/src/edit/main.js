/** The mission editor: diagram and text of one mission, each following the other. */
import "./edit.css";
import { loginAddress } from "../lib/course.js";
import { isTyping, make, setText } from "../lib/dom.js";
import { pageData, pageRoot } from "../lib/page_data.js";
import { DiagramView } from "../lib/diagram/diagram_view.js";
import { takeMouse } from "./diagram_mouse.js";
import { divider } from "./divider.js";
import { button, choice, textField } from "./fields.js";
import { flownId } from "./flights.js";
import { Inspector } from "./inspector.js";
import { RunPanel } from "./run_panel.js";
import { EditSession } from "./session.js";
import { Tabs } from "./tabs.js";
import { TextView } from "./text_view.js";
import { changeLanguage, language } from "../lib/language.js";
import { translateHeader } from "../lib/navigation.js";
import { savePicture } from "./picture.js";
import { showNames } from "./names.js";
import { watchFlights } from "./live_light.js";
import { LivePanel } from "./live_panel.js";
import { ReplayPanel } from "./replay_panel.js";
import { LessonPanel } from "./lesson_panel.js";
import { word } from "./words.js";

/** @typedef {import("../lib/diagram/diagram_view.js").Selection} Selection */

const root = pageRoot("edit");
const file = new URLSearchParams(location.search).get("file");
translateHeader();

if (file) edit(file);
else chooseFile();

/** The list of missions, and a form for a new one. */
async function chooseFile() {
  const { mayEdit } = pageData();
  const problem = make("p", { class: "problem", role: "alert", hidden: true });
  const list = make("ul", { class: "e-files" });
  root.append(make("h1", {}, word("open")), problem, list);
  const answer = await fetch(`/api/edit/files?language=${language()}`);
  const told = await answer.json();
  if (!answer.ok) {
    problem.hidden = false;
    problem.replaceChildren(told.detail, " ", answer.status === 403 ? make("a", { href: loginAddress() }, word("log_in")) : "");
    return;
  }
  const link = (name) => make("li", {}, make("a", { href: `/edit?file=${encodeURIComponent(name)}` }, name));
  list.replaceChildren(...told.files.map(link));
  if (told.files.length === 0) list.append(make("li", { class: "hint" }, word("no_files")));
  if (!mayEdit) return;
  /** Ask for a new file and open it. @param {"files"|"import"} how @param {object} content */
  const create = async (how, content) => {
    const made = await fetch(`/api/edit/${how}?language=${language()}`, {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content),
    });
    const { file: created, detail } = await made.json();
    if (made.ok) location.href = `/edit?file=${encodeURIComponent(created)}`;
    problem.hidden = made.ok;
    problem.textContent = typeof detail === "string" ? detail : made.statusText;
  };
  let name = "my_mission", source = "empty";
  const sources = [["empty", word("empty")], ["example", word("example")], ...told.missions.map((/** @type {string} */ each) => [each, word("a_copy", { name: each })])];
  root.append(make("form", { class: "panel e-new" },
    textField(word("name"), name, (value) => { name = value; }),
    choice(word("from"), /** @type {[string, string][]} */ (sources), source, (value) => { source = value; }),
    button(word("create"), () => create("files", { name, source })),
    importField((scxml, wanted) => create("import", { name: wanted, scxml }))));
}

/** Whether something was typed into a field, which the browser undoes. @param {EventTarget|null} field */
function isFilledIn(field) {
  return (field instanceof HTMLInputElement && field.type === "text" && field.value !== field.defaultValue)
    || (field instanceof HTMLElement && field.isContentEditable);
}

/** A field for an SCXML file. @param {(text: string, name: string) => void} chosen */
function importField(chosen) {
  const input = /** @type {HTMLInputElement} */ (make("input", { type: "file", accept: ".scxml,.xml" }));
  input.addEventListener("change", async () => {
    const [picked] = input.files ?? [];
    const name = picked?.name.replace(/\.[^.]*$/, "").toLowerCase().replace(/[^a-z0-9]+/g, "_").replace(/^[^a-z]+/, "");
    if (picked) chosen(await picked.text(), name || "imported");
  });
  return make("label", { class: "e-field" }, make("span", {}, word("import_scxml")), input);
}

/** @param {string} name of the file */
function edit(name) {
  /** @type {Selection} */
  let selection = { kind: "mission", id: "" };
  let refusal = ""; // code of the last one
  const stem = name.replace(/\.ya?ml$/, "");
  const line = make("p", { class: "e-message", role: "status", hidden: true });
  const state = make("span", { class: "e-saved", role: "status" });
  const drawing = make("section", { class: "e-drawing", "aria-label": word("diagram") });
  const writing = make("section", { class: "e-writing", "aria-label": word("text") });
  const form = make("section", { class: "e-form panel", "aria-label": word("state") });
  const findings = make("div");
  const flying = make("div");
  const lesson = new URLSearchParams(location.search).get("lesson");
  const teaching = make("div");
  const replaying = make("div");
  const living = make("div");
  const names = make("div", { class: "e-names" });
  const tabs = new Tabs([
    ...(lesson ? [/** @type {[string, string, HTMLElement]} */ (["lesson", word("lesson"), teaching])] : []),
    ["findings", word("checker"), findings], ["fly", word("fly"), flying], ["live", word("live"), living],
    ["replay", word("replay"), replaying], ["names", word("names"), names],
  ]);
  const undo = button(word("undo"), () => session.undo(), { "aria-keyshortcuts": "Control+Z" });
  const redo = button(word("redo"), () => session.redo(), { "aria-keyshortcuts": "Control+Y" });
  const save = button(word("save"), store, { class: "e-first", "aria-keyshortcuts": "Control+S" });
  const tools = make("div", { class: "e-tools", role: "toolbar" },
    make("a", { href: "/edit" }, word("files")), make("strong", {}, name), state, save, undo, redo,
    button(word("new_state"), () => inspector.add(false)),
    button(word("new_superstate"), () => inspector.add(true)),
    button(word("new_template"), () => inspector.addTemplate()),
    button(word("fit"), () => diagram.whole()),
    button(word("arrange"), arrange),
    make("details", { class: "e-export" }, make("summary", {}, word("export")),
      ...["png", "svg"].map((kind) => button(kind.toUpperCase(), () => {
        diagram.whole();
        savePicture(drawing, stem, /** @type {"png"|"svg"} */ (kind));
      })),
      ...["mermaid", "scxml"].map((kind) => make("a", { href: `/api/edit/export?kind=${kind}&language=${language()}&file=${encodeURIComponent(name)}`, download: true }, kind === "scxml" ? "SCXML" : "Mermaid"))),
    button(word("language"), changeLanguage));
  const panes = make("div", { class: "e-panes" }, drawing, form, writing, tabs.root);
  root.replaceChildren(tools, line, panes);
  panes.append(
    divider(panes, { name: "tabs", part: tabs.root, label: word("divide_rows"), isRow: true, least: 120, space: 100 }),
    divider(panes, { name: "form", part: form, label: word("divide_form"), isRow: false, least: 180, space: 480 }),
    divider(panes, { name: "writing", part: writing, label: word("divide_text"), isRow: false, least: 120, space: 480 }));

  const session = new EditSession(name, {
    changed(changes, all, isOwn) {
      if (all !== null) text.setText(all);
      else text.change(changes, isOwn);
      tell(""); // what was said before concerned the mission as it was
      refresh();
      if (isOwn) settle();
      if (text.cursor !== null) follow(text.cursor);
    },
    placed: refresh,
    connected(connection, reason) {
      text.setReadOnly(connection !== "open"); // what is typed without a connection would be lost
      if (connection === "open") tell("");
      else tell(connection === "refused" ? reason : word("away"));
      if (connection === "refused" && !pageData().mayEdit) line.append(" ", make("a", { href: loginAddress() }, word("log_in")));
    },
    refused: (reason, code) => {
      refusal = code;
      tell(reason);
    },
    text: () => text.text,
    note: (note) => tell(word(/** @type {any} */ (note))),
    status: showStatus,
  });
  const text = new TextView(writing, {
    typed: (take) => session.type(take),
    undo: () => session.undo(),
    redo: () => session.redo(),
    moved: follow,
  });
  const diagram = new DiagramView(drawing, { done: word("done"), resume: word("resume") });
  takeMouse(diagram, {
    selected: (chosen) => select(chosen, true, false),
    placed(places) {
      settle();
      session.place(places);
      refresh();
    },
    joined: join,
    moved: move,
    led: lead,
    opened: (chosen) => {
      select(chosen, true);
      inspector.focus();
    },
  });
  const inspector = new Inspector(form, session, (chosen) => select(chosen, true));

  /** @param {string[]} active @param {Object<string, number>} counts @param {string[]} taken ids as flights have them */
  function light(active, counts, taken) {
    const ids = new Map(session.diagram.edges.map((edge) => [flownId(edge), edge.id]));
    diagram.light(
      new Set(active),
      new Map(Object.entries(counts).map(([id, count]) => [ids.get(id) ?? "", count])),
      new Set(taken.map((id) => ids.get(id) ?? "")));
  }

  /** The text, when the server has checked it. */
  async function sentText() {
    await session.flush();
    return text.text;
  }

  const runs = new RunPanel(flying, {
    text: sentText,
    mistake,
    lit: light,
    lost: (id) => diagram.markLost(id),
    selected: () => (selection.kind === "state" ? selection.id : ""),
    live: (message) => live.hear(message),
  }, lesson !== null);
  const live = new LivePanel(living, {
    ask: (request) => runs.ask(request),
    text: sentText,
  });
  const replay = new ReplayPanel(replaying, {
    lit: light, lost: (id) => diagram.markLost(id), mission: () => session.mission.name ?? "",
  });
  tabs.onShow = (key) => {
    if (key === "replay") replay.load();
    else replay.pause();
  };

  watchFlights(() => session.mission.name ?? "", {
    light: (active, counts) => light(active, counts, []),
    moved: (place, t, state) => live.move(place, t, state),
    world: (scenario) => live.setWorld(scenario),
  });
  if (lesson) {
    new LessonPanel(teaching, lesson, {
      text: sentText,
      save: store,
      mistake,
      scenario: (name, isLast) => runs.choose(name, !isLast),
      flown(flight) {
        diagram.markLost(flight.lost_in);
        return runs.showFlight(flight);
      },
    });
  }

  /** Select what is written at the cursor; of the uses of a template, the one that was selected stays. @param {number} offset */
  function follow(offset) {
    const { nodes, edges } = session.diagram;
    const isAt = ({ span }) => span && span[0] <= offset && offset <= span[1];
    const kept = (found) => found.find(({ id }) => selection.id.startsWith(id.replace(/\/.*/, ""))) ?? found[0];
    const around = nodes.filter(isAt), at = edges.filter(isAt);
    const inmost = around.filter(({ span }) => around.every((other) => other.span[0] <= span[0] && span[1] <= other.span[1]));
    if (at.length > 0) select({ kind: "transition", id: (at.find(({ id }) => id === selection.id) ?? kept(at)).id }, false);
    else if (inmost.length > 0) select({ kind: "state", id: (inmost.find(({ id }) => id === selection.id) ?? kept(inmost)).id }, false);
    else select({ kind: "mission", id: "" }, false);
  }

  /** Keep where new states are drawn: they stay there. */
  function settle() {
    if (session.isReadable) session.place(diagram.unkept, true);
  }

  function tell(words) {
    setText(line, words);
    line.hidden = words === "";
  }

  function showStatus() {
    setText(state, [session.isSaved ? word("saved") : word("unsaved"), session.others > 0 ? word("others") : ""].filter(Boolean).join(" – "));
    undo.toggleAttribute("disabled", !session.canUndo);
    redo.toggleAttribute("disabled", !session.canRedo);
  }

  /** @param {Selection} chosen @param {boolean} showText @param {boolean} [showDiagram] */
  function select(chosen, showText, showDiagram = true) {
    const isOther = chosen.kind !== selection.kind || chosen.id !== selection.id;
    selection = chosen;
    diagram.select(chosen);
    if (showDiagram && isOther) diagram.reveal(chosen);
    inspector.show(chosen);
    const { nodes, edges } = session.diagram;
    const { span } = (chosen.kind === "state" ? nodes : edges).find(({ id }) => id === chosen.id) ?? {};
    if (showText && span) text.show(span[0], span[1]);
  }

  function refresh() {
    diagram.draw(session.diagram, session.layout, session.findings);
    text.setFindings(session.findings);
    inspector.show(selection);
    showFindings();
    showNames(names, session.catalogue);
    root.classList.toggle("e-unreadable", !session.isReadable);
    if (!session.isReadable) tell(word("unreadable"));
    else if (line.textContent === word("unreadable")) tell("");
  }

  /** What keeps the mission from flying, in a line; "" if nothing does. */
  function mistake() {
    const [error] = session.findings.filter(({ severity }) => severity === "error");
    return error ? `${error.line ? `${error.line}: ` : ""}${error.message}` : "";
  }

  function showFindings() {
    const row = (finding) => make("li", { "data-severity": finding.severity },
      button(`${finding.line ? `${finding.line}: ` : ""}${finding.message}`, () => {
        const [node] = finding.nodes;
        if (node) select(finding.event === null ? { kind: "state", id: node } : { kind: "transition", id: `${node}/${finding.event}/${finding.index}` }, false);
        if (finding.span) text.show(finding.span[0], finding.span[1]);
      }, { class: "e-link" }));
    const faults = session.findings.filter(({ severity }) => severity !== "advice");
    const advice = session.findings.filter(({ severity }) => severity === "advice");
    const errors = faults.filter(({ severity }) => severity === "error").length;
    tabs.mark("findings", errors > 0 ? `${errors} ✗` : faults.length > 0 ? `${faults.length} !` : "✓");
    const isOpen = findings.querySelector("details")?.open ?? false;
    findings.replaceChildren(
      faults.length > 0 ? make("ul", {}, ...faults.map(row)) : make("p", { class: "e-good" }, word("none")),
      ...(advice.length > 0 ? [make("details", { open: isOpen }, make("summary", {}, word("advice", { count: String(advice.length) })), make("ul", {}, ...advice.map(row)))] : []));
  }

  /** @param {string} from @param {string} to */
  function join(from, to) {
    if (session.diagram.nodes.find(({ id }) => id === from)?.source) inspector.addTransition(from, to);
    else tell(word("foreign_note"));
  }

  /**
   * Lead a transition to another state, or let it come from another one.
   * @param {string} id @param {"source"|"target"} end @param {string} to
   */
  async function lead(id, end, to) {
    const { nodes, edges } = session.diagram;
    const edge = edges.find((each) => each.id === id);
    if (!edge || to === edge[end]) return undefined;
    if (!edge.source_state) return tell(word("foreign_note"));
    const transition = { state: edge.source_state, event: edge.event, index: edge.source_index };
    if (end === "target") {
      if (await session.edit({ kind: "redirect_transition", transition, to: session.target(edge.source, to) })) select({ kind: "transition", id }, true);
      return undefined;
    }
    const source = nodes.find((node) => node.id === to)?.source;
    if (!source) return tell(word("foreign_note"));
    const count = edge.event === "tick" ? edges.filter(({ source: from, event }) => from === to && event === "tick").length : 0;
    if (await session.edit({ kind: "set_source", transition, state: source, to: session.target(to, edge.target) })) {
      select({ kind: "transition", id: `${to}/${edge.event}/${count}` }, true);
    }
    return undefined;
  }

  /** @param {string} moved @param {string} parent @param {{x: number, y: number}} place in the new superstate */
  async function move(moved, parent, place) {
    const { nodes } = session.diagram;
    const source = (id) => nodes.find((node) => node.id === id)?.source ?? "";
    if (await session.edit({ kind: "move_state", state: source(moved), parent: source(parent) })) {
      const id = [parent, moved.split(".").at(-1)].filter(Boolean).join(".");
      session.place({ [id]: place }, true);
      refresh();
      select({ kind: "state", id }, true);
    } else refresh();
  }

  function arrange() {
    settle(); // so that it can be undone
    diagram.forget();
    diagram.draw(session.diagram, {}, session.findings);
    session.place(diagram.unkept);
    diagram.fit();
  }

  async function store() {
    if (await session.save()) tell("");
    else if (refusal === "session.changed" && confirm(word("overwrite"))) await session.save(true);
  }

  addEventListener("beforeunload", (event) => {
    if (!session.isSaved) event.preventDefault();
  });
  addEventListener("keydown", (event) => {
    if (event.defaultPrevented) return; // the text has taken it
    const isCommand = event.ctrlKey || event.metaKey;
    const key = event.key.toLowerCase();
    if (isCommand && key === "s") {
      event.preventDefault();
      store();
    } else if (isCommand && (key === "z" || key === "y") && !isFilledIn(event.target)) {
      event.preventDefault();
      if (key === "y" || event.shiftKey) session.redo();
      else session.undo();
    } else if (event.key === "Delete" && !isTyping(event) && !text.hasFocus) {
      inspector.delete(selection);
    } else if (event.key === "F2" && !isTyping(event)) inspector.focus();
  });
}
