"""Writes the types of the messages between pages and monitor, `web/src/lib/messages.d.ts`, from their models.

python web/page_types.py [OUTPUT_FILE]
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from framerunner.editing import editor_messages as flights
from framerunner.editing.documents import document_messages as documents
from framerunner.monitor import live_messages, manual_channel
from framerunner.monitor.competition import views as contest
from framerunner.wire import operator_messages

_OUTPUT = Path(__file__).parent / "src" / "lib" / "messages.d.ts"
_CHANNELS: dict[str, tuple[Any, Any]] = {  # by name: what pages send, what they are sent
    "Contest": (None, contest.Message),
    "Documents": (documents.PageMessage, documents.ToPage),
    "Flights": (flights.Request, flights.ToPage),
    "Live": (None, live_messages.LiveMessage),
    "ManualControl": (manual_channel.FromPage, manual_channel.ToPage),
    "Operator": (operator_messages.PageDemand, operator_messages.ToPage),
}
_PLAIN = {"string": "string", "integer": "number", "number": "number", "boolean": "boolean", "null": "null"}


def page_types() -> str:
    """The file's text."""
    head = "// Made by web/page_types.py from the models of the messages; `make page-types` makes it anew.\n"
    spaces = [_namespace(name, *models) for name, models in _CHANNELS.items()]
    return "\n".join([head, *spaces])


def _namespace(name: str, from_page: Any, to_page: Any) -> str:  # noqa: ANN401 - types
    declared: dict[str, str] = {}
    # What a page sends may leave out what has a default; what it is sent has all fields.
    for side, model, mode in (("FromPage", from_page, "validation"), ("ToPage", to_page, "serialization")):
        if model is not None:
            schema = TypeAdapter(model).json_schema(mode=mode, ref_template="{model}")  # type: ignore[arg-type]
            is_whole = mode == "serialization"
            declared |= {key: _type(value, is_whole) for key, value in schema.pop("$defs", {}).items()}
            declared[side] = _type(schema, is_whole)
    types = "".join(f"  type {key} = {text};\n" for key, text in declared.items())
    return f"export namespace {name} {{\n{types}}}\n"


def _type(schema: dict[str, Any], is_whole: bool) -> str:  # noqa: PLR0911
    """A JSON schema in TypeScript, each kind has its return; `is_whole`: fields with a default are there."""
    if "$ref" in schema:
        return str(schema["$ref"])
    if "const" in schema:
        return json.dumps(schema["const"])
    if "enum" in schema:
        return " | ".join(json.dumps(each) for each in schema["enum"])
    parts = schema.get("anyOf") or schema.get("oneOf")
    if parts:
        return " | ".join(dict.fromkeys(_type(part, is_whole) for part in parts))
    match schema.get("type"):
        case "array" if "prefixItems" in schema:
            return f"[{', '.join(_type(part, is_whole) for part in schema['prefixItems'])}]"
        case "array":
            return f"({_type(schema['items'], is_whole)})[]"
        case "object" if "properties" in schema:
            required = schema.get("required", [])
            fields = (
                f"{name}{'' if name in required or (is_whole and 'default' in field) else '?'}: "
                f"{_type(field, is_whole)}"
                for name, field in schema["properties"].items()
            )
            return f"{{ {'; '.join(fields)} }}"
        case "object":
            values = schema.get("additionalProperties", True)
            return f"Record<string, {'any' if values is True else _type(values, is_whole)}>"
        case plain:
            return _PLAIN.get(str(plain), "any")


if __name__ == "__main__":
    Path(sys.argv[1] if len(sys.argv) > 1 else _OUTPUT).write_text(page_types(), encoding="utf-8")
