/** The editor's texts in English and Spanish. */
import { translator } from "../lib/language.js";

const WORDS = {
  en: {
    undo: "Undo", redo: "Redo", save: "Save", saved: "saved", unsaved: "not saved", fit: "Show all", arrange: "Arrange",
    new_state: "New state", new_superstate: "New superstate", language: "Español", files: "Missions",
    state: "State", transition: "Transition", mission: "Mission", name: "Name", description: "Description",
    class: "Class", vision: "Vision", initial: "Starts in", final: "final: the end", starts_here: "starts here", uses: "Uses the states of",
    enter: "On entry", during: "During", exit: "On exit", add_action: "Add an action", remove: "Remove", up: "Up", down: "Down",
    transitions: "Transitions, in order", guard: "When (empty: always)", to: "To", event: "Event", priority: "Order",
    actions: "Actions", duplicate: "Duplicate", delete: "Delete", inner: "New state in it", parameters: "Its parameters",
    tick: "at every tick", done: "when finished", resume: "after a pause", variables: "Variables", add_variable: "Add a variable",
    value: "First value", findings: "What the checker says", checker: "Checker", none: "Nothing to complain about: the mission can fly.",
    unreadable: "The text cannot be read at the moment; the diagram shows what was there before.",
    away: "no connection to the editor's program; trying again", restored: "What was not saved last time is here again.",
    others: "also open in another window", names: "Names to use", template_note: "A state of the template {name}: a change applies to all its uses.",
    foreign_note: "Written in the mission that this one extends; it can be changed there.", create: "Create", from: "Start from",
    empty: "an empty chart", example: "an example with comments", a_copy: "a copy of {name}", open: "Open a mission", no_files: "There are no missions in this folder yet.",
    overwrite: "Another program has changed the file. Save anyway?", text: "Text", diagram: "Diagram", add_transition: "Add a transition", new_name: "name",
    lesson: "Lesson", check_lesson: "Check the lesson", checking: "flying …", passed: "Passed!", not_yet: "Not yet", next_lesson: "To the lessons", hints: "Hints",
    fly: "Fly", fly_once: "Fly", fly_paused: "Fly step by step", fly_many: "Fly {count} layouts", pause: "Pause", go_on: "Go on", step: "Step", stop: "Stop",
    break_here: "Stop at the selected state", take_changes: "Take changes", not_flying: "nothing is flying", time_line: "time line of states",
    scenario: "Scenario", or_layout: "or a random layout", speed: "Speed", level: "Level", starting: "starting …", select_state: "select a state first",
    breaks: "pauses on entering {states}", no_breaks: "pauses in no state", flying_many: "flying {count} layouts …", always: "always",
    paused_in: "paused at {where}", verdict: "verdict", lost_in: "lost in", seconds: "seconds", flown_many: "{completed} of {flown} landed in time",
  },
  es: {
    undo: "Deshacer", redo: "Rehacer", save: "Guardar", saved: "guardado", unsaved: "sin guardar", fit: "Ver todo", arrange: "Ordenar",
    new_state: "Estado nuevo", new_superstate: "Superestado nuevo", language: "English", files: "Misiones",
    state: "Estado", transition: "Transición", mission: "Misión", name: "Nombre", description: "Descripción",
    class: "Clase", vision: "Visión", initial: "Empieza en", final: "final: el fin", starts_here: "empieza aquí", uses: "Usa los estados de",
    enter: "Al entrar", during: "Durante", exit: "Al salir", add_action: "Añadir una acción", remove: "Quitar", up: "Subir", down: "Bajar",
    transitions: "Transiciones, por orden", guard: "Cuando (vacío: siempre)", to: "Hacia", event: "Suceso", priority: "Orden",
    actions: "Acciones", duplicate: "Duplicar", delete: "Borrar", inner: "Estado nuevo dentro", parameters: "Sus parámetros",
    tick: "en cada paso", done: "al terminar", resume: "tras una pausa", variables: "Variables", add_variable: "Añadir una variable",
    value: "Primer valor", findings: "Lo que dice el revisor", checker: "Revisor", none: "Nada que objetar: la misión puede volar.",
    unreadable: "Ahora no se puede leer el texto; el diagrama muestra lo que había antes.",
    away: "sin conexión con el programa del editor; se intenta de nuevo", restored: "Lo que no se guardó la última vez está aquí de nuevo.",
    others: "abierto también en otra ventana", names: "Nombres que se pueden usar", template_note: "Un estado de la plantilla {name}: un cambio vale para todos sus usos.",
    foreign_note: "Escrito en la misión que esta amplía; se puede cambiar allí.", create: "Crear", from: "Empezar con",
    empty: "un diagrama vacío", example: "un ejemplo con comentarios", a_copy: "una copia de {name}", open: "Abrir una misión", no_files: "Aún no hay misiones en esta carpeta.",
    overwrite: "Otro programa ha cambiado el archivo. ¿Guardar de todos modos?", text: "Texto", diagram: "Diagrama", add_transition: "Añadir una transición", new_name: "nombre",
    lesson: "Lección", check_lesson: "Comprobar la lección", checking: "volando …", passed: "¡Conseguido!", not_yet: "Aún no", next_lesson: "A las lecciones", hints: "Pistas",
    fly: "Volar", fly_once: "Volar", fly_paused: "Volar paso a paso", fly_many: "Volar {count} disposiciones", pause: "Pausa", go_on: "Seguir", step: "Un paso", stop: "Parar",
    break_here: "Parar en el estado elegido", take_changes: "Usar los cambios", not_flying: "no vuela nada", time_line: "línea de tiempo de los estados",
    scenario: "Escenario", or_layout: "o una disposición al azar", speed: "Velocidad", level: "Nivel", starting: "empezando …", select_state: "elige antes un estado",
    breaks: "pausa al entrar en {states}", no_breaks: "sin pausas", flying_many: "volando {count} disposiciones …", always: "siempre",
    paused_in: "en pausa: {where}", verdict: "veredicto", lost_in: "perdido en", seconds: "segundos", flown_many: "{completed} de {flown} aterrizaron a tiempo",
  },
};

/** A text of the editor. */
export const word = translator(WORDS);
