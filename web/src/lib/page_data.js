/** What the server puts into a page for its script. */

/**
 * The page's data; the page's entry in Python says what it contains.
 * @returns {any} an object, empty if there is none
 */
export function pageData() {
  const block = document.getElementById("page-data");
  return block ? JSON.parse(block.textContent ?? "{}") : {};
}

/**
 * The element that the page's script fills.
 * @param {string} id
 * @returns {HTMLElement}
 */
export function pageRoot(id) {
  const root = document.getElementById(id);
  if (!root) throw new Error(`the page has no element #${id}`);
  return root;
}
