from firmware_py.ground_contact import LandDetector
from firmware_py.types import VehicleState

HOVER = 0.07
TICK_US = 4000


class Bench:
    """Feeds a detector ticks of constant conditions."""

    def __init__(self):
        self.detector = LandDetector(HOVER)
        self.state = VehicleState()

    def run(
        self, seconds, *, down_m_s=0.0, east_m_s=0.0, armed=True, lifting=False, command=0.0, throttle=HOVER
    ):
        """Returns the seconds until `landed` changed, or None."""
        before = self.detector.landed
        for tick in range(round(seconds * 1e6 / TICK_US)):
            north, east, down = self.state.position_ned_m
            self.state.time_us += TICK_US
            self.state.position_ned_m = (north, east, down + down_m_s * TICK_US / 1e6)
            self.state.velocity_ned_m_s = (0.0, east_m_s, down_m_s)
            landed = self.detector.update(
                self.state, armed=armed, lifting=lifting, command_down_m_s=command, throttle=throttle
            )
            if landed != before:
                return (tick + 1) * TICK_US / 1e6
        return None

    def take_off(self):
        assert self.run(1.0, down_m_s=-0.5, lifting=True, command=-0.5) is not None


def test_it_boots_on_the_ground_and_stays_there():
    assert Bench().run(5.0, armed=False) is None


def test_lift_off_is_detected_at_once_by_its_speed():
    assert Bench().run(1.0, down_m_s=-0.2, lifting=True, command=-0.25) == 0.004


def test_a_slow_lift_off_is_detected_by_its_height():
    bench = Bench()
    bench.run(0.1)
    seconds = bench.run(2.0, down_m_s=-0.06, lifting=True, command=-0.06)
    assert seconds is not None
    assert 0.4 < seconds < 0.6


def test_a_commanded_climb_without_motion_is_not_flight():
    assert Bench().run(3.0, lifting=True, command=-0.25) is None


def test_a_short_impact_is_not_flight_but_a_fall_is():
    bench = Bench()
    assert bench.run(0.05, down_m_s=1.0) is None
    bench.run(0.1)
    assert bench.run(1.0, down_m_s=2.0, armed=False) is not None


def test_a_commanded_descent_without_motion_at_low_thrust_is_ground():
    bench = Bench()
    bench.take_off()
    seconds = bench.run(2.0, command=0.5, throttle=0.4 * HOVER)
    assert seconds is not None
    assert 0.29 < seconds < 0.35


def test_hovering_is_flight():
    bench = Bench()
    bench.take_off()
    assert bench.run(5.0) is None


def test_a_slow_descent_is_flight():
    bench = Bench()
    bench.take_off()
    assert bench.run(5.0, down_m_s=0.1, command=0.1, throttle=0.99 * HOVER) is None


def test_a_fast_descent_with_low_thrust_is_flight():
    bench = Bench()
    bench.take_off()
    assert bench.run(5.0, down_m_s=0.25, command=0.25, throttle=0.5 * HOVER) is None


def test_carried_by_its_own_thrust_is_flight():
    bench = Bench()
    bench.take_off()
    assert bench.run(2.0, command=0.5, throttle=0.95 * HOVER) is None


def test_sliding_is_not_standing():
    bench = Bench()
    bench.take_off()
    assert bench.run(2.0, east_m_s=0.5, command=0.5, throttle=0.4 * HOVER) is None


def test_with_motors_off_a_fall_is_flight_until_it_ends():
    bench = Bench()
    bench.take_off()
    assert bench.run(1.0, down_m_s=3.0, armed=False) is None
    assert not bench.detector.landed
    assert bench.run(1.0, armed=False) is not None
    assert bench.detector.landed
