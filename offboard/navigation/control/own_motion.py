"""The simulated drone's own motion in plan, ahead of telemetry: by its tilt and by what else pushes it."""

from __future__ import annotations

from offboard.drone import DroneState
from offboard.navigation.control.loop_inverse import acceleration_in_plan

Plan = tuple[float, float]
"""Along the arena's x and y."""

DISTURBANCE_S = 1.0  # in which a disturbance is learnt
_LONGEST_S = 0.15  # between two velocities that are compared


class OwnMotion:
    """Call `update` once a tick.

    Attributes:
        acceleration_m_s2: by tilt, drag and the disturbance.
        disturbance_m_s2: what telemetry's velocities show of it beside tilt and drag, such as wind.
    """

    def __init__(self) -> None:
        self.acceleration_m_s2: Plan = (0.0, 0.0)
        self.disturbance_m_s2: Plan = (0.0, 0.0)
        self._velocity_m_s: Plan = (0.0, 0.0)
        self._measured_s: float | None = None
        self._age_s = 0.0

    def update(self, state: DroneState, up_m_s2: float) -> None:
        """Take in a state; upwards the drone accelerates as given."""
        by_tilt, velocity = acceleration_in_plan(state, up_m_s2), state.velocity_arena_m_s[:2]
        measured_s, last_s = state.time_us * 1e-6 - state.position_age_s, self._measured_s
        if last_s is not None and 0.0 < (step_s := measured_s - last_s) < _LONGEST_S and not state.landed:
            share = step_s / DISTURBANCE_S
            x, y = (
                was + share * ((v - before) / step_s - by - was)
                for was, v, before, by in zip(
                    self.disturbance_m_s2, velocity, self._velocity_m_s, by_tilt, strict=True
                )
            )
            self.disturbance_m_s2 = (x, y)
        self._velocity_m_s, self._measured_s, self._age_s = velocity, measured_s, state.position_age_s
        self.acceleration_m_s2 = (
            by_tilt[0] + self.disturbance_m_s2[0],
            by_tilt[1] + self.disturbance_m_s2[1],
        )

    def velocity_in(self, time_s: float) -> Plan:
        """The velocity a while after the last state."""
        ahead_s = self._age_s + time_s
        (vx, vy), (ax, ay) = self._velocity_m_s, self.acceleration_m_s2
        return vx + ahead_s * ax, vy + ahead_s * ay
