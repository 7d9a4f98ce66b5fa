/** Panels of which one is shown. */
import { make } from "../lib/dom.js";
import { button } from "./fields.js";

export class Tabs {
  root;
  /** Told the key of the tab that is shown. @type {(key: string) => void} */
  onShow = () => {};
  /** @type {Map<string, {label: string, tab: HTMLElement, panel: HTMLElement}>} */
  #parts = new Map();

  /** @param {[string, string, HTMLElement][]} parts key, label and content; the first is shown */
  constructor(parts) {
    const list = make("div", { class: "e-tab-list", role: "tablist" });
    const panels = parts.map(([key, label, content]) => {
      const tab = button(label, () => this.show(key), { role: "tab", id: `e-tab-${key}`, "aria-controls": `e-panel-${key}` });
      const panel = make("div", { class: "e-tab", role: "tabpanel", id: `e-panel-${key}`, "aria-labelledby": `e-tab-${key}` }, content);
      this.#parts.set(key, { label, tab, panel });
      list.append(tab);
      return panel;
    });
    this.root = make("section", { class: "e-tabs panel" }, list, ...panels);
    this.show(parts[0][0]);
  }

  /** @param {string} key */
  show(key) {
    for (const [each, { tab, panel }] of this.#parts) {
      tab.setAttribute("aria-selected", String(each === key));
      panel.hidden = each !== key;
    }
    this.onShow(key);
  }

  /** Write something behind a tab's label. @param {string} key @param {string} sign */
  mark(key, sign) {
    const { label, tab } = /** @type {{label: string, tab: HTMLElement}} */ (this.#parts.get(key));
    tab.textContent = `${label} ${sign}`;
  }
}
