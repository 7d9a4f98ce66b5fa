"""`framerunner.Simulator` and the fixtures of pytest: a drone of one's own, its truth, its log."""

import ast
import os
import socket
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from urllib.request import urlopen

import pytest
from pymavlink import mavutil

import framerunner
from tests.documents import blocks

pytestmark = pytest.mark.realtime
ROOT = Path(__file__).parents[2]


def pytest_here(folder, *arguments):
    """Run pytest in a folder, with the plugin only; its output and exit code."""
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_ADDOPTS": ""}
    command = [sys.executable, "-m", "pytest", "-p", "framerunner.pytest_plugin", "-q", "--rootdir=."]
    done = subprocess.run(
        [*command, *arguments],
        check=False,
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    return done.stdout, done.returncode


def test_a_simulator_has_ports_of_its_own_a_truth_and_a_log():
    with framerunner.Simulator("calm-17", speed=4) as one, framerunner.Simulator(speed=4) as other:
        urls = [url for each in (one, other) for url in (each.drone_url, each.ground_url, each.video_url)]
        assert len(set(urls)) == 6
        before = one.truth()
        scenario = framerunner.load_scenario("calm-17")
        assert before.position_arena_m[:2] == pytest.approx(
            (scenario.start.x_m, scenario.start.y_m), abs=0.01
        )
        assert not before.motors_on
        one.wait_until_ready()
        time.sleep(0.2)
        assert one.truth().time_us > before.time_us
        assert "Ready for takeoff!" in one.log
        for url in (one.drone_url, one.ground_url):
            link = mavutil.mavlink_connection(url.replace("://", ":"))
            beat = link.wait_heartbeat(timeout=20)
            assert beat.get_srcSystem() == one.system_id
            link.close()
        with urlopen(one.video_url, timeout=10) as video:
            assert b"jpeg" in video.read(2000)
    with pytest.raises(framerunner.UserError, match="is not running; use it within"):
        one.truth()


def test_the_truth_is_on_no_port():
    """Only the program that started the simulator can ask: nothing listens for others."""
    with framerunner.Simulator(speed=4) as simulator:
        pid = simulator._process._process.pid
        listening = Path(f"/proc/{pid}/net/tcp").read_text().splitlines()[1:]
        sockets = {os.readlink(each) for each in Path(f"/proc/{pid}/fd").iterdir() if each.is_symlink()}
        inodes = {f"socket:[{line.split()[9]}]": line.split() for line in listening}
        own = [inodes[each] for each in sockets & inodes.keys() if inodes[each][3] == "0A"]
        ports = {int(words[1].rpartition(":")[2], 16) for words in own}
        assert ports == {int(simulator.video_url.split(":")[2].partition("/")[0])}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"sensors": "nothing"}, 'the simulator ended with code 2: unknown suite "nothing"'),
        ({"speed": 5000}, "--speed 5000: must be from 0.01 to 1000"),
        ({"faults": ("gps explodes",)}, "gps"),
    ],
)
def test_what_cannot_be_started_is_refused_in_one_line(options, words):
    with pytest.raises(framerunner.UserError, match=r"^[^\n]*$") as refused, framerunner.Simulator(**options):
        pass
    assert words in str(refused.value)


def test_a_drone_that_cannot_be_armed_is_not_waited_for_long():
    simulator = framerunner.Simulator(sensors="outdoor", speed=0.1)
    with simulator, pytest.raises(framerunner.UserError, match=r"not ready within 0.2 s"):
        simulator.wait_until_ready(0.2)


def test_a_simulator_that_was_killed_is_told_in_one_line():
    with framerunner.Simulator() as simulator:
        simulator._process._process.kill()
        for ask in (simulator.truth, simulator.wait_until_ready):
            with pytest.raises(framerunner.UserError, match="the simulator was ended by signal 9"):
                ask()


def test_all_ports_are_free_again_afterwards():
    with framerunner.Simulator(speed=4) as simulator:
        port = int(simulator.video_url.split(":")[2].partition("/")[0])
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", port))


def test_the_example_with_mavsdk_passes(tmp_path):
    output, code = pytest_here(
        tmp_path, str(ROOT / "examples" / "test_with_mavsdk.py"), "-p", "no:cacheprovider"
    )
    assert code == 0, output
    assert "1 passed" in output


def test_the_example_with_pymavlink_takes_off():
    script = ROOT / "examples" / "pymavlink_script.py"
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.splitlines()[:2] == ["arm: 0", "take off: 0"]
    assert "land: 0" in done.stdout


def test_the_simulator_of_the_document_is_there(capsys):
    exec(blocks("api.md", "python")[1], {"framerunner": framerunner})
    x_m, y_m, _ = ast.literal_eval(capsys.readouterr().out)
    scenario = framerunner.load_scenario("calm-17")
    assert (x_m, y_m) == pytest.approx((scenario.start.x_m, scenario.start.y_m), abs=0.05)


def test_the_test_of_the_document_passes(tmp_path):
    (shown,) = blocks("ci.md", "python")
    (tmp_path / "test_shown.py").write_text(shown, encoding="utf-8")
    output, code = pytest_here(tmp_path, "test_shown.py", "-p", "no:cacheprovider")
    assert code == 0, output


def test_the_script_with_mavsdk_of_the_document_flies():
    (script,) = blocks("simulator.md", "python")
    with framerunner.Simulator() as simulator:
        assert "udpin://0.0.0.0:14540" in script
        script = script.replace("udpin://0.0.0.0:14540", simulator.drone_url)
        command = [sys.executable, "-c", script]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert float(done.stdout.partition("height:")[2]) == pytest.approx(2.5, abs=0.5), done.stderr


def test_a_failure_has_the_log_and_the_result(tmp_path):
    (tmp_path / "test_mine.py").write_text(
        textwrap.dedent(
            """
            import pytest, sys

            def test_nothing_heavy_is_loaded():
                assert "numpy" not in sys.modules and "pydantic" not in sys.modules

            @pytest.mark.framerunner("calm-17", speed=5)
            def test_simulator(framerunner_sim):
                assert framerunner_sim.truth().motors_on

            def test_flight(framerunner_flight):
                assert framerunner_flight("test-case-1", "hover").completed

            @pytest.mark.framerunner("nowhere")
            def test_bad(framerunner_sim):
                pass

            def test_good(framerunner_sim):
                assert not framerunner_sim.truth().motors_on
            """
        ),
        encoding="utf-8",
    )
    output, code = pytest_here(tmp_path, "--strict-markers")
    assert code == 1
    assert "2 failed, 2 passed, 1 error" in output
    assert "- framerunner sim -" in output
    assert "abejorro in calm-17: MAVLink to UDP" in output
    assert "- framerunner flight test-case-1 -" in output
    assert '"verdict": "' in output
    assert 'unknown scenario "nowhere"' in output
