"""Local axes laid into the arena: by the referee, by the start, by the app."""

from math import cos, pi, sin

import pytest

from monitor.vehicle.placement import Placement, Source
from wire.dialect import mavlink
from wire.vehicle_telemetry import PositionReport, VehicleTelemetry


def standing(x, y, z, yaw_ned_rad):
    telemetry = VehicleTelemetry()
    half = yaw_ned_rad / 2
    telemetry.take(mavlink.MAVLink_attitude_quaternion_message(0, cos(half), 0, 0, sin(half), 0, 0, 0), 0.0)
    telemetry.take(mavlink.MAVLink_local_position_ned_message(0, x, y, z, 0, 0, 0), 0.0)
    return telemetry


def test_the_start_gives_turn_and_shift():
    placement = Placement()
    placement.lay_by_start((2.0, -1.0, 0.5, pi / 2), standing(10.0, 20.0, -3.0, 0.3))
    assert placement.alignment.position((10.0, 20.0, -3.0)) == pytest.approx((2.0, -1.0, 0.5))
    ahead = (10.0 + cos(0.3), 20.0 + sin(0.3), -3.0)  # a metre ahead is a metre along y
    assert placement.alignment.position(ahead) == pytest.approx((2.0, 0.0, 0.5))
    assert placement.alignment.vector((cos(0.3), sin(0.3), -1.0)) == pytest.approx((0.0, 1.0, 1.0))
    w, x, y, z = placement.alignment.attitude((cos(0.15), 0.0, 0.0, sin(0.15)))
    assert (x, y) == (0.0, 0.0)
    assert (w, z) == pytest.approx((cos(pi / 4), sin(pi / 4)))


def test_the_frame_of_a_referee_counts_before_all():
    placement = Placement()
    placement.lay_by_frame((1.0, 2.0, 3.0), pi / 2)
    assert placement.alignment.position((1.0, 0.0, 0.0)) == pytest.approx((1.0, 3.0, 3.0))
    placement.lay_by_start((9.0, 9.0, 9.0, 0.0), standing(0.0, 0.0, 0.0, 0.0))
    placement.lay_by_app((9.0, 9.0, 9.0, 0.0), PositionReport(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0))
    assert placement.source is Source.REFEREE
    assert placement.alignment.position((0.0, 0.0, 0.0)) == pytest.approx((1.0, 2.0, 3.0))


def test_of_the_apps_pairs_the_stillest_counts():
    placement = Placement()
    placement.lay_by_app((1.0, 0.0, 0.0, 0.0), PositionReport(0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0))
    assert placement.alignment.position((0.0, 0.0, 0.0)) == pytest.approx((1.0, 0.0, 0.0))
    placement.lay_by_app((2.0, 0.0, 0.0, 0.0), PositionReport(0, (0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.0))
    placement.lay_by_app((3.0, 0.0, 0.0, 0.0), PositionReport(0, (0.0, 0.0, 0.0), (2.0, 0.0, 0.0), 0.0))
    assert placement.alignment.position((0.0, 0.0, 0.0)) == pytest.approx((2.0, 0.0, 0.0))


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_what_is_no_number_is_not_believed(bad):
    placement = Placement()
    placement.lay_by_frame((bad, 0.0, 0.0), 0.0)
    placement.lay_by_app((0.0, 0.0, 0.0, bad), PositionReport(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0))
    assert placement.source is Source.GUESS


def test_one_that_is_carried_lays_nothing():
    telemetry = standing(0.0, 0.0, 0.0, 0.0)
    telemetry.take(mavlink.MAVLink_local_position_ned_message(20, 0, 0, 0, 0.5, 0, 0), 0.0)
    placement = Placement()
    placement.lay_by_start((1.0, 1.0, 1.0, 0.0), telemetry)
    assert placement.source is Source.GUESS
