/** The Enter key in YAML: where the next line begins. */
import { insertNewlineAndIndent } from "@codemirror/commands";
import { EditorSelection } from "@codemirror/state";

const UNIT = "  ";

/**
 * The indentation of a line after another.
 * @param {string} before the line up to the cursor
 * @param {string} next the first line that is not blank after it; empty if there is none
 * @returns {string|null} null: within brackets or quotation marks, where YAML does not say
 */
export function indentationAfter(before, next) {
  const line = before.replace(/(^|\s)#.*$/, "").trimEnd();
  const indent = /^ */.exec(before)?.[0] ?? "";
  const items = /^(?:- +)*/.exec(line.slice(indent.length))?.[0] ?? "";
  const content = line.slice(indent.length + items.length);
  if (line.trim() === "") return indent;
  if (content === "-") return indent + " ".repeat(items.length) + UNIT;
  const open = (content.match(/[[{]/g) ?? []).length - (content.match(/[\]}]/g) ?? []).length;
  if (open > 0 || /^[^'"]*(["'])(?:(?!\1).)*$/.test(content)) return null;
  const column = indent + " ".repeat(items.length);
  if (/:\s*([|>][-+]?)?$/.test(content)) {
    const inner = /^ */.exec(next)?.[0] ?? "";
    // What is written already says how deep: some write lists below their key.
    if (inner.length > column.length || (inner.length === column.length && /^ *- /.test(next))) return inner;
    return column + UNIT;
  }
  return /^[\w.]+\s*:(\s|$)/.test(content) ? column : indent; // the keys of one entry stand below each other
}

/** Begin a new line where YAML wants it. @type {import("@codemirror/view").Command} */
export function newLine(view) {
  const { state } = view;
  const { from, to } = state.selection.main;
  const line = state.doc.lineAt(from);
  let number = state.doc.lineAt(to).number + 1;
  while (number <= state.doc.lines && state.doc.line(number).text.trim() === "") number += 1;
  const indent = indentationAfter(line.text.slice(0, from - line.from), number <= state.doc.lines ? state.doc.line(number).text : "");
  if (state.readOnly || state.selection.ranges.length > 1 || indent === null) return insertNewlineAndIndent(view);
  const rest = /^ */.exec(state.doc.lineAt(to).text.slice(to - state.doc.lineAt(to).from))?.[0].length ?? 0;
  view.dispatch({
    changes: { from, to: to + rest, insert: `\n${indent}` },
    selection: EditorSelection.cursor(from + 1 + indent.length),
    scrollIntoView: true, userEvent: "input",
  });
  return true;
}
