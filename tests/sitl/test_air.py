"""Moving air: its statistics against the Dryden model, and what it does to a body, against closed forms."""

from math import cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from scipy.signal import welch

from framerunner.vehicle.airframe import AirEffects, load_airframe
from scenarios.air import Wind
from scenarios.models import Base, Scenario, StartPose
from sitl.air.wind import MIN_AIRSPEED_M_S, SimulatedWind
from sitl.dynamics import Dynamics
from sitl.world import World
from tests.flight import ORIGIN

PERIOD_S = 0.004
X500 = load_airframe("x500")
ABEJORRO = load_airframe("abejorro")
WIND = Wind(speed_m_s=4.0, direction_rad=0.6, turbulence_m_s=1.0, length_m=2.0)


def at_rest():
    return (0.0, 0.0, 0.0)


def blown(wind, seconds, seed=1, velocity=at_rest):
    """The air's velocity NED, m/s, shape (ticks, 3)."""
    simulated = SimulatedWind(wind, seed, PERIOD_S)
    return np.array([simulated.step(velocity) for _ in range(round(seconds / PERIOD_S))])


def components(ned, wind):
    """Along the mean wind, right of it and down, without the mean wind."""
    north, east = cos(wind.direction_rad), -sin(wind.direction_rad)
    along = ned[:, 0] * north + ned[:, 1] * east - wind.speed_m_s
    return along, ned[:, 1] * north - ned[:, 0] * east, ned[:, 2]


def dryden(omega, deviation, time_s, *, lateral):
    """One-sided power spectrum per rad/s, MIL-F-8785C, 3.7.1.2; its integral is the deviation squared."""
    x = (omega * time_s) ** 2
    if lateral:
        return deviation**2 * time_s / pi * (1 + 3 * x) / (1 + x) ** 2
    return deviation**2 * 2 * time_s / pi / (1 + x)


def test_deviation_and_spectrum_are_drydens():
    """Over 1600 s; a band of the averaged spectrum is then right within about 5 %."""
    ned = blown(WIND, 1600.0)
    # By the model's ratios at the ground: 0.5 for the deviation, 0.125 for the length.
    expected = ((1.0, 2.0, False), (1.0, 2.0, True), (0.5002, 2.0 * 0.1252, True))
    for series, (deviation, length_m, lateral) in zip(components(ned, WIND), expected, strict=True):
        time_s = length_m / WIND.speed_m_s
        assert np.mean(series) == pytest.approx(0.0, abs=4 * deviation * sqrt(2 * time_s / 1600))
        assert np.std(series) == pytest.approx(deviation, rel=0.05)
        hertz, power = welch(series, fs=1 / PERIOD_S, nperseg=1 << 14)
        model = dryden(2 * pi * hertz, deviation, time_s, lateral=lateral) * 2 * pi
        for low, high in ((0.05, 0.2), (0.2, 0.6), (0.6, 2.0), (2.0, 6.0), (6.0, 20.0)):
            band = (hertz >= low) & (hertz < high)
            assert np.sum(power[band]) == pytest.approx(np.sum(model[band]), rel=0.15)


def test_components_are_independent():
    correlation = np.corrcoef(components(blown(WIND, 400.0), WIND))
    assert np.all(np.abs(correlation - np.eye(3)) < 0.15)


def test_a_drone_in_still_turbulence_feels_the_changes_of_the_least_airspeed():
    calm = WIND.model_copy(update={"speed_m_s": 0.0})
    along = components(blown(calm, 1600.0), calm)[0]
    lag = round(2.0 / MIN_AIRSPEED_M_S / PERIOD_S)  # after L / V an exponential correlation is 1/e
    assert np.mean(along[lag:] * along[:-lag]) / np.var(along) == pytest.approx(np.exp(-1), abs=0.1)


def test_turbulence_changes_faster_for_a_drone_that_flies_fast():
    calm = WIND.model_copy(update={"speed_m_s": 0.0})
    slow, fast = (components(blown(calm, 400.0, velocity=v), calm)[1] for v in (at_rest, lambda: (9.0, 0, 0)))
    assert np.std(np.diff(fast)) / np.std(np.diff(slow)) == pytest.approx(3.0, rel=0.1)  # sqrt(9 / 1)


