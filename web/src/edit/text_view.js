/** The mission's text: CodeMirror, in a shadow tree so that its style sheets need no exception in the page's policy. */
import { basicSetup } from "codemirror";
import { yaml } from "@codemirror/lang-yaml";
import { completionStatus } from "@codemirror/autocomplete";
import { setDiagnostics } from "@codemirror/lint";
import { Annotation, ChangeSet, Compartment, EditorState, Prec, StateEffect, StateField } from "@codemirror/state";
import { Decoration, EditorView, keymap } from "@codemirror/view";
import { HighlightStyle, syntaxHighlighting } from "@codemirror/language";
import { tags } from "@lezer/highlight";
import { newLine } from "./yaml_enter.js";

/** @typedef {import("./session.js").TextChange} TextChange */

const remote = Annotation.define(); // a change that the server has made
/** @type {import("@codemirror/state").StateEffectType<[number, number]>} a part to be marked */
const mark = StateEffect.define();
/** The part of the text that is selected in the diagram; until something is typed or the cursor moves. */
const marked = StateField.define({
  create: () => Decoration.none,
  update(before, transaction) {
    const shown = transaction.effects.find((effect) => effect.is(mark));
    if (shown) return Decoration.set(shown.value[0] < shown.value[1] ? [Decoration.mark({ class: "e-shown" }).range(...shown.value)] : []);
    const isByHand = transaction.selection !== undefined || (transaction.docChanged && !transaction.annotation(remote));
    return isByHand ? Decoration.none : before.map(transaction.changes);
  },
  provide: (field) => EditorView.decorations.from(field),
});
const COLOURS = syntaxHighlighting(HighlightStyle.define([
  { tag: [tags.propertyName, tags.definition(tags.propertyName)], color: "var(--accent)" },
  { tag: [tags.string, tags.content], color: "var(--ink)" },
  { tag: [tags.keyword, tags.atom, tags.labelName, tags.typeName], color: "var(--good)" },
  { tag: [tags.comment, tags.meta], color: "var(--faint)", fontStyle: "italic" },
  { tag: [tags.punctuation, tags.separator, tags.bracket], color: "var(--faint)" },
  { tag: tags.invalid, color: "var(--bad)" },
]));
const MARKED = "color-mix(in srgb, var(--accent) 25%, transparent)";
/** In the page's colours, which are others in the dark. */
const THEME = EditorView.theme({
  "&": { height: "100%", fontSize: "13px", color: "var(--ink)" }, ".cm-scroller": { overflow: "auto" },
  ".cm-gutters": { backgroundColor: "var(--ground)", color: "var(--faint)", borderRight: "1px solid var(--line)" },
  ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "color-mix(in srgb, var(--accent) 8%, transparent)" },
  ".cm-content": { caretColor: "var(--ink)" }, ".cm-cursor, .cm-dropCursor": { borderLeftColor: "var(--ink)" },
  "& > .cm-scroller > .cm-selectionLayer .cm-selectionBackground": { backgroundColor: MARKED },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground": { backgroundColor: MARKED },
  ".cm-selectionMatch, .cm-searchMatch, &.cm-focused .cm-matchingBracket": { backgroundColor: MARKED },
  ".cm-tooltip, .cm-panels": { backgroundColor: "var(--panel)", color: "var(--ink)", border: "1px solid var(--line)" },
  ".cm-tooltip.cm-tooltip-autocomplete > ul > li[aria-selected]": { backgroundColor: "var(--accent)", color: "var(--on-accent)" },
  ".cm-foldPlaceholder, .cm-button, .cm-textfield": {
    backgroundImage: "none", backgroundColor: "var(--ground)", color: "var(--ink)", borderColor: "var(--line)",
  },
  // Instead of CodeMirror's pictures in data URLs, which the page's policy refuses.
  ".cm-lintRange": { backgroundImage: "none", textDecoration: "underline wavy var(--faint)" },
  ".cm-lintRange-error": { backgroundImage: "none", textDecoration: "underline wavy var(--bad)" },
  ".cm-lintRange-warning": { backgroundImage: "none", textDecoration: "underline wavy var(--warn)" },
  ".e-shown": { backgroundColor: MARKED },
  ".cm-lintRange-info": { backgroundImage: "none" },
  ".cm-lintRange-active": { backgroundColor: "color-mix(in srgb, var(--warn) 25%, transparent)" },
});
const SEVERITY = { error: "error", warning: "warning", advice: "info" };

