"""The reference page, made from the declarations: `python -m firmware_py.parameters.reference`."""

from __future__ import annotations

from firmware_py.parameters.declarations import DECLARATIONS, Parameter

_MAX_CHOICES = 10  # more are shown as a range

_HEAD = """# Parameters

The drone's parameters, under PX4's names, with PX4's units, defaults and meanings (v1.17, as its SITL has
them). `framerunner sim --parameters FILE` keeps changed values in a file that QGroundControl reads and
writes too, also in one that was exported from a real drone: only values that change are replaced. Comments,
parameters that this drone does not have, and lines of other vehicles and components stay as they are, and
are not used; which those are is printed. An instance is vehicle 1 plus its number.

PX4 takes any value of the right type; here a value outside its range is refused with a message, and the old
one is kept. So some ranges are wider than those PX4 advises: small arenas are flown slowly. An airframe may
have other defaults.

This page is made from `firmware_py/parameters/declarations.yaml` by `make parameters`.
"""


def reference_page(declarations: tuple[Parameter, ...] = DECLARATIONS) -> str:
    """The page as Markdown: a table for each group, and one of the constants."""
    groups: dict[str, list[Parameter]] = {}
    for declared in declarations:
        if not declared.constant:
            groups.setdefault(declared.group, []).append(declared)
    parts = [_HEAD]
    for group in sorted(groups):
        parts.append(f"\n## {group}\n\n| name | what | default | range |\n|---|---|---|---|\n")
        parts += [_row(declared) for declared in groups[group]]
    parts.append("\n## Constants\n\nGround stations request these; they cannot be changed.\n")
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
        words.append("Used from the next start on.")
    return " ".join(word for word in words if word)


def _range(declared: Parameter) -> str:
    if 0 < len(declared.choices) <= _MAX_CHOICES:
        return "<br>".join(f"{value} {text}" for value, text in sorted(declared.choices.items()))
    if declared.bits:
        return "sum of<br>" + "<br>".join(
            f"{1 << place} {text}" for place, text in sorted(declared.bits.items())
        )
    return f"{declared.minimum:.9g} to {declared.maximum:.9g}"


if __name__ == "__main__":
    print(reference_page(), end="")
