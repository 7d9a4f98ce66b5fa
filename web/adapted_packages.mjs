/**
 * What is changed in packages when they are bundled. A new version in which a text below is not found stops the build.
 *
 * Mermaid is made fit for a page whose Content-Security-Policy allows no inline styles: `mermaid.render` returns its
 * drawing as an element instead of text, because styles in a text are refused when it is parsed, and adopts the
 * drawing's style sheet, which it returns as `styles`. Diagrams that the pages do not draw are left out.
 *
 * uPlot draws by the processor, as its small canvases change some five times a second: a browser without a graphics
 * card would emulate one for each of them.
 */
import { readFile } from "node:fs/promises";

const LEFT_OUT = { path: "left-out", namespace: "left-out" };
const EMPTY = "export const diagram = null; export default null;";
const DIAGRAM = /(Diagram(-v2)?|definition|diagram|swimlanes|cose-bilkent|sizeCapture)-[A-Z0-9]{8}\.mjs$/;
const DRAWN = /\/stateDiagram-v2-[A-Z0-9]{8}\.mjs$/;

/** By the end of a file's name: what is replaced by what. CSSOM may set a style, an attribute or an element may not. */
const CHANGES = {
  "d3-selection.mjs": [
    ["this.setAttribute(name, value);", 'name === "style" ? (this.style.cssText = value) : this.setAttribute(name, value);'],
    ["else this.setAttribute(name, v);", 'else name === "style" ? (this.style.cssText = v) : this.setAttribute(name, v);'],
  ],
  "mermaid.core.mjs": [
    [
      /const style1 = document\.createElement\("style"\);\s*style1\.innerHTML = rules;\s*svg\.insertBefore\(style1, firstChild\);/,
      "const styles = new CSSStyleSheet(); styles.replaceSync(rules); document.adoptedStyleSheets.push(styles);",
    ],
    [
      /let code = root\.select\(enclosingDivID_selector\)\.node\(\)\.innerHTML;[\s\S]*?attachFunctions\(\);\s*return code;/,
      "const drawn = root.select(`[id=\"${id39}\"]`).node();"
        + "DOMPurify.sanitize(drawn, { IN_PLACE: true, ADD_TAGS: DOMPURIFY_TAGS, ADD_ATTR: DOMPURIFY_ATTR });"
        + "attachFunctions(); return drawn.cloneNode(true);",
    ],
    ["svg: svgCode,", "svg: svgCode, styles,"],
  ],
  "uPlot.esm.js": [
    ['can.getContext("2d")', 'can.getContext("2d", { willReadFrequently: true })'],
  ],
};

function changed(path, text) {
  const changes = CHANGES[path.split("/").at(-1)] ?? [];
  for (const [before, after] of changes) {
    const result = text.replace(before, () => after);
    if (result === text) throw new Error(`${path} does not contain: ${before}`);
    text = result;
  }
  return text.replace(/\.setAttribute\("style", (\w+)\);/g, ".style.cssText = $1;");
}

/** @returns {import("esbuild").Plugin} */
export function adaptedPackages() {
  return {
    name: "adapted-packages",
    setup(build) {
      build.onResolve({ filter: /^katex$/ }, () => LEFT_OUT);
      build.onResolve({ filter: DIAGRAM }, ({ kind, path }) =>
        kind === "dynamic-import" && !DRAWN.test(path) ? LEFT_OUT : undefined);
      build.onLoad({ filter: /.*/, namespace: "left-out" }, () => ({ contents: EMPTY }));
      build.onLoad({ filter: /\/node_modules\/(mermaid|d3-selection|uplot)\/.*\.m?js$/ }, async ({ path }) => (
        { contents: changed(path, await readFile(path, "utf8")), loader: "js" }
      ));
    },
  };
}
