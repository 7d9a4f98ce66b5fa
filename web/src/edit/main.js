/** The mission editor: diagram and text of one mission, each following the other; without one, the list of missions. */
import "./edit.css";
import { translateHeader } from "../lib/navigation.js";
import { pageRoot } from "../lib/page_data.js";
import { chooseFile } from "./choose_file.js";
import { Editor } from "./editor.js";

const query = new URLSearchParams(location.search);
const file = query.get("file");
translateHeader();

if (file) new Editor(pageRoot("edit"), file, query.get("lesson"));
else chooseFile(pageRoot("edit"));
