"""Makes a vehicle go where its velocity commands lead, whatever its own velocity control lets slip.

A mission flies by velocities: 0.3 m/s for four seconds are 1.2 m through a frame, and none are a stand. The
simulated drone of this project does just that. An ordinary one lags by a second, stays behind against drag,
and drifts in height while it is told to stand, as PX4 does under velocity setpoints. So here the commands
are summed up to the place where they lead, and what the vehicle is off it, by more than a short lag explains,
is added to them. That begins once the vehicle has been off by so much that it cannot be one that obeys: until
then, and for one that obeys for ever, commands are sent to the last bit as the mission wants them.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, hypot, pi, remainder, sin

from offboard.drone import DroneState, VelocityCommand

LAG_S = 0.3  # of a vehicle that needs no help
MEMORY_S = 0.5  # a lag is made up for about so long after the command has changed
DEAD_BAND_M = 0.04
DEAD_BAND_RAD = 0.05
FORGET_S = 1.0  # what is off beside the way is given up so quickly: the mission sees it, and steers anew
HELP_FROM_M = (
    0.14  # off by more in a stand, it needs help for the rest of the flight; the simulated one: 0.04
)
HELP_FROM_S = 0.11  # so much more for each metre a second of late; the simulated one: 0.15 m off at 1 m/s
HELP_FROM_RAD = 0.2  # likewise for its heading; the simulated one: 0.1
LEASH_M = 0.5  # how far the place may be from the vehicle
LEASH_RAD = 0.5
STAND_M_S = 0.05  # a slower command is a stand, which has no sides
PULL_PER_S = 1.2
TURN_PER_S = 1.5
MOST_M_S = 0.5
MOST_RAD_S = 0.5
_LONGEST_STEP_S = 0.2  # after a longer gap the vehicle is taken from where it is


@dataclass(slots=True)
class _Reference:
    """Where the commands lead.

    Attributes:
        time_us: vehicle time.
        off_m: from the vehicle to the place, arena axes.
        at_m: the vehicle's own place when that was so.
        yaw_rad: heading, not wrapped to the vehicle's.
        speed_m_s: of late, at most.
        turn_rad_s: of late, at most.
    """

    time_us: int
    off_m: tuple[float, float, float]
    at_m: tuple[float, float, float]
    yaw_rad: float
    speed_m_s: float = 0.0
    turn_rad_s: float = 0.0


class CommandTracker:
    """Adds to velocity commands what brings the vehicle to where they lead.

    Attributes:
        helps: the vehicle has shown that it needs it.
    """

    def __init__(self) -> None:
        self.helps = False
        self._reference: _Reference | None = None
        self._flown = VelocityCommand()

    def reset(self) -> None:
        """Begin anew at the next state, with a vehicle that obeys."""
        self._reference = None
        self.helps = False

    def correct(self, command: VelocityCommand, state: DroneState) -> VelocityCommand:
        """The command to send.

        Args:
            command: as the mission wants it from now on.
            state: of the vehicle now; once a tick.
        """
        reference, flown = self._reference, self._flown
        self._flown = command
        step_s = 0.0 if reference is None else (state.time_us - reference.time_us) * 1e-6
        if reference is None or not 0.0 <= step_s <= _LONGEST_STEP_S:
            here = (state.x, state.y, state.z)
            self._reference = _Reference(state.time_us, (0.0, 0.0, 0.0), here, state.yaw)
            return command
        _advance(reference, flown, state, step_s)
        off_m, off_rad = _unexplained(reference, state)
        if off_m > HELP_FROM_M + HELP_FROM_S * reference.speed_m_s or off_rad > HELP_FROM_RAD:
            self.helps = True
        return _pulled(command, reference, state) if self.helps else command


def _advance(reference: _Reference, flown: VelocityCommand, state: DroneState, step_s: float) -> None:
    """Go on along the command of the last step, but not farther from the vehicle than the leash."""
    decay = exp(-step_s / MEMORY_S)
    forward, left, up = flown.forward_m_s, flown.left_m_s, flown.up_m_s
    reference.speed_m_s = max(hypot(forward, left, up), decay * reference.speed_m_s)
    reference.turn_rad_s = max(abs(flown.yaw_rate_rad_s), decay * reference.turn_rad_s)
    c, s = cos(state.yaw), sin(state.yaw)
    (off_x, off_y, off_z), (at_x, at_y, at_z) = reference.off_m, reference.at_m
    x = off_x + at_x - state.x + (c * forward - s * left) * step_s
    y = off_y + at_y - state.y + (s * forward + c * left) * step_s
    z = off_z + at_z - state.z + up * step_s
    distance_m = hypot(x, y, z)
    scale = LEASH_M / distance_m if distance_m > LEASH_M else 1.0
    x, y = _forget_beside((scale * x, scale * y), (forward, left), state.yaw, exp(-step_s / FORGET_S))
    reference.off_m, reference.at_m = (x, y, scale * z), (state.x, state.y, state.z)
    off_rad = remainder(reference.yaw_rad + flown.yaw_rate_rad_s * step_s - state.yaw, 2 * pi)
    reference.yaw_rad = state.yaw + max(-LEASH_RAD, min(LEASH_RAD, off_rad))
    reference.time_us = state.time_us


def _forget_beside(
    off_m: tuple[float, float], flown_m_s: tuple[float, float], yaw_rad: float, kept: float
) -> tuple[float, float]:
    """Keep all of what is off along the command and a share of what is off beside it; all in a stand.

    A mission that steers by sight has seen where it is and aims from there. A vehicle pushed back to the
    old way meanwhile would come past its aim on the other side.
    """
    speed_m_s = hypot(*flown_m_s)
    if speed_m_s < STAND_M_S:
        return off_m
    c, s = cos(yaw_rad), sin(yaw_rad)
    forward, left = flown_m_s[0] / speed_m_s, flown_m_s[1] / speed_m_s
    along_x, along_y = c * forward - s * left, s * forward + c * left
    along_m = off_m[0] * along_x + off_m[1] * along_y
    return (
        along_m * along_x + kept * (off_m[0] - along_m * along_x),
        along_m * along_y + kept * (off_m[1] - along_m * along_y),
    )


def _unexplained(reference: _Reference, state: DroneState) -> tuple[float, float]:
    """How far it is off, metres and radians, by more than a lag of LAG_S."""
    off_rad = abs(reference.yaw_rad - state.yaw)
    return hypot(*reference.off_m) - LAG_S * reference.speed_m_s, off_rad - LAG_S * reference.turn_rad_s


def _pulled(command: VelocityCommand, reference: _Reference, state: DroneState) -> VelocityCommand:
    x, y, z = reference.off_m
    distance_m = hypot(x, y, z)
    off_m, turned_rad = _unexplained(reference, state)
    beyond_m, beyond_rad = off_m - DEAD_BAND_M, turned_rad - DEAD_BAND_RAD
    pull = min(PULL_PER_S * beyond_m, MOST_M_S) / distance_m if beyond_m > 0.0 else 0.0
    off_rad = reference.yaw_rad - state.yaw
    turn = min(TURN_PER_S * beyond_rad, MOST_RAD_S) if beyond_rad > 0.0 else 0.0
    c, s = cos(state.yaw), sin(state.yaw)
    return VelocityCommand(
        command.forward_m_s + pull * (c * x + s * y),
        command.left_m_s + pull * (c * y - s * x),
        command.up_m_s + pull * z,
        command.yaw_rate_rad_s + (turn if off_rad >= 0.0 else -turn),
    )
