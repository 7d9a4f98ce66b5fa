/** A mission's diagram with its active state lit, and its last transitions. */
export class Statechart {
  /**
   * @param {HTMLElement} element an empty box
   * @param {{small?: boolean}} [options] small: beside other things; it follows the active state from the start
   */
  constructor(element, options = {}) { this.element = element; }

  /** @param {{name: string, mermaid: string, states: string[], source: string}|null} chart */
  async setChart(chart) {}

  /**
   * @param {string|null} id of the active state
   * @param {number} [seconds] in it so far; it counts on by itself
   */
  setState(id, seconds) {}

  /** @param {object[]} list as in the message "transitions", newest first */
  setTransitions(list) {}
}
