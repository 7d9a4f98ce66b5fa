/** The mission's text: CodeMirror, in a shadow tree so that its style sheets need no exception in the page's policy. */
import { basicSetup } from "codemirror";
import { yaml } from "@codemirror/lang-yaml";
import { setDiagnostics } from "@codemirror/lint";
import { Annotation, EditorSelection } from "@codemirror/state";
import { EditorView } from "@codemirror/view";

/** @typedef {import("./session.js").TextChange} TextChange */

const remote = Annotation.define(); // a change that the server has made
const SEVERITY = { error: "error", warning: "warning", advice: "info" };

export class TextView {
  #view;
  #shadow;
  /** @type {import("@codemirror/state").ChangeSet|null} what was typed since it was last taken */
  #typed = null;
  #isMoving = false;

  /**
   * @param {HTMLElement} parent
   * @param {{typed: (take: () => TextChange[]) => void, moved: (offset: number) => void}} listener
   */
  constructor(parent, listener) {
    this.#shadow = parent.attachShadow({ mode: "open" });
    this.#view = new EditorView({
      parent: this.#shadow,
      root: this.#shadow,
      extensions: [
        basicSetup,
        yaml(),
        EditorView.theme({ "&": { height: "100%", fontSize: "13px" }, ".cm-scroller": { overflow: "auto" } }),
        EditorView.contentAttributes.of({ "aria-label": "mission, YAML" }),
        EditorView.updateListener.of((update) => {
          if (update.docChanged && !update.transactions.some((each) => each.annotation(remote))) {
            this.#typed = this.#typed ? this.#typed.compose(update.changes) : update.changes;
            listener.typed(() => this.#take());
          }
          if (update.selectionSet && !this.#isMoving) listener.moved(update.state.selection.main.head);
        }),
      ],
    });
  }

  /** @returns {TextChange[]} each made for the text after those before it */
  #take() {
    /** @type {TextChange[]} */
    const changes = [];
    this.#typed?.iterChanges((from, to, _newFrom, _newTo, inserted) => {
      changes.unshift({ start: from, removed: to - from, inserted: inserted.toString() });
    });
    this.#typed = null;
    return changes;
  }

  get text() {
    return this.#view.state.doc.toString();
  }

  /** Show a text. @param {string} text */
  setText(text) {
    if (text === this.text) return;
    this.#typed = null;
    this.#view.dispatch({
      changes: { from: 0, to: this.#view.state.doc.length, insert: text }, annotations: remote.of(true),
    });
  }

  /** Make changes that the server has made. @param {TextChange[]} changes */
  change(changes) {
    for (const { start, removed, inserted } of changes) {
      this.#view.dispatch({
        changes: { from: start, to: start + removed, insert: inserted }, annotations: remote.of(true),
      });
    }
  }

  /** Mark findings. @param {import("./session.js").Finding[]} findings */
  setFindings(findings) {
    const { length } = this.#view.state.doc;
    const diagnostics = findings.map(({ span, severity, message }) => ({
      from: Math.min(span?.[0] ?? 0, length), to: Math.min(span?.[1] ?? 0, length), severity: SEVERITY[severity], message,
    }));
    this.#view.dispatch(setDiagnostics(this.#view.state, /** @type {any} */ (diagnostics)));
  }

  /** Select a part of the text and scroll to it, without taking the focus. @param {number} start @param {number} end */
  show(start, end) {
    const { length } = this.#view.state.doc;
    this.#isMoving = true;
    this.#view.dispatch({
      selection: EditorSelection.single(Math.min(start, length), Math.min(end, length)),
      effects: EditorView.scrollIntoView(Math.min(start, length), { y: "center" }),
    });
    this.#isMoving = false;
  }

  focus() {
    this.#view.focus();
  }

  get hasFocus() {
    return this.#view.hasFocus;
  }
}
