"""Sensors for a genuine autopilot, which estimates its state: it cannot be given the true one."""

from __future__ import annotations

from scenarios.models import Scenario

SUITE_INSTEAD_OF_IDEAL = "mocap"


def with_estimable_sensors(scenario: Scenario) -> Scenario:
    """The scenario, with motion capture and the usual errors if its sensors are ideal."""
    if scenario.sensors != "ideal":
        return scenario
    return scenario.model_copy(update={"sensors": SUITE_INSTEAD_OF_IDEAL})
