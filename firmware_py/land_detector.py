"""Decides whether the vehicle stands on something.

Without a range finder the ground shows itself by what the vehicle does not do: told to descend, with
little thrust, it stays where it is. The same signs as PX4's multicopter land detector, with shorter
times because the vehicle is light and its state clean.
"""

from __future__ import annotations

from math import hypot, inf, radians

from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState

_FALL_US = 100_000  # unasked motion longer than this is not standing
_MOVING_M_S = 0.3  # while it stands
_DESCENT_COMMAND_M_S = 0.05
_DESCENT_SHARE = 0.3  # less than this share of the commanded descent is "not descending"
_LOW_THRUST_SHARE = 0.9  # of hover; slow descent in the air needs nearly all of it
_LIFTED_SPEED_M_S = 0.1
_LIFTED_HEIGHT_M = 0.03


class LandDetector:
    """Follows the vehicle from ground to air and back.

    Attributes:
        landed: whether it stands on something.
        trigger_us: the signs of ground must hold this long (LNDMC_TRIG_TIME).
        vertical_m_s: standing means less (LNDMC_Z_VEL_MAX).
        level_m_s: standing means less (LNDMC_XY_VEL_MAX).
        turning_rad_s: of roll and pitch; standing means less (LNDMC_ROT_MAX).
    """

    __slots__ = (
        "_hover_throttle",
        "_last_still_us",
        "_last_unlike_us",
        "_stand_down_m",
        "landed",
        "level_m_s",
        "trigger_us",
        "turning_rad_s",
        "vertical_m_s",
    )

    def __init__(self, hover_throttle: float) -> None:
        """Start on the ground.

        Args:
            hover_throttle: mean squared share of rotor speed that carries the weight, 0..1.
        """
        self.landed = True
        self.trigger_us = 300_000
        self.vertical_m_s = self.level_m_s = _MOVING_M_S
        self.turning_rad_s = inf
        self._hover_throttle = hover_throttle
        self._stand_down_m = 0.0
        self._last_still_us = 0
        self._last_unlike_us = 0

    def configure(self, parameters: Parameters) -> None:
        """Take over changed parameters."""
        value = parameters.value
        self.trigger_us = round(value("LNDMC_TRIG_TIME") * 1e6)
        self.vertical_m_s = value("LNDMC_Z_VEL_MAX")
        self.level_m_s = value("LNDMC_XY_VEL_MAX")
        self.turning_rad_s = radians(value("LNDMC_ROT_MAX"))

    def update(
        self, state: VehicleState, *, armed: bool, lifting: bool, command_down_m_s: float, throttle: float
    ) -> bool:
        """Take one tick.

        Args:
            state: the vehicle now.
            armed: motors may turn.
            lifting: the motors work to leave the ground.
            command_down_m_s: vertical speed now asked of the stabiliser, positive down.
            throttle: mean squared share of rotor speed, 0..1.

        Returns:
            Whether the vehicle stands on something.
        """
        if self.landed:
            self._watch_for_air(state, lifting)
        else:
            self._watch_for_ground(state, armed, command_down_m_s, throttle)
        return self.landed

    def _watch_for_air(self, state: VehicleState, lifting: bool) -> None:
        down_m = state.position_ned_m[2]
        climb_m_s = -state.velocity_ned_m_s[2]
        if not lifting:
            self._stand_down_m = down_m
            if abs(climb_m_s) < _MOVING_M_S:
                self._last_still_us = state.time_us
            left = state.time_us - self._last_still_us > _FALL_US
        else:
            self._last_still_us = state.time_us
            left = climb_m_s > _LIFTED_SPEED_M_S or self._stand_down_m - down_m > _LIFTED_HEIGHT_M
        if left:
            self.landed = False
            self._last_unlike_us = state.time_us

    def _watch_for_ground(
        self, state: VehicleState, armed: bool, command_down_m_s: float, throttle: float
    ) -> None:
        if armed and command_down_m_s <= _DESCENT_COMMAND_M_S:
            self._last_unlike_us = state.time_us
            return
        north_m_s, east_m_s, down_m_s = state.velocity_ned_m_s
        roll_rad_s, pitch_rad_s, _ = state.angular_rate_frd_rad_s
        like_ground = (
            abs(down_m_s) < self.vertical_m_s
            and hypot(north_m_s, east_m_s) < self.level_m_s
            and hypot(roll_rad_s, pitch_rad_s) < self.turning_rad_s
            and (
                not armed
                or (
                    down_m_s < _DESCENT_SHARE * command_down_m_s
                    and throttle < _LOW_THRUST_SHARE * self._hover_throttle
                )
            )
        )
        if not like_ground:
            self._last_unlike_us = state.time_us
        elif state.time_us - self._last_unlike_us > self.trigger_us:
            self.landed = True
            self._stand_down_m = state.position_ned_m[2]
            self._last_still_us = state.time_us
