"""Configuration of Sphinx: `make docs` builds these pages and the API reference into build/docs.

Nothing is fetched, neither when the pages are built nor when they are read.
"""

from __future__ import annotations

import inspect
import os
import re
from importlib import metadata
from pathlib import Path

from docutils import nodes
from pydantic import BaseModel
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

_ROOT = Path(__file__).parents[1]
_ROOT_PAGES = {"contributing": "CONTRIBUTING.md", "changelog": "CHANGELOG.md"}
_WORDS_A_MINUTE = 200
_OWN_TIME = re.compile(r"^Time: ", re.MULTILINE)
_DIAGRAM = re.compile(r"^```mermaid\n.*?^```\n", re.MULTILINE | re.DOTALL)
_OPTION = re.compile(r"(?<!`)--[a-z][a-z-]*")
_FIELD_COMMENT = re.compile(r"^    (\w+): [^#\n]*# (.+)$", re.MULTILINE)
# `make docs` names the folder with Mermaid's script if it could be had; without it, diagrams are texts.
_MERMAID = os.environ.get("FRAMERUNNER_MERMAID", "")
_DRAWS = (Path(_MERMAID) / "mermaid.min.js").is_file()
_DIAGRAM_NOTE = "\n*A diagram in the language of Mermaid, which GitHub and <https://mermaid.live> draw.*\n"

project = "framerunner"
release = version = metadata.version("framerunner")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]

html_theme = "furo"
html_static_path = [_MERMAID, "scripts"] if _DRAWS else []
html_js_files = ["mermaid.min.js", "diagrams.js"] if _DRAWS else []
html_title = f"framerunner {release}"
html_copy_source = False
html_show_copyright = False

myst_heading_anchors = 4
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_member_order = "bysource"
autodoc_inherit_docstrings = False
napoleon_numpy_docstring = False
napoleon_use_ivar = True

# For `make docs-links`: addresses of this machine and of examples are not looked up.
linkcheck_ignore = [r"https?://(127\.0\.0\.1|localhost|0\.0\.0\.0|192\.168\.|[\w.]*example\.)"]


def _read_page(app: Sphinx, page: str, source: list[str]) -> None:
    """Adapt a page to the site, where pages of the folder above have other places.

    Whoever reads the files in the repository needs none of this.
    """
    text = source[0]
    if page in _ROOT_PAGES:
        file = _ROOT / _ROOT_PAGES[page]
        app.env.note_dependency(str(file))
        text = file.read_text(encoding="utf-8").replace("](docs/", "](")
    for name, above in _ROOT_PAGES.items():
        text = re.sub(rf"\]\((?:\.\./)*{re.escape(above)}", f"](/{name}.md", text)
    source[0] = text if _DRAWS else _DIAGRAM.sub(lambda found: found.group() + _DIAGRAM_NOTE, text)


def _add_reading_time(_app: Sphinx, page: nodes.document) -> None:
    """Say below the title how long a page takes to read, unless it says a time itself, as tutorials do."""
    text = page.astext()
    title = next(page.findall(nodes.title), None)
    if title is None or _OWN_TIME.search(text):
        return
    minutes = max(1, round(len(text.split()) / _WORDS_A_MINUTE))
    words = f"Reading time: {minutes} {'minute' if minutes == 1 else 'minutes'}"
    place = title.parent.index(title) + 1
    title.parent.insert(place, nodes.paragraph("", "", nodes.emphasis(words, words)))


def _descriptions(value: type) -> dict[str, str]:
    """What is said of each field of a class: by pydantic's `Field`, or by a comment behind it."""
    if issubclass(value, BaseModel):
        return {name: field.description or "" for name, field in value.model_fields.items()}
    comments = dict(_FIELD_COMMENT.findall(inspect.getsource(value)))
    hints = inspect.get_annotations(value, eval_str=True)
    said = {name: getattr(hint, "__metadata__", ()) for name, hint in hints.items()}
    fields = {
        name: [each.description for each in found if hasattr(each, "description")]
        for name, found in said.items()
    }
    return {
        name: "".join(fields[name]) or comments.get(name, "") for name in hints if not name.startswith("_")
    }


def _document_fields(
    _app: Sphinx, _kind: str, _name: str, value: object, _options: object, lines: list[str]
) -> None:
    """List the fields of a class whose docstring has no section for them."""
    if isinstance(value, type) and not any(line.startswith(":ivar ") for line in lines):
        marked = {name: text.replace("`", "``") for name, text in _descriptions(value).items()}
        texts = {name: _OPTION.sub(r"``\g<0>``", text) for name, text in marked.items()}
        lines += ["", *(f":ivar {name}: {text}" for name, text in texts.items())]


def _leave_out_signature(
    _app: Sphinx, _kind: str, _name: str, value: object, *_others: object
) -> tuple[str, None] | None:
    """A model is made of a file: the arguments of its constructor are its fields once more."""
    is_model = isinstance(value, type) and issubclass(value, BaseModel)
    return ("", None) if is_model else None


def setup(app: Sphinx) -> None:
    """Connect what is above with Sphinx."""
    app.add_lexer("mermaid", TextLexer)
    app.connect("source-read", _read_page)
    app.connect("doctree-read", _add_reading_time)
    app.connect("autodoc-process-docstring", _document_fields)
    app.connect("autodoc-process-signature", _leave_out_signature)
