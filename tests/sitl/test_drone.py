"""One served drone, advanced by hand."""

from scenarios.loader import load_scenario
from sitl.drone import ServedDrone
from sitl.server_settings import ServerSettings
from sitl.simulation import Simulation


def test_it_goes_on_speaking_while_its_sensors_say_nothing_usable(monkeypatch):
    simulation = Simulation(load_scenario("empty"))
    drone = ServedDrone(simulation, ServerSettings(), boot_unix_us=0)
    times_us = []
    monkeypatch.setattr(drone.node, "update", times_us.append)
    drone.tick()
    assert simulation.faults.inject(0, 1, 0) == "gyroscope off"
    for _ in range(3):
        drone.tick()
    assert times_us == [0, 4000, 8000, 12000]
