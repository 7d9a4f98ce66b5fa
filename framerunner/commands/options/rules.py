"""Which options go together: rules in tables, for the command line and settings files alike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any

from framerunner.errors import SettingError

Given = Mapping[str, object]
"""The options that differ from their defaults, by name without dashes in front, with their values.

Of an option with a text there is a second name, with the text: "on-abort hold" beside "on-abort".
"""


@dataclass(frozen=True, slots=True)
class OptionRule:
    """What an option excludes, and what it needs; names as in `Given`.

    Attributes:
        option: to which the rule applies, if it is given.
        words: why, and what to do; `{found}` stands for the options that are excluded and given,
            `{given[NAME]}` for the value of one.
        excludes: none of these may be given.
        needs: one of these must be given; empty: none.
        shows_value: the message begins with the option's value, too.
    """

    option: str
    words: str
    excludes: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    shows_value: bool = True

    def check(self, given: Given) -> None:
        """Raise `SettingError` with one line if the rule is broken."""
        if self.option not in given:
            return
        found = [f"--{name}" for name in self.excludes if name in given]
        if found or (self.needs and not any(name in given for name in self.needs)):
            value = given[self.option]
            shown = f" {_text(value)}" if self.shows_value and value is not True else ""
            words = self.words.format(found=" and ".join(found), given=given)
            raise SettingError(f"--{self.option}{shown}: {words}")


def for_each(options: Iterable[str], words: str, **how: Any) -> tuple[OptionRule, ...]:  # noqa: ANN401 - those of `OptionRule`
    """The same rule for several options."""
    return tuple(OptionRule(option, words, **how) for option in options)


def names_of(group: type) -> tuple[str, ...]:
    """The names of a group's options."""
    return tuple(field.name.replace("_", "-") for field in fields(group))


def given_in(*groups: Any) -> dict[str, object]:  # noqa: ANN401 - data classes of options
    """The options of some groups that were given, see `Given`; of defaults that are none, all are."""
    given: dict[str, object] = {}
    for group in groups:
        for field in fields(group):
            value, name = getattr(group, field.name), field.name.replace("_", "-")
            if field.default is MISSING or value != field.default:
                given[name] = value
                if isinstance(value, str):
                    given[f"{name} {value}"] = value
    return given


def check_rules(rules: Iterable[OptionRule], given: Given) -> None:
    """Raise `SettingError` with one line for the first rule that is broken."""
    for rule in rules:
        rule.check(given)


def words_of(given: Given) -> list[str]:
    """The options as words of a command."""
    words: list[str] = []
    for name, value in given.items():
        if " " not in name:
            for one in value if isinstance(value, tuple) else (value,):
                words += [f"--{name}"] if one is True else [f"--{name}", str(one)]
    return words


def _text(value: object) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
