/** The list of missions, and a form for a new one. */
import { loginAddress } from "../lib/course.js";
import { make } from "../lib/dom.js";
import { language } from "../lib/language.js";
import { pageData } from "../lib/page_data.js";
import { button, choice, textField } from "./fields.js";
import { word } from "./words.js";

/** @param {HTMLElement} root */
export async function chooseFile(root) {
  const { mayEdit } = pageData();
  const problem = make("p", { class: "problem", role: "alert", hidden: true });
  const list = make("ul", { class: "e-files" });
  root.append(make("h1", {}, word("open")), problem, list);
  const answer = await fetch(`/api/edit/files?language=${language()}`);
  const told = await answer.json();
  if (!answer.ok) {
    problem.hidden = false;
    problem.replaceChildren(told.detail, " ", answer.status === 403 ? make("a", { href: loginAddress() }, word("log_in")) : "");
    return;
  }
  const link = (name) => make("li", {}, make("a", { href: `/edit?file=${encodeURIComponent(name)}` }, name));
  list.replaceChildren(...told.files.map(link));
  if (told.files.length === 0) list.append(make("li", { class: "hint" }, word("no_files")));
  if (!mayEdit) return;
  /** Ask for a new file and open it. @param {"files"|"import"} how @param {object} content */
  const create = async (how, content) => {
    const made = await fetch(`/api/edit/${how}?language=${language()}`, {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content),
    });
    const { file: created, detail } = await made.json();
    if (made.ok) location.href = `/edit?file=${encodeURIComponent(created)}`;
    problem.hidden = made.ok;
    problem.textContent = typeof detail === "string" ? detail : made.statusText;
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
