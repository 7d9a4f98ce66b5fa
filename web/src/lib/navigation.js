/** The header's words on pages that have two languages. */
import { language } from "./language.js";

/** @type {Record<string, string>} */
const SPANISH = {
  "Live": "En vivo", "Statechart": "Diagrama", "Editor": "Editor", "Course": "Curso", "Pilot": "Piloto", "Competition": "Competición",
  "Ranking": "Clasificación", "Stage": "Proyección", "Replay": "Repetición", "Log in": "Entrar", "Log out": "Salir", "Skip to the content": "Ir al contenido",
};

/** Set the page's language and show the header in it. */
export function translateHeader() {
  document.documentElement.lang = language();
  if (language() !== "es") return;
  for (const each of document.querySelectorAll(".skip, .top nav a, .top .who a, .top .who button")) {
    each.textContent = SPANISH[each.textContent ?? ""] ?? each.textContent;
  }
}
