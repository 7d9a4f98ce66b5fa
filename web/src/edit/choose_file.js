/** The list of missions, and a form for a new one. */
import { loginAddress } from "../lib/course.js";
import { make } from "../lib/dom.js";
import { language } from "../lib/language.js";
import { pageData } from "../lib/page_data.js";
import { request } from "../lib/request.js";
import { button, choice, textField } from "./fields.js";
import { word } from "./words.js";

/** @param {HTMLElement} root */
export async function chooseFile(root) {
  const { mayEdit } = pageData();
  const problem = make("p", { class: "problem", role: "alert", hidden: true });
  const list = make("ul", { class: "e-files" });
  root.append(make("h1", {}, word("open")), problem, list);
  /** @param {Error & {status?: number}} error */
  const refused = (error) => {
    problem.hidden = false;
    problem.replaceChildren(error.message, " ", error.status === 403 ? make("a", { href: loginAddress() }, word("log_in")) : "");
  };
  const told = await request(`/api/edit/files?language=${language()}`).catch(refused);
  if (!told) return;
  /** @param {string} name */
  const link = (name) => make("li", {}, make("a", { href: `/edit?file=${encodeURIComponent(name)}` }, name));
  list.replaceChildren(...told.files.map(link));
  if (told.files.length === 0) list.append(make("li", { class: "hint" }, word("no_files")));
  if (!mayEdit) return;
  /** Ask for a new file and open it. @param {"files"|"import"} how @param {object} content */
  const create = async (how, content) => {
    const made = await request(`/api/edit/${how}?language=${language()}`, content).catch(refused);
    if (made) location.href = `/edit?file=${encodeURIComponent(made.file)}`;
  };
  let name = "my_mission", source = "empty";
  const sources = [["empty", word("empty")], ["example", word("example")], ...told.missions.map((/** @type {string} */ each) => [each, word("a_copy", { name: each })])];
  root.append(make("form", { class: "panel e-new" },
    textField(word("name"), name, (value) => { name = value; }),
    choice(word("from"), /** @type {[string, string][]} */ (sources), source, (value) => { source = value; }),
    button(word("create"), () => create("files", { name, source })),
    importField((scxml, wanted) => create("import", { name: wanted, scxml }))));
}

/** A field for an SCXML file. @param {(text: string, name: string) => void} chosen */
function importField(chosen) {
  const input = /** @type {HTMLInputElement} */ (make("input", { type: "file", accept: ".scxml,.xml" }));
  input.addEventListener("change", async () => {
    const [picked] = input.files ?? [];
    const name = picked?.name.replace(/\.[^.]*$/, "").toLowerCase().replace(/[^a-z0-9]+/g, "_").replace(/^[^a-z]+/, "");
    if (picked) chosen(await picked.text(), name || "imported");
  });
  return make("label", { class: "e-field" }, make("span", {}, word("import_scxml")), input);
}
