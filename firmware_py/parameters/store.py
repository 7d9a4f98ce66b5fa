"""The values of all parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from struct import pack
from zlib import crc32

from firmware_py.parameters.declarations import DECLARATIONS, Parameter, ParameterError


class Parameters:
    """The present values, in the declarations' order (by name, as PX4 lists them).

    Attributes:
        declarations: with this vehicle's defaults; the position is the MAVLink index.
        version: counts changes, so that a reader can detect them cheaply.
    """

    def __init__(
        self,
        values: Mapping[str, float] | None = None,
        declarations: tuple[Parameter, ...] = DECLARATIONS,
        *,
        defaults: Mapping[str, float] | None = None,
    ) -> None:
        """Start from the defaults.

        Args:
            values: those that differ from the defaults.
            declarations: sorted by name.
            defaults: this vehicle's own defaults where they differ from the declared ones. They do not count
                as changes, and only they can set a constant (SYS_AUTOSTART of an airframe).

        Raises:
            ParameterError: an unknown name or an invalid value.
        """
        self._index = {declared.name: place for place, declared in enumerate(declarations)}
        own = list(declarations)
        for name, default in (defaults or {}).items():
            place = self._place(name)
            own[place] = own[place].with_default(default)
        self.declarations = tuple(own)
        self.version = 0
        self._values = {declared.name: declared.checked(declared.default) for declared in own}
        self._listeners: list[Callable[[str, float], None]] = []
        self._save_listeners: list[Callable[[], None]] = []
        for name, value in (values or {}).items():
            self.set(name, value)

    def value(self, name: str) -> float:
        """The value of a declared parameter; one dictionary look-up, quick enough for every tick."""
        return self._values[name]

    def integer(self, name: str) -> int:
        """The value of a declared `int32`."""
        return int(self._values[name])

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __len__(self) -> int:
        return len(self.declarations)

    def index(self, name: str) -> int:
        """MAVLink index of a declared parameter."""
        return self._index[name]

    def declaration(self, name: str) -> Parameter:
        """The declaration of that name.

        Raises:
            ParameterError: there is none.
        """
        return self.declarations[self._place(name)]

    def changed(self) -> dict[str, float]:
        """The values that differ from this vehicle's defaults, by name, in order."""
        return {
            declared.name: self._values[declared.name]
            for declared in self.declarations
            if not declared.same(self._values[declared.name], declared.default)
        }

    def set(self, name: str, value: float) -> None:
        """Change a value.

        Raises:
            ParameterError: unknown, not finite, not whole or out of range; nothing is changed.
        """
        declared = self.declaration(name)
        kept = declared.checked(value)
        if declared.same(kept, self._values[name]):
            return
        if declared.same(kept, declared.default):
            kept = declared.checked(declared.default)  # as it was declared, with all its digits
        self._values[name] = kept
        self.version += 1
        for listener in self._listeners:
            listener(name, kept)

    def reset(self) -> None:
        """Set every parameter to its default; listeners are called for each change."""
        for name in self.changed():
            self.set(name, self.declaration(name).default)

    def on_change(self, listener: Callable[[str, float], None]) -> None:
        """Have a function called with name and new value after each change."""
        self._listeners.append(listener)

    def on_save(self, listener: Callable[[], None]) -> None:
        """Have a function called by `save`, which stores the values in a file."""
        self._save_listeners.append(listener)

    def save(self) -> bool:
        """Store the values now.

        Returns:
            Whether they are stored anywhere.
        """
        for listener in self._save_listeners:
            listener()
        return bool(self._save_listeners)

    def hash(self) -> int:
        """PX4's `_HASH_CHECK`: CRC-32 (start 0, not inverted) over each name and its four bytes, in order."""
        crc = 0xFFFFFFFF
        for declared in self.declarations:
            value = self._values[declared.name]
            four = pack("<i", int(value)) if declared.kind == "int32" else pack("<f", value)
            crc = crc32(declared.name.encode() + four, crc)
        return crc ^ 0xFFFFFFFF

    def _place(self, name: str) -> int:
        place = self._index.get(name)
        if place is None:
            raise ParameterError(f"{name}: there is no such parameter")
        return place
