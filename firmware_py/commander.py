"""The commander: keeps the state of the vehicle and lets the table decide what becomes of it."""

from __future__ import annotations

from firmware_py import commander_guards
from firmware_py.commander_guards import Situation, Timeouts
from firmware_py.commander_table import FAILSAFE_STATES, FLOWN_MODE, RULES, Event, Row, State, first_match
from firmware_py.parameters import Parameters
from firmware_py.status import FlightMode


class Commander:
    """Arming, modes and failsafes.

    Attributes:
        state: the present state of the table.
        situation: what the guards look at.
    """

    __slots__ = ("_started", "_tick_rows", "situation", "state")

    def __init__(self) -> None:
        self.situation = Situation()
        self.state = State.DISARMED
        self._tick_rows = RULES[State.DISARMED, Event.TICK]
        self._started = False

    @property
    def armed(self) -> bool:
        """Whether motors may turn."""
        return self.state is not State.DISARMED

    @property
    def mode(self) -> FlightMode:
        """The mode flown; while disarmed, the one it would be armed in."""
        return FLOWN_MODE.get(self.state, self.situation.intended)

    @property
    def failsafe(self) -> bool:
        """Whether a failsafe chose the mode."""
        return self.state in FAILSAFE_STATES

    @property
    def ready(self) -> bool:
        """Whether arming would be accepted; once armed, whether it would be again."""
        now = self.situation
        return not (
            commander_guards.unhealthy(now)
            or commander_guards.intends_land(now)
            or commander_guards.intends_offboard_unfed(now)
        )

    def tick(
        self, now_us: int, *, sound: bool, upright: bool, landed: bool, target_reached: bool
    ) -> Row | None:
        """Take one control tick.

        Args:
            now_us: vehicle time, microseconds.
            sound: whether this tick's sensor sample was usable.
            upright: whether the attitude is one to fly in.
            landed: whether it stands on something.
            target_reached: whether a take-off is at its height.

        Returns:
            The rule that fired, if one did.
        """
        now = self.situation
        if not self._started:
            self._started = True
            now.unsound_us = now.sound_us = now.upright_us = now_us
        now.now_us = now_us
        if sound:
            now.sound_us = now_us
        else:
            now.unsound_us = now_us
        if upright:
            now.upright_us = now_us
        now.landed = landed
        if not landed:
            now.airborne_us = now_us
            now.flown = self.state is not State.DISARMED
        now.target_reached = target_reached
        row = first_match(self._tick_rows, now)
        if row is not None:
            self._follow(row)
        return row

    def handle(self, event: Event) -> Row:
        """Take a command, between ticks; the rule that fired holds the answer."""
        row = first_match(RULES[self.state, event], self.situation)
        if row is None:  # the table has an answer to every command; a test sweeps it
            raise LookupError(f"commander: no rule for {event.value} in {self.state.value}")
        self._follow(row)
        return row

    def setpoint_came(self, time_us: int) -> None:
        """Note a usable offboard setpoint; a time ahead of the vehicle's counts as now."""
        self.situation.setpoint_us = min(time_us, self.situation.now_us)

    def configure(self, parameters: Parameters) -> None:
        """Take over times and choices from the parameters."""
        self.situation.timeouts = Timeouts(
            setpoint_loss_us=_microseconds(parameters.value("COM_OF_LOSS_T")),
            failsafe_hold_us=_microseconds(parameters.value("COM_FAIL_ACT_T")),
            disarm_landed_us=_wait(parameters.value("COM_DISARM_LAND")),
            disarm_preflight_us=_wait(parameters.value("COM_DISARM_PRFLT")),
            land_at_loss=parameters.integer("COM_OBL_RC_ACT") == 4,
        )

    def _follow(self, row: Row) -> None:
        now = self.situation
        if row.intends is not None:
            now.intended = row.intends
        if row.target is None:
            return
        if self.state is State.DISARMED:
            now.armed_us = now.now_us
            now.flown = not now.landed
        self.state = row.target
        self._tick_rows = RULES[self.state, Event.TICK]
        now.entered_us = now.now_us


def _microseconds(seconds: float) -> int:
    return round(seconds * 1e6)


def _wait(seconds: float) -> int | None:
    return _microseconds(seconds) if seconds > 0 else None
