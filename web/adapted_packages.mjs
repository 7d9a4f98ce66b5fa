/**
 * What is changed in packages when they are bundled. A new version in which a text below is not found stops the build.
 *
 * uPlot draws by the processor, as its small canvases change some five times a second: a browser without a graphics
 * card would emulate one for each of them.
 */
import { readFile } from "node:fs/promises";

const BEFORE = 'can.getContext("2d")';
const AFTER = 'can.getContext("2d", { willReadFrequently: true })';

/** @returns {import("esbuild").Plugin} */
export function adaptedPackages() {
  return {
    name: "adapted-packages",
    setup(build) {
      build.onLoad({ filter: /\/node_modules\/uplot\/.*\/uPlot\.esm\.js$/ }, async ({ path }) => {
        const text = await readFile(path, "utf8");
        if (!text.includes(BEFORE)) throw new Error(`${path} does not contain: ${BEFORE}`);
        return { contents: text.replace(BEFORE, AFTER), loader: "js" };
      });
    },
  };
}
