/**
 * Starts a page's own modules once its elements stand. The page carries, for each, a data block
 * `<script type="application/json" id="data-NAME" data-module="/static/NAME.js">`.
 */

/**
 * The data that the server gave to a module.
 * @param {string} url the module's own `import.meta.url`
 * @returns {object} empty if there is none
 */
export function pageData(url) {
  const path = new URL(url).pathname;
  const block = document.querySelector(`script[data-module="${CSS.escape(path)}"]`);
  return block ? JSON.parse(block.textContent) : {};
}

function start() {
  for (const block of document.querySelectorAll("script[data-module]")) {
    const script = document.createElement("script");
    script.type = "module";
    script.src = block.dataset.module;
    document.body.append(script);
  }
}

if (document.getElementById("main")) start();
else {
  const observer = new MutationObserver(() => {
    if (!document.getElementById("main")) return;
    observer.disconnect();
    start();
  });
  observer.observe(document.documentElement, { childList: true, subtree: true });
}
