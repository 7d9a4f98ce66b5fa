"""Which of the vehicle's links a packet goes on to: PX4's forwarding, as its SITL has it on both links.

A packet for everybody goes to every other link where anybody was heard, one for a system or component to the
links where that was heard. What is for this vehicle alone stays here. Different from PX4: a packet does not
go to a link on which its own sender was heard too, so a router that sits on two links makes no endless
echo, and who has been silent for a minute is forgotten.
"""

from __future__ import annotations

from collections.abc import Callable

from wire.dialect import BROADCAST, Message, mavlink

_FORGOTTEN_US = 60_000_000
_CAPACITY = 64  # components in all; beyond, the one not heard for longest is forgotten
_REFRESH_US = 1_000_000
_NEVER_FORWARDED = (
    mavlink.MAVLINK_MSG_ID_SETUP_SIGNING,  # it carries the key
    mavlink.MAVLINK_MSG_ID_RADIO_STATUS,  # about its own link
)

Component = tuple[int, int]  # system id, component id


class Router:
    """Remembers who was heard where.

    Args:
        is_own: whether a system id and component id are this vehicle's own.
    """

    __slots__ = ("_heard_us", "_is_own")

    def __init__(self, is_own: Callable[[int, int], bool]) -> None:
        self._is_own = is_own
        self._heard_us: dict[tuple[str, Component], int] = {}

    def hear(self, link: str, source: Component, time_us: int) -> None:
        """Note that somebody was heard on a link."""
        key = (link, source)
        heard_us = self._heard_us.get(key)
        if heard_us is not None and time_us - heard_us < _REFRESH_US:
            return
        if heard_us is None:
            self._make_room(time_us)
        self._heard_us[key] = time_us

    def forget_link(self, link: str) -> None:
        """Forget all who were heard on a link that is gone."""
        self._heard_us = {key: heard for key, heard in self._heard_us.items() if key[0] != link}

    def destinations(self, link: str, source: Component, message: Message, time_us: int) -> list[str]:
        """The links a packet goes on to.

        Args:
            link: on which it came.
            source: who sent it.
            message: what it is; of an unknown one no target is known, so it is for everybody.
            time_us: vehicle time.
        """
        if len(self._heard_us) < 2 or message.get_msgId() in _NEVER_FORWARDED:
            return []
        target = (
            getattr(message, "target_system", BROADCAST),
            getattr(message, "target_component", BROADCAST),
        )
        if self._is_own(*target):
            return []
        there: dict[str, None] = {}
        with_sender = {link}
        for (name, component), heard_us in self._heard_us.items():
            if time_us - heard_us > _FORGOTTEN_US:
                continue
            if component == source:
                with_sender.add(name)
            elif _is_meant(component, target):
                there[name] = None
        return [name for name in there if name not in with_sender]

    def _make_room(self, time_us: int) -> None:
        heard = self._heard_us
        if len(heard) < _CAPACITY:
            return
        for key in [key for key, heard_us in heard.items() if time_us - heard_us > _FORGOTTEN_US]:
            del heard[key]
        if len(heard) >= _CAPACITY:
            del heard[min(heard, key=heard.__getitem__)]


def _is_meant(component: Component, target: Component) -> bool:
    system_id, component_id = target
    if system_id == BROADCAST:
        return True
    return component[0] == system_id and component_id in (BROADCAST, component[1])
