/**
 * Bundles the pages into ../framerunner/monitor/static: each folder of src/ with a main.js or main.css is an entry, `lib/` is shared.
 * The same sources and package-lock.json give the same bytes; `make web-check` compares them with what is committed.
 *
 *     node build.mjs [OUTPUT_FOLDER]
 */
import { copyFile, mkdir, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { existsSync } from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { adaptedPackages } from "./adapted_packages.mjs";

const HERE = path.dirname(fileURLToPath(import.meta.url));
const SOURCE = path.join(HERE, "src");
const OUTPUT = path.resolve(process.argv[2] ?? path.join(HERE, "..", "framerunner", "monitor", "static"));
const LICENCE = /^(licen[cs]e|copying|notice)(\.|-|$)/i;

/** The entries: "live" from src/live/main.js. */
async function entries() {
  const folders = (await readdir(SOURCE)).sort();
  return Object.fromEntries(folders.flatMap((name) => {
    const found = ["main.js", "main.css"].map((file) => path.join(SOURCE, name, file)).find(existsSync);
    return found ? [[name, found]] : [];
  }));
}

/** The folder of the package that a bundled file is part of; null for our own files. */
function packageOf(file) {
  const match = /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(file.replaceAll(path.sep, "/"));
  return match ? match[1] : null;
}

/** Names, versions and licences of all packages of which something is in the bundles. */
async function licences(outputs) {
  const inputs = Object.values(outputs).flatMap((output) => Object.entries(output.inputs));
  const bundled = inputs.filter(([, { bytesInOutput }]) => bytesInOutput > 0).map(([file]) => packageOf(file));
  const folders = [...new Set(bundled.filter(Boolean))].sort();
  const parts = [];
  for (const folder of folders) {
    const about = JSON.parse(await readFile(path.join(HERE, folder, "package.json"), "utf8"));
    const files = (await readdir(path.join(HERE, folder))).filter((name) => LICENCE.test(name)).sort();
    const texts = await Promise.all(files.map((name) => readFile(path.join(HERE, folder, name), "utf8")));
    const text = texts.length > 0 ? texts.join("\n") : `Licence: ${about.license} (the package contains no text of it)`;
    parts.push(`${about.name} ${about.version}${about.license ? `, ${about.license}` : ""}\n\n${text.replaceAll("\r\n", "\n").trim()}\n`);
  }
  const line = `\n${"-".repeat(100)}\n\n`;
  return `The bundles in this folder contain parts of these packages.\n${line}${parts.join(line)}`;
}

await rm(OUTPUT, { recursive: true, force: true });
await mkdir(OUTPUT, { recursive: true });
const result = await build({
  absWorkingDir: HERE,
  entryPoints: await entries(),
  outdir: OUTPUT,
  bundle: true,
  splitting: true,
  format: "esm",
  target: "es2022",
  minify: true,
  chunkNames: "chunks/[name]-[hash]",
  legalComments: "none", // they are in the file of licences
  metafile: true,
  logLevel: "warning",
  plugins: [adaptedPackages()],
});
await writeFile(path.join(OUTPUT, "third-party-licences.txt"), await licences(result.metafile.outputs));
await copyFile(path.join(SOURCE, "shell", "icon.svg"), path.join(OUTPUT, "icon.svg"));
