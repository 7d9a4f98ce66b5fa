/** Lets Mermaid draw a state diagram. Its text comes from a drone: no settings of its own, no links, no markup. */

const LONGEST_TEXT = 200000; // Mermaid would draw on a longer one for minutes
const FONT = "system-ui, sans-serif";
let count = 0;

/** @typedef {{svg: SVGSVGElement, styles: CSSStyleSheet}} Diagram styles: adopted by the page; they apply
 *   to this drawing only, by its id */

/**
 * Draw a diagram.
 * @param {string} text
 * @param {"LR"|"TB"} direction in which superstates follow each other; within them it goes down
 * @returns {Promise<Diagram>} throws an Error if it cannot be drawn
 */
export async function drawDiagram(text, direction) {
  if (text.length > LONGEST_TEXT) throw new Error("it is too long");
  const { default: mermaid } = await import("mermaid");
  mermaid.initialize({
    startOnLoad: false, securityLevel: "strict", htmlLabels: false, flowchart: { htmlLabels: false },
    suppressErrorRendering: true, maxTextSize: LONGEST_TEXT, theme: "neutral", fontFamily: FONT,
  });
  const plain = text
    .replace(/%%\{[\s\S]*?\}%%/g, "")
    .split("\n")
    .filter((line) => !/^\s*(click\s|---|%%|direction\s)/.test(line))
    .join("\n")
    .replace(/^(\s*stateDiagram(-v2)?)[^\n]*/, `$1\n    direction ${direction}`)
    .replace(/^(\s*state .*\{)\s*$/gm, "$1\n    direction TB");
  if (!/^\s*stateDiagram/.test(plain)) throw new Error("it is no state diagram");
  count += 1;
  const { svg, styles } = /** @type {Diagram} */ (/** @type {unknown} */ (await mermaid.render(`m-chart-${count}`, plain)));
  for (const part of svg.querySelectorAll("script, style, a, foreignObject, image")) part.remove();
  decode(svg);
  return { svg, styles };
}

/** Take a drawing's style sheet away. @param {Diagram|null} diagram */
export function forget(diagram) {
  document.adoptedStyleSheets = document.adoptedStyleSheets.filter((each) => each !== diagram?.styles);
}

/** Mermaid has placeholders in its texts for entities such as `#lt;`. @param {SVGElement} svg */
function decode(svg) {
  const texts = document.createTreeWalker(svg, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const { data } = /** @type {Text} */ (texts.currentNode);
    if (!data.includes("ﬂ°")) continue;
    const escaped = data.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
    const html = escaped.replaceAll("ﬂ°°", "&#").replaceAll("ﬂ°", "&").replaceAll("¶ß", ";");
    texts.currentNode.nodeValue = new DOMParser().parseFromString(html, "text/html").body.textContent;
  }
}

/** Load Mermaid and its parser before a mission is received: in flight that would stop the page for up to a second. */
function prepare() {
  drawDiagram("stateDiagram-v2\n    [*] --> ready", "TB").then(forget).catch((error) => console.info(`no diagrams: ${error.message}`));
}

if ("requestIdleCallback" in window) requestIdleCallback(prepare, { timeout: 2000 });
else setTimeout(prepare, 500);
