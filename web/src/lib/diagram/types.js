/** What a diagram shows: a mission's chart. */

/**
 * @typedef {[number, number]|null} Span offsets of the first character and of the one after the last
 * @typedef {{severity: "error"|"warning"|"advice", code: string, message: string, spanish?: string, line: number, span: Span,
 *   state: string, event: string|null, index: number|null, nodes: string[]}} Finding
 * @typedef {{id: string, name: string, parent: string, initial: string, final: boolean, finish: boolean, enter: string[],
 *   during: string[], exit: string[], parameters: [string, string][], template: string, source: string, span: Span}} StateNode
 * @typedef {{id: string, source: string, target: string, missing: boolean, event: "tick"|"done"|"resume", order: number, when: string,
 *   actions: string[], source_state: string, source_index: number, span: Span}} Edge
 * @typedef {{initial: string, readable: boolean, nodes: StateNode[], edges: Edge[]}} Diagram the chart as it is flown
 * @typedef {{x: number, y: number}} Point
 */

export {};
