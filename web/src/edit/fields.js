/** Parts of forms. A change is told when the field is left or Enter is pressed, so that each is one edit. */
import { make } from "../lib/dom.js";
import { word } from "./words.js";

/** A button. @param {string} text @param {() => void} press @param {Object<string, string|boolean>} [attributes] */
export function button(text, press, attributes = {}) {
  const element = make("button", { type: "button", ...attributes }, text);
  element.addEventListener("click", press);
  return element;
}

/**
 * A labelled text field.
 * @param {string} label
 * @param {string} value
 * @param {(value: string) => void} change
 * @param {Object<string, string|boolean>} [attributes]
 */
export function textField(label, value, change, attributes = {}) {
  const input = /** @type {HTMLInputElement} */ (make("input", { type: "text", spellcheck: "false", autocomplete: "off", value, title: value || false, ...attributes }));
  input.addEventListener("change", () => change(input.value.trim()));
  input.addEventListener("keydown", (event) => {
    if (event.key === "Escape") {
      input.value = value;
      input.blur();
    } else if (event.key === "Enter") input.blur();
  });
  return make("label", { class: "e-field" }, make("span", {}, label), input);
}

/**
 * A labelled choice.
 * @param {string} label
 * @param {[string, string][]} options values and their words
 * @param {string} value
 * @param {(value: string) => void} change
 */
export function choice(label, options, value, change) {
  const select = /** @type {HTMLSelectElement} */ (make("select", {}, ...options.map(([each, text]) => make("option", { value: each }, text))));
  select.value = value;
  select.addEventListener("change", () => change(select.value));
  return make("label", { class: "e-field" }, make("span", {}, label), select);
}

/** A labelled tick box. @param {string} label @param {boolean} value @param {(value: boolean) => void} change */
export function tickBox(label, value, change) {
  const input = /** @type {HTMLInputElement} */ (make("input", { type: "checkbox" }));
  input.checked = value;
  input.addEventListener("change", () => change(input.checked));
  return make("label", { class: "e-tick" }, input, make("span", {}, label));
}

/**
 * A list of lines that can be changed, moved, removed and added to.
 * @param {string} label
 * @param {string[]} lines
 * @param {(lines: string[]) => void} change
 * @param {string} list id of the list of suggestions
 */
export function lineList(label, lines, change, list) {
  /** @param {number} index @param {...string} others */
  const replaced = (index, ...others) => [...lines.slice(0, index), ...others, ...lines.slice(index + 1)];
  const rows = lines.map((line, index) => make("li", {},
    textField(`${label} ${index + 1}`, line, (value) => change(replaced(index, ...(value ? [value] : []))), { list }),
    button("↑", () => change([...lines.slice(0, index - 1), line, lines[index - 1], ...lines.slice(index + 1)]),
      { class: "e-small", disabled: index === 0, "aria-label": `${word("up")}: ${line}` }),
    button("×", () => change(replaced(index)), { class: "e-small", "aria-label": `${word("remove")}: ${line}` })));
  const more = textField(`${label}: ${word("add_action")}`, "", (value) => value && change([...lines, value]),
    { list, placeholder: word("add_action") });
  return make("fieldset", { class: "e-lines" }, make("legend", {}, label), make("ol", {}, ...rows), more);
}
