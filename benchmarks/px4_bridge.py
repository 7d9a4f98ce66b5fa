"""What PX4's simulator interface costs a step beside physics: `python -m benchmarks.px4_bridge`.

Timed are the packing of the sensors' messages, the reading of PX4's outputs, and the whole step with physics.
"""

from __future__ import annotations

import time

from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader, packed
from scenarios.loader import load_scenario
from sitl.autopilots.sensors import with_estimable_sensors
from sitl.px4.simulation import Px4Simulation
from sitl.px4.simulator_messages import ActuatorControls

STEPS = 20_000
HOVER = 0.26


def main() -> None:
    """Print the mean times, microseconds a step."""
    simulation = Px4Simulation(with_estimable_sensors(load_scenario("test-case-1")))
    px4, reader = mavlink.MAVLink(None, 1, 1), PacketReader()
    packed_s = read_s = 0.0
    messages = simulation.messages
    pack = messages.pack

    def timed_pack(*arguments: object) -> bytes:
        nonlocal packed_s
        began_s = time.perf_counter()
        packets = pack(*arguments)  # type: ignore[arg-type]
        packed_s += time.perf_counter() - began_s
        return packets

    messages.pack = timed_pack  # type: ignore[method-assign]
    began_s = time.perf_counter()
    for _ in range(STEPS):
        time_us = simulation.time_us
        simulation.sense()
        outputs = [HOVER] * 4 + [0.0] * 12
        answer = packed(mavlink.MAVLink_hil_actuator_controls_message(time_us, outputs, 129, 1), px4)
        read_began_s = time.perf_counter()
        (message,) = reader.feed(answer)
        controls = ActuatorControls.of(message)
        read_s += time.perf_counter() - read_began_s
        simulation.move(controls)
    all_s = time.perf_counter() - began_s
    for name, seconds in (("packing", packed_s), ("reading", read_s), ("all of a step", all_s)):
        print(f"{name}: {1e6 * seconds / STEPS:.1f} us")


if __name__ == "__main__":
    main()
