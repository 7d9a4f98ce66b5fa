/** The Game Monitor's figures: times, penalty, crossings, verdict. Each number stands in full in `data-value`. */
export class Figures {
  /** @param {HTMLElement} element an empty box */
  constructor(element) { this.element = element; }

  /**
   * @param {object|null} figures as in the live channel's status; null: nobody judges
   * @param {object} [status] the drone's whole status, if there is one
   */
  set(figures, status) {}
}