export class TextView {
  #view;
  #shadow;
  /** @type {import("@codemirror/state").ChangeSet|null} what was typed since it was last taken */
  #typed = null;
  #isMoving = false;
  #writable = new Compartment();

  /**
   * @param {HTMLElement} parent
   * @param {{typed: (take: () => TextChange[]) => void, undo: () => void, redo: () => void,
   *   moved: (offset: number) => void}} listener
   */
  constructor(parent, listener) {
    /** @param {() => void} take */
    const step = (take) => () => {
      take();
      return true;
    };
    this.#shadow = parent.attachShadow({ mode: "open" });
    this.#view = new EditorView({
      parent: this.#shadow,
      root: this.#shadow,
      extensions: [
        // Diagram and text have one history, which the server keeps.
        Prec.highest(keymap.of([
          { key: "Mod-z", run: step(listener.undo), preventDefault: true },
          { key: "Mod-y", run: step(listener.redo), preventDefault: true },
          { key: "Mod-Shift-z", run: step(listener.redo), preventDefault: true },
          { key: "Enter", run: (view) => completionStatus(view.state) !== "active" && newLine(view) },
        ])),
        this.#writable.of([]),
        basicSetup,
        yaml(),
        marked,
        EditorView.lineWrapping,
        THEME,
        COLOURS,
        EditorView.contentAttributes.of({ "aria-label": "mission, YAML" }),
        EditorView.updateListener.of((update) => {
          if (update.docChanged && !update.transactions.some((each) => each.annotation(remote))) {
            this.#typed = this.#typed ? this.#typed.compose(update.changes) : update.changes;
            listener.typed(() => this.#take());
          }
          // While something is typed, what it means is not known yet: see `cursor`.
          if (update.selectionSet && !update.docChanged && !this.#isMoving) listener.moved(update.state.selection.main.head);
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
    this.#typed = null;
    if (text === this.text) return;
    this.#view.dispatch({
      changes: { from: 0, to: this.#view.state.doc.length, insert: text }, annotations: remote.of(true),
    });
  }

  /** Where the cursor is, if the text has the focus and all that was typed is sent; otherwise null. @returns {number|null} */
  get cursor() {
    return this.hasFocus && this.#typed === null ? this.#view.state.selection.main.head : null;
  }

  /**
   * Make changes that the server has made to the text without what is typed here and not sent.
   * @param {TextChange[]} changes
   * @param {boolean} isShown move the cursor to the last one: it was asked for here
   */
  change(changes, isShown) {
    for (const { start, removed, inserted } of changes) {
      const typed = this.#typed;
      const length = typed ? typed.length : this.#view.state.doc.length;
      let change = ChangeSet.of({ from: start, to: start + removed, insert: inserted }, length);
      if (typed) {
        this.#typed = typed.map(change);
        change = change.map(typed, true);
      }
      const isLast = isShown && this.hasFocus && !typed && changes.at(-1)?.start === start;
      const cursor = isLast ? { selection: { anchor: start + inserted.length }, scrollIntoView: true } : {};
      this.#isMoving = true;
      this.#view.dispatch({ changes: change, annotations: remote.of(true), ...cursor });
      this.#isMoving = false;
    }
  }

  /** Whether nothing can be typed. @param {boolean} isReadOnly */
  setReadOnly(isReadOnly) {
    const extensions = isReadOnly ? [EditorState.readOnly.of(true), EditorView.editable.of(false)] : [];
    this.#view.dispatch({ effects: this.#writable.reconfigure(extensions) });
  }

  /** Mark findings. @param {import("./session.js").Finding[]} findings */
  setFindings(findings) {
    const { length } = this.#view.state.doc;
    const diagnostics = findings.map(({ start, end, severity, message }) => ({
      from: Math.min(start, length), to: Math.min(end, length), severity: SEVERITY[severity], message,
    }));
    this.#view.dispatch(setDiagnostics(this.#view.state, /** @type {any} */ (diagnostics)));
  }

  /** Mark a part of the text, put the cursor before it and scroll to it, without taking the focus. @param {number} start @param {number} end */
  show(start, end) {
    const { length } = this.#view.state.doc;
    this.#isMoving = true;
    this.#view.dispatch({
      selection: { anchor: Math.min(start, length) },
      effects: [
        mark.of([Math.min(start, length), Math.min(end, length)]),
        EditorView.scrollIntoView(Math.min(start, length), { y: end - start > 600 ? "start" : "center", yMargin: 40 }),
      ],
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
