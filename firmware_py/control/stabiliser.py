"""The stabiliser: follows any command, from a velocity down to motor outputs, on any airframe.

`level_law` flies velocities on airframes that tilt little, `vector_law` everything else.
"""

from __future__ import annotations

from math import radians

from firmware_py.commands import ControlCommand, FlightLimits, VelocityFrdCommand
from firmware_py.control.level_law import LevelLaw
from firmware_py.control.mixer import Mixer
from firmware_py.control.vector_law import VectorLaw
from firmware_py.types import MotorOutput, VehicleState
from framerunner.vehicle.airframe import Airframe

_LEVEL_LAW_TILT_RAD = radians(35.0)  # airframes that never tilt farther follow velocities by the level law


class Stabiliser:
    """One airframe's control law; keeps what it has learnt when the kind of command changes.

    Args:
        airframe: what flies; the gains are designed from its numbers.
        period_s: time between calls of `step`.

    Attributes:
        limits: may be set in flight.
    """

    def __init__(self, airframe: Airframe, period_s: float) -> None:
        mixer = Mixer(airframe)
        self.limits = FlightLimits(airframe.limits.tilt_rad)
        self._idle = MotorOutput(mixer.mix(0.0, 0.0, 0.0, 0.0).speeds_rad_s)
        self._vector = VectorLaw(airframe, period_s, self.limits, mixer)
        self._velocity_law: LevelLaw | VectorLaw = self._vector
        if airframe.limits.tilt_rad <= _LEVEL_LAW_TILT_RAD:
            self._velocity_law = LevelLaw(airframe, period_s, self.limits, mixer)
        self._law = self._velocity_law  # in use now

    def reset(self) -> None:
        """Forget all that was learnt: at arming and on the ground."""
        self._velocity_law.reset()
        if self._law is not self._velocity_law:
            self._law.reset()

    def idle(self) -> MotorOutput:
        """Return slowly turning motors, as an armed drone has on the ground."""
        return self._idle

    def step(self, state: VehicleState, command: ControlCommand, *, grounded: bool = False) -> MotorOutput:
        """Return the motor commands for one control period.

        Args:
            state: of the vehicle now.
            command: what to follow.
            grounded: the vehicle still touches the ground; what is learnt in flight is held.
        """
        if type(command) is VelocityFrdCommand:
            if self._law is not self._velocity_law:
                self._change(self._velocity_law, state)
            return self._velocity_law.step(state, command, grounded)
        if self._law is not self._vector:
            self._change(self._vector, state)
        return self._vector.step(state, command, grounded)

    def _change(self, law: LevelLaw | VectorLaw, state: VehicleState) -> None:
        self._law.leave(state)
        law.enter(state)
        self._law = law
