/** Shows all rows of a list in a box of fixed height: smaller if they do not fit, then in pages that follow each other. */
import { setText } from "../dom.js";

const SIZES = [1, 0.94, 0.88, 0.82, 0.76, 0.7, 0.64, 0.58]; // of the letters, as shares of the usual size
const PAGE_MS = 8000;

export class Pages {
  #box;
  #list;
  #note;
  #isBounded;
  /** @type {HTMLElement[][]} */
  #pages = [];
  #shown = 0;
  #timer = 0;

  /**
   * @param {HTMLElement} box its style has `--fit`, the share of the usual size
   * @param {HTMLElement} list in it; its children are the rows
   * @param {HTMLElement} note says which teams are shown, if that is not all of them; a click shows the next page
   * @param {() => boolean} [isBounded] whether the box has a height of its own; otherwise all is shown and the page scrolls
   */
  constructor(box, list, note, isBounded = () => true) {
    this.#box = box;
    this.#list = list;
    this.#note = note;
    this.#isBounded = isBounded;
    note.hidden = true;
    note.addEventListener("click", () => this.#turn());
    new ResizeObserver(() => this.fit()).observe(box);
  }

  /** Call after the rows have changed. */
  fit() {
    const rows = /** @type {HTMLElement[]} */ ([...this.#list.children]);
    for (const row of rows) row.hidden = false;
    this.#pages = [rows];
    if (this.#isBounded() && rows.length > 0) this.#choose(rows);
    else this.#box.style.setProperty("--fit", "1");
    this.#shown = Math.min(this.#shown, this.#pages.length - 1);
    this.#show();
  }

  /**
   * The largest size with which all fit; if none does, the largest with the fewest pages.
   * @param {HTMLElement[]} rows
   */
  #choose(rows) {
    const cuts = SIZES.map((size) => {
      this.#box.style.setProperty("--fit", String(size));
      return this.#cut(rows);
    });
    const fewest = Math.min(...cuts.map(({ length }) => length));
    const best = cuts.findIndex(({ length }) => length === fewest);
    this.#box.style.setProperty("--fit", String(SIZES[best]));
    this.#pages = cuts[best];
  }

  /** Pages of about the same length. @param {HTMLElement[]} rows */
  #cut(rows) {
    const places = rows.map((row) => row.getBoundingClientRect());
    const room = this.#box.getBoundingClientRect().bottom - places[0].top;
    /** @param {number} from @param {number} to */
    const fits = (from, to) => places[to - 1].bottom - places[from].top <= room;
    /** @param {number} from */
    const filled = (from) => {
      let to = from + 1;
      while (to < rows.length && fits(from, to + 1)) to += 1;
      return to;
    };
    /** @param {(from: number) => number} end */
    const cut = (end) => {
      /** @type {HTMLElement[][]} */
      const pages = [];
      for (let from = 0; from < rows.length;) {
        const to = end(from);
        pages.push(rows.slice(from, to));
        from = to;
      }
      return pages;
    };
    const full = cut(filled);
    const each = Math.ceil(rows.length / full.length);
    const even = cut((from) => Math.min(from + each, filled(from)));
    return even.length === full.length ? even : full;
  }

  #turn() {
    this.#shown = (this.#shown + 1) % this.#pages.length;
    this.#show();
  }

  #show() {
    const rows = this.#pages.flat(), page = this.#pages[this.#shown];
    for (const row of rows) row.hidden = !page.includes(row);
    const first = rows.indexOf(page[0]) + 1;
    this.#note.hidden = this.#pages.length < 2;
    setText(this.#note, `${first} to ${first + page.length - 1} of ${rows.length}`);
    clearTimeout(this.#timer);
    if (this.#pages.length > 1) this.#timer = setTimeout(() => this.#turn(), PAGE_MS);
  }
}