def test_the_seed_decides_and_nothing_else():
    gusty = WIND.model_copy(update={"gust_m_s": 3.0})
    assert np.array_equal(blown(gusty, 20.0), blown(gusty, 20.0))
    assert abs(np.corrcoef(blown(WIND, 100.0)[:, 0], blown(WIND, 100.0, seed=2)[:, 0])[0, 1]) < 0.3
    # Gusts have a stream of their own: what is left without them is the turbulence alone.
    gusts = Wind(gust_m_s=3.0)
    alone = blown(WIND, 20.0) + blown(gusts, 20.0)
    assert blown(gusty, 20.0) == pytest.approx(alone, abs=1e-9)


def test_gusts_are_cosines_of_their_length_at_random_times_from_all_round():
    wind = Wind(gust_m_s=4.0, gust_s=0.8, gust_period_s=5.0)
    ned = blown(wind, 2000.0)
    speed = np.hypot(ned[:, 0], ned[:, 1])
    begins = np.flatnonzero((speed[1:] > 0) & (speed[:-1] == 0)) + 1
    assert len(begins) == pytest.approx(2000.0 / 5.0, rel=0.15)
    assert np.std(np.diff(begins) * PERIOD_S) == pytest.approx(4.2, rel=0.25)  # exponential: as its mean
    length = round(0.8 / PERIOD_S)
    begins = begins[begins < len(ned) - length]
    one = speed[begins[3] : begins[3] + length]
    assert np.max(one) == pytest.approx(4.0, rel=1e-3)
    assert np.argmax(one) == pytest.approx(length / 2, abs=1)
    assert np.mean(one) == pytest.approx(2.0, rel=0.01)
    east, north = ned[begins + length // 2, 1], ned[begins + length // 2, 0]
    assert hypot(np.mean(north), np.mean(east)) < 4.0 * 4 / sqrt(len(begins))


def body(frame, height_m=100.0, yaw_rad=0.0):
    return Dynamics(frame, (0.0, 0.0, -height_m), yaw_rad, rate_hz=500, **ORIGIN)


def run(dynamics, steps):
    for _ in range(steps):
        dynamics.run()


def specific_force(dynamics, steps=2):
    run(dynamics, steps)
    return dynamics.motion()[3]


def test_drag_acts_on_the_velocity_through_the_air():
    dynamics = body(ABEJORRO, yaw_rad=pi / 2)  # it looks east, so air that moves north comes from its right
    dynamics.set_air_velocity((3.0, -2.0, 1.0))
    run(dynamics, 1)
    north, east, down = dynamics.velocity_ned_m_s()
    through = (-2.0 - east, -(3.0 - north), 1.0 - down)
    expected = [
        k * v * abs(v) / ABEJORRO.mass_kg for k, v in zip(ABEJORRO.drag.force_n_s2_m2, through, strict=True)
    ]
    assert specific_force(dynamics, 1) == pytest.approx(expected, rel=0.01)


def test_a_falling_body_drifts_with_the_wind():
    dynamics = body(ABEJORRO, height_m=400.0)
    dynamics.set_air_velocity((5.0, -3.0, 0.0))
    run(dynamics, 5000)
    north, east, down = dynamics.velocity_ned_m_s()
    left = [v / (1 + 0.635 * abs(v) * 10.0 / ABEJORRO.mass_kg) for v in (5.0, -3.0)]  # of v' = -k v |v| / m
    assert (5.0 - north, -3.0 - east) == pytest.approx(left, rel=0.06)
    assert down == pytest.approx(sqrt(ABEJORRO.mass_kg * 9.8085 / 2.352), rel=0.01)


def affected(frame, **effects):
    motor = frame.motor.model_copy(update={"time_constant_s": 0.0})
    return frame.model_copy(update={"air": AirEffects(**effects), "motor": motor})


def test_drag_of_the_rotors_is_linear_in_their_plane():
    c, speed = 8.06428e-5, X500.hover_speed_rad_s
    frame = affected(X500.model_copy(update={"drag": type(X500.drag)()}), rotor_drag_n_s2_m_rad=c)
    dynamics = body(frame, yaw_rad=0.7)
    dynamics.command_motors((speed,) * 4)
    run(dynamics, 10)
    dynamics.set_air_velocity((4.0, 0.0, 3.0))
    run(dynamics, 1)
    along, aside = 4.0 * cos(0.7), -4.0 * sin(0.7)
    x, y, z = specific_force(dynamics, 1)
    assert (x, y) == pytest.approx([4 * c * speed * v / frame.mass_kg for v in (along, aside)], rel=0.01)
    assert z == pytest.approx(-9.80665, rel=1e-3)
    # The discs are 58 mm above the centre of mass, so the wind lifts the nose: y' = z F / I.
    before = dynamics.angular_rate_frd_rad_s()[1]
    run(dynamics, 5)
    nod = (dynamics.angular_rate_frd_rad_s()[1] - before) / 0.01
    assert nod == pytest.approx(-0.058 * 4 * c * speed * along / frame.inertia_kg_m2[1], rel=0.05)


def test_a_declared_airframe_flies_level_as_fast_as_its_rotors_drag_allows():
    fast = X500.limits.model_copy(update={"speed_horizontal_m_s": 100.0})
    bare = X500.model_copy(update={"limits": fast})
    hardly, really = (affected(bare, rotor_drag_n_s2_m_rad=c) for c in (1e-15, 8.06428e-5))
    assert hardly.level_speed_m_s == pytest.approx(bare.level_speed_m_s, rel=1e-6)
    v, tilt = really.level_speed_m_s, fast.tilt_rad
    thrust_n = X500.weight_n * cos(tilt) + 0.09 * (v * sin(tilt)) ** 2
    speed = sqrt(thrust_n / (4 * X500.motor.thrust_n_s2))
    along = v * cos(tilt)
    assert 0.037 * along**2 + 4 * 8.06428e-5 * speed * along == pytest.approx(X500.weight_n * sin(tilt))


@pytest.mark.parametrize("height_m", [0.03, 0.05, 0.1, 0.3])
def test_ground_effect_by_cheeseman_and_bennett(height_m):
    flat = load_airframe("racer-3in").model_copy(update={"drag": type(X500.drag)()})
    frame = affected(flat, ground_effect=True)
    radius_m = frame.motor.radius_m
    dynamics = body(frame, height_m=height_m + 0.5)
    dynamics.set_ground_height(0.5)
    dynamics.command_motors((frame.hover_speed_rad_s,) * 4)
    force = specific_force(dynamics, 3)[2]
    rotor_m = max(-dynamics.position_ned_m()[2] - 0.5 + 0.015, radius_m / 2)
    assert force == pytest.approx(-9.80665 / (1 - (radius_m / (4 * rotor_m)) ** 2), rel=1e-3)


def test_ground_effect_is_bounded():
    frame = affected(ABEJORRO.model_copy(update={"envelope_m": (0.25, 0.25, 0.01)}), ground_effect=True)
    dynamics = body(frame, height_m=0.006)
    dynamics.command_motors((frame.hover_speed_rad_s / 2,) * 4)
    assert specific_force(dynamics, 3)[2] > -9.9  # the ground carries the rest of the weight
    dynamics.command_motors((frame.hover_speed_rad_s,) * 4)
    assert specific_force(dynamics, 3)[2] == pytest.approx(-9.80665 * 4 / 3, rel=0.01)


def states(seed, wind=WIND, airframe=X500):
    world = World(Scenario(name="windy", base=Base(), start=StartPose(), wind=wind), airframe, seed)
    for _ in range(500):
        world.step((1.02 * airframe.hover_speed_rad_s,) * 4)
    return world.sensors()


def test_a_windy_world_depends_on_its_seed_and_a_still_one_does_not():
    assert states(1) == states(1)
    assert states(1).position_ned_m != states(2).position_ned_m
    assert states(1, Wind()) == states(2, Wind())
    assert states(1, Wind()).position_ned_m[:2] == pytest.approx((0.0, 0.0), abs=1e-3)


def test_wind_moves_the_drone_to_where_it_blows():
    north, east, _ = states(1, Wind(speed_m_s=4.0, direction_rad=pi / 2)).velocity_ned_m_s
    assert east < -0.1  # the arena's y is to the left of its x, which points north
    assert abs(north) < 0.01
