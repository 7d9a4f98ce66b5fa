"""Real flights, MAVSDK and UDP, over a proxy that swaps, loses and delays.

Many more, in simulated time, are in
`tests/framerunner/test_bad_links.py`.
"""

import json

import pytest

from scenarios.loader import dump_yaml
from tests.framerunner.simulated_link import Impairment
from tests.framerunner.test_bad_links import before_a_low_gate
from tests.free_ports import free_port
from tests.processes import program, simulator
from tests.realtime.conftest import Peer
from tests.realtime.udp_proxy import UdpProxy

pytestmark = pytest.mark.realtime

HOLD_OR_LAND = (4 << 16 | 3 << 24, 4 << 16 | 6 << 24)


@pytest.mark.parametrize(
    ("impairment", "ends"),
    [
        (Impairment(swap_every_s=1.03), ("timed out",)),
        (Impairment(loss=0.2, jitter_s=0.2), ("timed out", "aborted")),
    ],
    ids=["swapped", "lost and delayed"],
)
def test_a_flight_over_a_bad_link_ends_in_hold(tmp_path, instance, impairment, ends):
    scenario = tmp_path / "low.yaml"
    short = before_a_low_gate().model_copy(update={"try_limit_s": 7.0})
    scenario.write_text(dump_yaml(short), encoding="utf-8")
    app_port = free_port()
    with UdpProxy(impairment, app_port) as proxy:
        where = ("--scenario", str(scenario), "--onboard-remote", f"127.0.0.1:{proxy.port}")
        with simulator(tmp_path, instance, *where):
            folder = tmp_path / "app"
            folder.mkdir()
            urls = ("--drone", f"udpin://127.0.0.1:{app_port}", "--camera", camera(instance), "--simulated")
            mission = ("--mission", "frame_challenge")
            with program(folder, "fly", str(scenario), *urls, *mission) as flight:
                assert flight.process.wait(90.0) == 1, flight.err + flight.out
            peer = Peer(14550 + instance)
            heartbeat = peer.wait("HEARTBEAT", lambda heartbeat: heartbeat.get_srcComponent() == 1)
            peer.link.close()
    (run,) = (folder / "runs").iterdir()
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    assert result["ended"] in ends, result["reason"]
    assert "ran back" not in result["reason"]
    assert heartbeat.custom_mode in HOLD_OR_LAND
    assert "Traceback" not in flight.err


def camera(instance):
    return f"http://127.0.0.1:{8100 + instance}/video"
