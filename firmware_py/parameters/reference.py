"""The reference page, made from the declarations: `python -m firmware_py.parameters.reference`."""

from __future__ import annotations

from firmware_py.parameters.declarations import DECLARATIONS
from firmware_py.parameters.model import Parameter

_MOST_CHOICES = 10  # more of them are a range

_HEAD = """# Parameters

The drone's parameters, under PX4's names, with PX4's units, defaults and meanings (v1.17, as its SITL has
them). `framerunner sim --parameters FILE` keeps what is changed in a file that QGroundControl reads and
writes too.

PX4 takes any value of the right type; here a value outside its range is refused in words, and the old one
stays. So some ranges are wider than those PX4 advises: small arenas are flown slowly. Airframes may have
defaults of their own.

This page is made from the declarations in `firmware_py/parameters` by `make parameters`.
"""


def reference_page(declarations: tuple[Parameter, ...] = DECLARATIONS) -> str:
    """The page as Markdown: a table for each group, and one of the facts that cannot be changed."""
    groups: dict[str, list[Parameter]] = {}
    for declared in declarations:
        if not declared.constant:
            groups.setdefault(declared.group, []).append(declared)
    parts = [_HEAD]
    for group in sorted(groups):
        parts.append(f"\n## {group}\n\n| name | what | default | range |\n|---|---|---|---|\n")
        parts += [_row(declared) for declared in groups[group]]
    parts.append("\n## Facts\n\nGround stations ask for these; they cannot be changed.\n")
    parts.append("\n| name | what | value |\n|---|---|---|\n")
    parts += [
        f"| `{declared.name}` | {_words(declared)} | {declared.default:.9g} |\n"
        for declared in declarations
        if declared.constant
    ]
    return "".join(parts)


def _row(declared: Parameter) -> str:
    unit = f" {declared.unit}" if declared.unit not in ("", "norm") else ""
    default = f"{declared.default:.9g}{unit}"
    return f"| `{declared.name}` | {_words(declared)} | {default} | {_range(declared)} |\n"


def _words(declared: Parameter) -> str:
    words = [f"{declared.description}.", declared.details]
    if declared.reboot_required:
        words.append("Taken at the next start.")
    return " ".join(word for word in words if word)


def _range(declared: Parameter) -> str:
    if 0 < len(declared.choices) <= _MOST_CHOICES:
        return "<br>".join(f"{value} {text}" for value, text in sorted(declared.choices.items()))
    if declared.bits:
        return "sum of<br>" + "<br>".join(
            f"{1 << place} {text}" for place, text in sorted(declared.bits.items())
        )
    return f"{declared.minimum:.9g} to {declared.maximum:.9g}"


if __name__ == "__main__":
    print(reference_page(), end="")
