/** The language of the editor and the course: the one that was chosen last, or the browser's. */

const KEPT = "framerunner-language";

/** @returns {"en"|"es"} */
export function language() {
  const kept = localStorage.getItem(KEPT);
  if (kept === "en" || kept === "es") return kept;
  return navigator.language.startsWith("es") ? "es" : "en";
}

/** Show the page in the other language. */
export function changeLanguage() {
  localStorage.setItem(KEPT, language() === "en" ? "es" : "en");
  location.reload();
}

/**
 * Make a function that gives a page's texts.
 *
 * `{name}` in a text stands for a value; `{name:flight|flights}` for the first word if the value is 1, otherwise the second.
 * @template {Object<string, string>} Texts
 * @param {{en: Texts, es: Texts}} words
 * @returns {(key: keyof Texts, values?: Object<string, string>) => string} values replace {names} in the text
 */
export function translator(words) {
  return (key, values = {}) => words[language()][key]?.replace(/\{(\w+)(?::([^|{}]*)\|([^{}]*))?\}/g, (_, name, one, many) => {
    const value = values[name] ?? "";
    if (one === undefined) return value;
    return Number(value) === 1 ? one : many;
  });
}
