/** Small helps for making pages. All texts go in as text; nothing here takes markup. */

/**
 * Make an element.
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Object<string, string|boolean|null>} [attributes] null and false leave one out
 * @param {...(Node|string|null)} children
 * @returns {HTMLElementTagNameMap[Tag]}
 */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null));
  return element;
}

/**
 * Set a text, but only if it is another: a live region would read it out again.
 * @param {Element|null} element which must be there
 * @param {string} text
 */
export function setText(element, text) {
  if (/** @type {Element} */ (element).textContent !== text) {
    /** @type {Element} */ (element).textContent = text;
  }
}

/**
 * Set or take away an attribute, only if that changes something.
 * @param {Element} element
 * @param {string} name
 * @param {string|number|boolean|null} value null and false: taken away
 */
export function setAttribute(element, name, value) {
  if (value === null || value === false) {
    if (element.hasAttribute(name)) element.removeAttribute(name);
  } else if (element.getAttribute(name) !== String(value)) {
    element.setAttribute(name, String(value));
  }
}

/**
 * A number for people; a dash if there is none.
 * @param {number|null|undefined} value
 * @param {number} [decimals]
 */
export function number(value, decimals = 1) {
  if (typeof value !== "number" || !Number.isFinite(value)) return "–";
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

/**
 * A colour of the theme as the browser computes it, for canvases.
 * @param {Element} element in the page
 * @param {string} name such as "--ink"
 */
export function themeColour(element, name) {
  const probe = make("span", { hidden: true });
  probe.style.color = `var(${name})`;
  element.append(probe);
  const colour = getComputedStyle(probe).color;
  probe.remove();
  return colour;
}

/** Whether the page is dark now. @param {Element} element in the page */
export function isDark(element) {
  const channels = themeColour(element, "--ground").match(/[\d.]+/g) ?? ["255"];
  return Number(channels[0]) < 128;
}

/** Call when the theme changes. @param {() => void} hear */
export function onTheme(hear) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", hear);
}

/** Whether this person wants things to stand still. */
export function wantsStillness() {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}

/** Whether a key goes to a field that is being filled in. @param {Event} event */
export function isTyping(event) {
  return event.target instanceof Element && event.target.closest("input, textarea, select, [contenteditable]") !== null;
}
