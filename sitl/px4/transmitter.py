"""An operator's transmitter, as a receiver delivers it to PX4: pulse widths of channels, 50 a second."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable
from struct import Struct

from framerunner.errors import SettingError

Channels = tuple[int, ...]
"""Pulse widths in microseconds, 1000 to 2000; the first is channel 1."""
Sticks = Callable[[], Channels | None]
"""The channels now; None: the receiver has no signal."""

CENTRED_NAME = "centred"
CHANNELS = 16
LOW_US, CENTRE_US, HIGH_US = 1000, 1500, 2000
CENTRED: Channels = (CENTRE_US,) * 4 + (LOW_US,) * (CHANNELS - 4)
"""Sticks centred, the height's too; switches low."""

_EVENT = Struct("<IhBB")  # struct js_event of linux/joystick.h: time, value, type, number
_BUTTON, _AXIS, _INITIAL = 1, 2, 0x80
_FULL = 32767
_AXES = 8  # a transmitter on USB sends channels 1 to 8 as axes, the others as buttons
_EVENTS_AT_ONCE = 256
_CALLS_TO_RETRY = 50


def centred() -> Channels:
    """A transmitter that nobody touches."""
    return CENTRED


class Joystick:
    """A transmitter on USB, or any joystick of Linux: axis 0 is channel 1, button 0 is channel 9.

    Without the device, as when its cable is pulled, there is no signal; it is opened again when it is back.

    Args:
        path: such as /dev/input/js0.

    Raises:
        SettingError: it cannot be read.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        self._channels = list(CENTRED)
        self._calls = 0
        self._device: int | None = None
        try:
            self._open()
        except OSError as error:
            raise SettingError(
                f"--transmitter {path}: cannot be read ({error.strerror}); give a joystick such as "
                f"/dev/input/js0, or {CENTRED_NAME}"
            ) from None

    def __call__(self) -> Channels | None:
        """The channels now; None while the device is gone."""
        if self._device is None and not self._is_back():
            return None
        assert self._device is not None
        try:
            data = os.read(self._device, _EVENTS_AT_ONCE * _EVENT.size)
        except BlockingIOError:
            return tuple(self._channels)
        except OSError:
            data = b""
        if not data:
            self.close()
            return None
        for _, value, kind, number in _EVENT.iter_unpack(data[: len(data) // _EVENT.size * _EVENT.size]):
            self._take(kind & ~_INITIAL, number, value)
        return tuple(self._channels)

    def close(self) -> None:
        """Close the device."""
        if self._device is not None:
            os.close(self._device)
            self._device = None

    def _open(self) -> None:
        opened = os.open(self._path, os.O_RDONLY | os.O_NONBLOCK)
        kind = os.fstat(opened).st_mode
        if stat.S_ISREG(kind) or stat.S_ISDIR(kind):  # would be a receiver without a signal
            os.close(opened)
            raise OSError(errno.ENODEV, "is no device")
        self._device = opened

    def _is_back(self) -> bool:
        self._calls += 1
        if self._calls % _CALLS_TO_RETRY:
            return False
        try:
            self._open()
        except OSError:
            return False
        return True

    def _take(self, kind: int, number: int, value: int) -> None:
        if kind == _AXIS and number < _AXES:
            self._channels[number] = round(CENTRE_US + (HIGH_US - CENTRE_US) * value / _FULL)
        elif kind == _BUTTON and number < CHANNELS - _AXES:
            self._channels[_AXES + number] = HIGH_US if value else LOW_US


def open_transmitter(name: str) -> Sticks:
    """The transmitter of an option's value: `centred`, or a joystick's device.

    Raises:
        SettingError: it cannot be read.
    """
    return centred if name == CENTRED_NAME else Joystick(name)
