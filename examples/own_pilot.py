"""A pilot of one's own: the mission `explorer` with crossings at two thirds of the speed."""

import framerunner


class CarefulPilot(framerunner.Pilot):
    """Changes a primitive of the mission; new methods and values can be used in a mission of one's own."""

    def cross_frame(self) -> None:
        """Fly through the frame, more slowly."""
        super().cross_frame()
        self.cmd.vel_x *= 2 / 3
        self.cmd.vel_y *= 2 / 3


for pilot in (framerunner.Pilot, CarefulPilot):
    result = framerunner.fly("calm-17", pilot=pilot)
    print(f"{pilot.__name__}: {result.verdict} after {result.try_time_s:.1f} s")
