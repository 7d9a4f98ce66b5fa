/** The form of what is selected: the mission, a state or a transition. Everything in it becomes an edit of the text. */
import { make } from "../lib/dom.js";
import { bounds } from "./names.js";
import { button, choice, lineList, textField, tickBox } from "./fields.js";
import { word } from "./words.js";

/**
 * @typedef {import("./session.js").EditSession} EditSession
 * @import {Documents} from "../lib/messages.js"
 * @typedef {Documents.Node} StateNode
 * @typedef {import("./session.js").Edge} Edge
 * @typedef {import("../lib/diagram/diagram_view.js").Selection} Selection
 */

const ACTIONS = "e-actions", VALUES = "e-values";

export class Inspector {
  #root;
  #session;
  #select;
  /** @type {Selection} */
  #shown = { kind: "mission", id: "" };
  #isStale = false; // the form shows what was there before the last change

  /**
   * @param {HTMLElement} root
   * @param {EditSession} session
   * @param {(selection: Selection) => void} select
   */
  constructor(root, session, select) {
    this.#root = root;
    this.#session = session;
    this.#select = select;
    root.addEventListener("focusout", () => {
      if (this.#isStale) setTimeout(() => this.show(this.#shown)); // after the change that this may be
    });
  }

  /** Show what is selected; the field that has the focus keeps it, and nothing is shown while one is being filled in. @param {Selection} selection */
  show(selection) {
    const isSame = selection.kind === this.#shown.kind && selection.id === this.#shown.id;
    this.#isStale = isSame && this.#isFillingIn();
    this.#shown = selection;
    if (this.#isStale) return;
    const focused = isSame && this.#root.contains(document.activeElement) ? document.activeElement?.getAttribute("data-key") : null;
    const { nodes, edges } = this.#session.diagram;
    const state = selection.kind === "state" ? nodes.find(({ id }) => id === selection.id) : undefined;
    const edge = selection.kind === "transition" ? edges.find(({ id }) => id === selection.id) : undefined;
    const form = state ? this.#state(state) : edge ? this.#transition(edge) : this.#mission();
    this.#root.replaceChildren(...form, this.#suggestions());
    this.#root.querySelectorAll("input, select, button").forEach((each, index) => each.setAttribute("data-key", `${selection.kind}${index}`));
    if (!isSame) this.#root.scrollTop = 0;
    if (focused) /** @type {HTMLElement|null} */ (this.#root.querySelector(`[data-key="${focused}"]`))?.focus();
  }

  #isFillingIn() {
    const field = document.activeElement;
    return field instanceof HTMLInputElement && this.#root.contains(field) && field.type === "text" && field.value !== field.defaultValue;
  }

  /** Put the cursor into the first field. */
  focus() {
    /** @type {HTMLInputElement|null} */ (this.#root.querySelector("input"))?.select();
  }

  /** @param {Documents.EditMessage["edit"]} edit */
  #edit(edit) {
    return this.#session.edit(edit);
  }

  #suggestions() {
    const { values, primitives } = this.#session.catalogue;
    /** @param {string} value @param {string} text */
    const option = (value, text) => make("option", { value, label: text });
    return make("div", { hidden: true },
      make("datalist", { id: ACTIONS },
        ...primitives.map(({ name, text }) => option(name, text)),
        ...values.filter(({ assignable }) => assignable).map((value) => option(`${value.name} = `, `${value.text} ${bounds(value)}`))),
      make("datalist", { id: VALUES },
        ...values.map((value) => option(value.type === "condition" ? value.name : `${value.name} < `, `${value.text} ${bounds(value)}`))));
  }

  #mission() {
    const { mission, variables, templates, diagram } = this.#session;
    /** @type {(key: string) => (value: string) => Promise<boolean>} */
    const set = (key) => (value) => this.#edit({ kind: "set_mission", key, value });
    const top = diagram.nodes.filter(({ parent }) => parent === "").map(({ name }) => name);
    const uses = templates.map((name) => make("li", {}, make("span", {}, name),
      button("+", () => this.#addUser(name), { class: "e-small", "aria-label": word("use_template", { name }), title: word("use_template", { name }) }),
      button("×", () => this.#edit({ kind: "delete_state", state: `@${name}` }), { class: "e-small", "aria-label": `${word("remove")}: ${name}` })));
    const rows = Object.entries(variables).map(([name, value]) => make("li", {},
      textField(name, value, (next) => this.#edit({ kind: "set_variable", name, value: next || null })),
      button("×", () => this.#edit({ kind: "set_variable", name, value: null }), { class: "e-small", "aria-label": `${word("remove")}: ${name}` })));
    return [
      make("h2", {}, word("mission")),
      textField(word("name"), mission.name, set("name")),
      textField(word("description"), mission.description, set("description")),
      choice(word("class"), [["", "contest"], ["open", "open"]], mission.class === "open" ? "open" : "", set("class")),
      choice(word("vision"), [["", "boxes"], ["frames", "frames"]], mission.vision === "frames" ? "frames" : "", set("vision")),
      choice(word("initial"), top.map((name) => [name, name]), mission.initial, (name) => this.#edit({ kind: "set_initial", state: "", name })),
      make("fieldset", { class: "e-lines" }, make("legend", {}, word("variables")), make("ul", {}, ...rows),
        textField(word("add_variable"), "", (name) => name && this.#edit({ kind: "set_variable", name, value: "0" }), { placeholder: word("new_name") })),
      ...(uses.length > 0 ? [make("fieldset", { class: "e-lines" }, make("legend", {}, word("templates")), make("ul", {}, ...uses))] : []),
    ];
  }

  /** @param {StateNode} state */
  #state(state) {
    const { diagram, templates } = this.#session;
    const title = make("h2", {}, `${word("state")} ${state.name}`);
    if (!state.source) return [title, make("p", { class: "hint" }, word("foreign_note"))];
    const path = state.source;
    const inner = diagram.nodes.filter(({ parent }) => parent === state.id);
    const isTop = !path.startsWith("@") || path.includes(".");
    const start = state.parent === "" ? diagram.initial : diagram.nodes.find(({ id }) => id === state.parent)?.initial;
    /** @param {boolean} value */
    const initial = (value) => value && this.#edit({ kind: "set_initial", state: path.includes(".") ? path.replace(/\.[^.]+$/, "") : "", name: state.name });
    /** @param {"enter"|"during"|"exit"} section */
    const actions = (section) => {
      const above = section === "enter" ? this.#parametersFirst(state) : [];
      return lineList(word(section), state[section].slice(above.length),
        (list) => this.#edit({ kind: "set_actions", state: path, section, actions: [...above, ...list] }), ACTIONS);
    };
    const own = diagram.edges.filter(({ source }) => source === state.id);
    return [
      title,
      ...(path.startsWith("@") ? [make("p", { class: "hint" }, word("template_note", { name: path.slice(1).split(".")[0] }))] : []),
      textField(word("name"), state.name, (name) => this.#rename(state, name)),
      make("div", { class: "e-row" },
        tickBox(word("starts_here"), start === state.id, initial),
        inner.length === 0 ? tickBox(word("final"), state.final, (final) => this.#edit({ kind: "set_final", state: path, final })) : null),
      ...(isTop && !path.startsWith("@") && (inner.length === 0 || state.template) && templates.length > 0
        ? [choice(word("uses"), [["", "–"], ...templates.map((name) => /** @type {[string, string]} */ ([name, name]))], state.template,
          (template) => this.#edit({ kind: "set_use", state: path, template }))] : []),
      ...(templates.includes(state.template)
        ? [textField(word("template_name"), state.template, (name) => name !== state.template && this.#edit({ kind: "rename_state", state: `@${state.template}`, name }))] : []),
      ...(state.template ? this.#parameters(state) : []),
      actions("enter"), actions("during"), actions("exit"),
      this.#transitions(state, own),
      make("div", { class: "e-row" },
        state.template && !templates.includes(state.template) ? null : button(word("inner"), () => this.#addInner(state)),
        button(word("duplicate"), () => this.#duplicate(state)),
        button(word("delete"), () => this.delete({ kind: "state", id: state.id }), { class: "e-danger" })),
    ];
  }

  /** The actions on entry that are shown as parameters, if all others follow them. @param {StateNode} state @returns {string[]} */
  #parametersFirst({ template, parameters, enter }) {
    const first = template ? enter.slice(0, parameters.length) : [];
    return first.every((action, index) => action.split("=")[0].trim() === parameters[index][0]) ? first : [];
  }

  /** @param {StateNode} state */
  #parameters(state) {
    const first = this.#parametersFirst(state);
    const rows = state.parameters.map(([name, value], index) => make("li", {},
      textField(name, value, (next) => this.#edit({ kind: "set_parameter", state: state.source, name, value: next })),
      first.length > 0 ? button("×", () => this.#edit({ kind: "set_actions", state: state.source, section: "enter", actions: state.enter.filter((_, at) => at !== index) }),
        { class: "e-small", "aria-label": `${word("remove")}: ${first[index]}` }) : null));
    return rows.length > 0 ? [make("fieldset", { class: "e-lines" }, make("legend", {}, word("parameters")), make("ul", {}, ...rows))] : [];
  }

  /** @param {StateNode} state @param {Edge[]} edges */
  #transitions(state, edges) {
    const names = { tick: "", done: word("done"), resume: word("resume") };
    const rows = edges.map((edge) => make("li", {},
      button(`${edge.event === "tick" ? edge.order + 1 : names[edge.event]} → ${edge.target}${edge.when ? `: ${edge.when}` : ""}`,
        () => this.#select({ kind: "transition", id: edge.id }), { class: "e-link" })));
    const targets = this.#targets(state.id);
    const add = choice(word("add_transition"), [["", "…"], ...targets], "",
      (to) => to && this.addTransition(state.id, to));
    return make("fieldset", { class: "e-lines" }, make("legend", {}, word("transitions")), make("ul", {}, ...rows), add);
  }

  /** Add a transition and show its form. @param {string} from id of a state of this document @param {string} to id of a state */
  async addTransition(from, to) {
    const { nodes, edges } = this.#session.diagram;
    const count = edges.filter(({ source, event }) => source === from && event === "tick").length;
    const state = nodes.find(({ id }) => id === from)?.source;
    if (await this.#edit({ kind: "add_transition", state, to: this.#session.target(from, to) })) {
      this.#select({ kind: "transition", id: `${from}/tick/${count}` });
      this.focus();
    }
  }

  /** The states to which a transition can lead. @param {string} _from @returns {[string, string][]} */
  #targets(_from) {
    return this.#session.diagram.nodes.map(({ id }) => [id, id]);
  }

  /** @param {Edge} edge */
  #transition(edge) {
    const title = make("h2", {}, `${word("transition")} ${edge.source} → ${edge.target}`);
    if (!edge.source_state) return [title, make("p", { class: "hint" }, word("foreign_note"))];
    const transition = { state: edge.source_state, event: edge.event, index: edge.source_index };
    const isTick = edge.event === "tick";
    const events = /** @type {[string, string][]} */ (["tick", "done", "resume"].map((event) => [event, word(/** @type {any} */ (event))]));
    const siblings = this.#session.diagram.edges.filter(({ source, event }) => source === edge.source && event === "tick").length;
    const orders = /** @type {[string, string][]} */ (Array.from({ length: siblings }, (_, index) => [String(index), String(index + 1)]));
    /** @param {string} event @param {string|number} index */
    const follow = (event, index) => this.#select({ kind: "transition", id: `${edge.source}/${event}/${index}` });
    return [
      title,
      ...(edge.source_state.startsWith("@") ? [make("p", { class: "hint" }, word("template_note", { name: edge.source_state.slice(1).split(".")[0] }))] : []),
      ...(isTick ? [textField(word("guard"), edge.when, (when) => this.#edit({ kind: "set_guard", transition, when }), { list: VALUES })] : []),
      choice(word("to"), edge.missing ? [[edge.target, `${edge.target} ?`], ...this.#targets(edge.source)] : this.#targets(edge.source), edge.target, (to) => this.#edit({ kind: "redirect_transition", transition, to: this.#session.target(edge.source, to) })),
      choice(word("event"), events, edge.event, async (event) => {
        if (await this.#edit({ kind: "set_event", transition, event })) follow(event, event === "tick" ? siblings : 0);
      }),
      ...(isTick ? [
        choice(word("priority"), orders, String(edge.order), async (index) => {
          if (await this.#edit({ kind: "move_transition", transition, index: Number(index) })) follow("tick", index);
        }),
        lineList(word("actions"), edge.actions, (actions) => this.#edit({ kind: "set_transition_actions", transition, actions }), ACTIONS),
      ] : []),
      make("div", { class: "e-row" },
        button(word("delete"), () => this.delete({ kind: "transition", id: edge.id }), { class: "e-danger" })),
    ];
  }

  /** A name that no state at a place has yet. @param {string} wanted @param {string} parent */
  #freeName(wanted, parent) {
    const taken = new Set(this.#session.diagram.nodes.filter((each) => each.parent === parent).map(({ name }) => name));
    const base = wanted.replace(/_\d+$/, "");
    for (let number = 1; ; number += 1) {
      const name = number === 1 ? base : `${base}_${number}`;
      if (!taken.has(name)) return name;
    }
  }

  /** @param {StateNode} state @param {string} name */
  async #rename(state, name) {
    if (name === state.name) return;
    if (await this.#edit({ kind: "rename_state", state: state.source, name })) {
      this.#select({ kind: "state", id: [state.parent, name].filter(Boolean).join(".") });
    }
  }

  /** A new state at the top, or a superstate with one state in it. @param {boolean} isSuper */
  async add(isSuper) {
    const name = this.#freeName(isSuper ? "group" : "state", "");
    if (await this.#edit({ kind: "add_state", name, states: isSuper ? ["first"] : [] })) {
      this.#select({ kind: "state", id: name });
      this.focus();
    }
  }

  /** A new template with one state, and a state that uses it: a template alone is not part of the chart. */
  async addTemplate() {
    const { templates } = this.#session;
    let name = "template";
    for (let number = 2; templates.includes(name); number += 1) name = `template_${number}`;
    if (await this.#edit({ kind: "add_template", name, states: ["first"] })) await this.#addUser(name);
  }

  /** A new state that uses a template. @param {string} template */
  async #addUser(template) {
    const name = this.#freeName("group", "");
    if (await this.#edit({ kind: "add_state", name, use: template })) {
      this.#select({ kind: "state", id: name });
      this.focus();
    }
  }

  /** @param {StateNode} state */
  async #addInner(state) {
    const name = this.#freeName("state", state.id);
    if (await this.#edit({ kind: "add_state", name, parent: state.template ? `@${state.template}` : state.source })) {
      this.#select({ kind: "state", id: `${state.id}.${name}` });
      this.focus();
    }
  }

  /** @param {StateNode} state */
  async #duplicate(state) {
    const name = this.#freeName(state.name, state.parent);
    if (await this.#edit({ kind: "duplicate_state", state: state.source, name })) {
      this.#select({ kind: "state", id: [state.parent, name].filter(Boolean).join(".") });
      this.focus();
    }
  }

  /** Delete a state with the transitions to it, or a transition. @param {Selection} selection */
  async delete({ kind, id }) {
    const { nodes, edges } = this.#session.diagram;
    const state = kind === "state" ? nodes.find((each) => each.id === id) : undefined;
    const edge = kind === "transition" ? edges.find((each) => each.id === id) : undefined;
    let done = false;
    if (state?.source) done = await this.#edit({ kind: "delete_state", state: state.source, references: "delete" });
    else if (edge?.source_state) {
      done = await this.#edit({
        kind: "delete_transition", transition: { state: edge.source_state, event: edge.event, index: edge.source_index },
      });
    }
    if (done) this.#select({ kind: "mission", id: "" });
  }
}
