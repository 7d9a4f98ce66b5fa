"""The command line: every expected fault is one line and exit code 2; the small commands work."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import cv2
import pytest

from framerunner.cli import run
from offboard.mission import list_missions
from scenarios.loader import list_scenarios
from tests.processes import ROOT, bound, free_instance

PAPER = (ROOT / "offboard" / "missions" / "frame_challenge.yaml").read_text(encoding="utf-8")
COMMANDS = [
    "sim",
    "fly",
    "replay",
    "evaluate",
    "camera",
    "doctor",
    "film",
    "bound",
    "monitor",
    *(f"mission {name}" for name in ("list", "show", "check", "new")),
    *(f"scenario {name}" for name in ("list", "show", "check", "schema", "random")),
]


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def refused(capsys):
    """Run a command that must be refused; its one line."""

    def refuse(*arguments):
        signal.alarm(30)  # ends this test run if the command is not refused
        code = run([str(argument) for argument in arguments])
        signal.alarm(0)
        captured = capsys.readouterr()
        lines = captured.err.splitlines()
        assert code == 2
        assert captured.out == ""
        assert len(lines) == 1
        assert lines[0].startswith("error: ")
        return lines[0]

    return refuse


def write(name, text):
    path = Path(name)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("command", [["fly"], ["sim", "--scenario"], ["scenario", "show"]], ids=" ".join)
def test_an_unknown_scenario_is_refused_with_the_known_ones(refused, command):
    line = refused(*command, "no-such-place")
    assert "no-such-place" in line
    assert all(name in line for name in list_scenarios())


@pytest.mark.parametrize(
    "command", [["fly"], ["scenario", "check"], ["sim", "--scenario"], ["mission", "check"]], ids=" ".join
)
def test_broken_yaml_is_refused_with_its_line(refused, command):
    path = write("broken.yaml", "name: mine\nframes: [\n  {colour: red\n")
    assert f"{path}:" in refused(*command, path)


def test_a_scenario_with_a_bad_value_is_refused_with_field_value_and_line(refused):
    path = write("far.yaml", "name: far\nframes:\n  - {colour: red, x_m: 70, y_m: 0, z_m: 1}\n")
    line = refused("fly", path)
    assert f"{path}:3" in line
    assert "x_m" in line
    assert "70" in line


@pytest.mark.parametrize("command", [["mission", "check"], ["mission", "show"], ["fly", "--mission"]])
def test_a_mission_with_an_unknown_primitive_is_refused(refused, command):
    Path("missions").mkdir()
    path = write("missions/mine.yaml", PAPER.replace("- fly_to_goal", "- flap_wings", 1))
    line = refused(*command, path)
    assert "flap_wings" in line
    assert f"{path}:{1 + PAPER[: PAPER.index('- fly_to_goal')].count(chr(10))}" in line


def test_remarks_name_the_file_as_it_was_named(capsys):
    Path("missions").mkdir()
    path = write("missions/waits.yaml", PAPER)
    assert run(["mission", "check", str(path)]) == 0
    good, *remarks = capsys.readouterr().out.splitlines()
    assert remarks
    assert all(line.startswith(f"{path}:") for line in (good, *remarks))


def test_descriptions_of_missions_are_in_one_column(capsys):
    assert run(["mission", "list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    start = max(map(len, list_missions())) + 2
    assert all(line[start - 1] == " " and line[start] != " " for line in lines)


def test_a_folder_of_missions_that_is_not_there_is_refused(refused):
    assert "--missions nowhere: is not a folder" in refused("monitor", "--missions", "nowhere")


@pytest.mark.parametrize(
    "expression",
    [
        "__import__('os').system('touch harmed')",
        "().__class__.__bases__[0].__subclasses__()",
        "open('harmed', 'w')",
        "(lambda: 1)()",
        "cmd.__class__",
    ],
)
@pytest.mark.parametrize("command", [["mission", "check"], ["fly", "--mission"]], ids=" ".join)
def test_an_unsafe_expression_is_refused_and_not_done(refused, command, expression):
    path = write("mine.yaml", PAPER.replace("- when: frame_seen", f'- when: "{expression}"', 1))
    assert f"{path}:" in refused(*command, path)
    assert not Path("harmed").exists()
    assert not Path("runs").exists()


@pytest.mark.parametrize("command", ["fly", "sim"])
@pytest.mark.parametrize("speed", ["0", "-1", "nan", "inf", "1e9", "fast"])
def test_a_bad_speed_is_refused(refused, command, speed):
    line = refused(command, "--speed", speed)
    assert "--speed" in line
    assert speed in line or f"{float(speed):g}" in line


@pytest.mark.parametrize("command", ["fly", "sim"])
@pytest.mark.parametrize("instance", ["-1", "10", "1.5", "one"])
def test_a_bad_instance_is_refused(refused, command, instance):
    assert "--instance" in refused(command, "--instance", instance)


def test_a_drone_needs_a_camera_and_a_camera_a_drone(refused):
    assert "--camera" in refused("fly", "--drone", "udpin://127.0.0.1:25099")
    assert "--drone" in refused("fly", "--camera", "http://127.0.0.1:1/video")


def test_a_running_simulator_needs_the_url_of_its_drone_and_a_valid_one_itself(refused):
    assert "--drone" in refused("fly", "--simulator", "http://127.0.0.1:8100")
    assert "--vio: is for a drone given by --drone" in refused("fly", "--vio")
    line = refused("fly", "--drone", "udpin://127.0.0.1:25099", "--simulator", "127.0.0.1:8100")
    assert "--simulator '127.0.0.1:8100'" in line and "http://HOST:PORT" in line


def test_a_simulator_that_is_not_there_is_refused_and_leaves_no_folder(refused):
    line = refused("fly", "--drone", "udpin://127.0.0.1:25099", "--simulator", "http://127.0.0.1:9")
    assert "--simulator http://127.0.0.1:9: nothing there answers" in line
    assert not Path("runs").exists()


@pytest.mark.parametrize("option", ["--speed", "--instance"])
def test_options_of_the_simulator_do_not_go_with_a_drone(refused, option):
    assert option in refused("fly", "--drone", "udpin://127.0.0.1:25099", "--camera", ".", option, "2")


@pytest.mark.parametrize("url", ["foo://x", "udpin://:14540", "serial:///dev/ttyUSB0", "14540"])
def test_a_bad_drone_address_is_refused_and_leaves_no_folder(refused, url):
    line = refused("fly", "--drone", url, "--camera", ".")
    assert url in line
    assert "udpin://0.0.0.0:14540" in line
    assert not Path("runs").exists()


def test_a_camera_that_is_not_there_is_refused_and_leaves_no_folder(refused):
    assert "nowhere.avi" in refused("fly", "--drone", "udpin://127.0.0.1:25099", "--camera", "nowhere.avi")
    assert not Path("runs").exists()


def test_an_out_folder_that_cannot_be_made_is_refused(refused):
    write("file", "")
    line = refused("fly", "--out", "file/runs")
    assert "--out file/runs" in line


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_an_out_folder_that_may_not_be_written_to_is_refused(refused):
    Path("locked").mkdir(mode=0o500)
    assert "--out locked" in refused("fly", "--out", "locked")


@pytest.mark.parametrize("base", [14580, 18570])
def test_a_busy_udp_port_is_refused_before_anything_is_said(refused, base):
    instance = free_instance()
    with bound(base + instance):
        line = refused("sim", "--instance", instance)
    assert str(base + instance) in line
    assert "--instance" in line


def test_a_busy_video_port_is_refused_before_anything_is_said(refused):
    instance = free_instance()
    with bound(8100 + instance, socket.SOCK_STREAM):
        assert str(8100 + instance) in refused("sim", "--instance", instance)


def test_a_viewer_of_no_monitor_is_not_waited_for(refused):
    assert "add --monitor" in refused("fly", "--wait-for-viewer")


@pytest.mark.parametrize(
    ("given", "named"),
    [
        (["--speed", "2", "--instance", "3"], "leave out --speed and --instance"),
        (["--drone", "udpin://127.0.0.1:14540", "--camera", "0"], "leave out --drone"),
    ],
)
def test_options_without_a_use_in_lockstep_are_named(refused, given, named):
    assert named in refused("fly", "--lockstep", *given)


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ("lagg=0.5", "--response lagg=0.5: unknown name; did you mean 'lag'?"),
        ("lag=0.5,lag=0.6", "--response: lag is given twice; give it once"),
        ("lag=quick", "--response lag=quick: write a number, such as lag=0.5"),
        ("lag", "--response lag=: write a number, such as lag=0.5"),
        ("lag=0.5,dead-time=9", "--response dead-time 9: must be from 0 to 1"),
        ("lag=nan", "--response lag nan: must be from 0 to 2"),
    ],
)
def test_a_bad_response_is_refused(refused, given, line):
    assert refused("fly", "--lockstep", "--response", given) == f"error: {line}"


def test_the_limits_of_a_drone_belong_to_a_real_drone_and_the_open_class(refused):
    drone = ("--drone", "udpin://127.0.0.1:14599", "--camera", "0")
    limits = ("--drone-limits", "forward=2,left=1.5,up=1,yaw-rate=1")
    open_ = ("--mission", str(write("open.yaml", "class: open\nextends: frame_challenge\n")))
    assert "by the contest's; leave it out" in refused("fly", *drone, *limits)
    assert "is for a drone given by --drone" in refused("fly", *open_, *limits)
    assert "say what the drone can do" in refused("fly", *drone, *open_)
    assert "left is missing" in refused("fly", *drone, *open_, "--drone-limits", "forward=2,up=1")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--lockstep", "--fault", "gps off"], "write PART [NUMBER] KIND [SIZE] at SECONDS"),
        (["--lockstep", *["--fault", "camera black at 3 s"] * 21], "at most 20 faults, not 21"),
        (["--fault", "link off at 3 s"], "add --lockstep"),
        (["--drone", "udpin://127.0.0.1:14599", "--camera", "0", "--fault", "gps off at 3"], "with --drone"),
    ],
)
def test_a_fault_that_cannot_be_flown_is_refused(refused, given, words):
    assert words in refused("fly", *given)


def test_a_camera_delay_out_of_range_is_refused(refused):
    line = refused("fly", "--drone", "udpin://127.0.0.1:14599", "--camera", "0", "--camera-delay", "2")
    assert line == "error: --camera-delay 2: must be from 0 to 0.5"


def test_a_remote_host_without_address_is_refused(refused):
    line = refused("sim", "--instance", free_instance(), "--ground-remote", "two..dots")
    assert "two..dots" in line


def test_a_bind_address_of_another_machine_is_refused(refused):
    assert "192.0.2.1" in refused("sim", "--instance", free_instance(), "--bind", "192.0.2.1")


def test_fly_reports_a_busy_port_of_the_simulator(refused):
    instance = free_instance()
    with bound(14580 + instance):
        line = refused("fly", "--instance", instance)
    assert str(14580 + instance) in line
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    "arguments", [["hover"], ["sim", "--wings", "2"], ["mission", "fly"], ["fly", "a", "b"]]
)
def test_what_is_unknown_is_refused_with_a_hint(refused, arguments):
    line = refused(*arguments)
    assert any(word in line for word in ("hover", "--wings", "b"))
    assert "--help" in line


def test_a_picture_that_cannot_be_written_is_refused(capsys):
    assert run(["scenario", "show", "empty", "--out", "missing/empty.png"]) == 2
    assert "missing/empty.png" in capsys.readouterr().err


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_examples_that_fit_80_columns(capsys, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "80")
    assert run([*command.split(), "--help"]) == 0
    help_text = capsys.readouterr().out
    assert "Example" in help_text
    assert "default: (" not in help_text  # a value as one would type it
    section = help_text.partition("Example")[2].partition("╭")[0]
    examples = [line.strip() for line in section.splitlines()[1:] if line.strip()]
    assert examples[0].startswith(f"framerunner {command}")
    assert all(line.startswith("framerunner ") for line in examples), "an example is wrapped"


def test_without_arguments_help_is_shown(capsys):
    assert run([]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in ("sim", "fly", "mission", "scenario"))


def test_scenarios_are_listed_with_what_they_are(capsys):
    assert run(["scenario", "list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(list_scenarios())
    assert all(len(line.split()) > 3 for line in lines)


def test_a_shown_scenario_is_a_scenario_and_its_picture_a_picture(capsys):
    assert run(["scenario", "show", "test-case-1"]) == 0
    shown = capsys.readouterr()
    picture = cv2.imread("test-case-1.png")
    assert picture.shape[0] > 300
    assert "test-case-1.png" in shown.err
    path = write("copy.yaml", shown.out)
    assert run(["scenario", "check", str(path)]) == 0
    assert "3 frames" in capsys.readouterr().out


def test_the_schema_of_scenarios_is_json(capsys):
    assert run(["scenario", "schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert {"name", "frames", "camera"} <= set(schema["properties"])


def test_missions_are_listed_with_what_they_are(capsys):
    assert run(["mission", "list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(list_missions())
    assert all(len(line.split()) > 3 for line in lines)


def test_a_shown_mission_is_a_mermaid_diagram_of_its_states(capsys):
    assert run(["mission", "show", "frame_challenge"]) == 0
    diagram = capsys.readouterr().out
    assert "stateDiagram-v2" in diagram
    assert all(state in diagram for state in ("turning", "frame_visible", "crossing", "shift_left"))
    assert "-->" in diagram


def test_a_good_mission_is_said_to_be_good(capsys):
    assert run(["mission", "check", str(write("mine.yaml", PAPER))]) == 0
    assert "good" in capsys.readouterr().out


def framerunner(*arguments, **options):
    command = [sys.executable, "-m", "framerunner", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False, **options)


def test_as_a_program_a_fault_is_one_line_and_exit_code_2():
    done = framerunner("fly", "no-such-place")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1


INTERRUPTED_IN_DESTRUCTOR = """
import os, signal, time
from framerunner import cli

class Closing:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.01)

cli._handle_signals()
try:
    Closing()
    time.sleep(10.0)
except KeyboardInterrupt:
    print("stopped")
"""


def test_sigterm_is_not_lost_where_python_drops_exceptions():
    program = [sys.executable, "-c", INTERRUPTED_IN_DESTRUCTOR]
    done = subprocess.run(program, cwd=ROOT, capture_output=True, text=True, timeout=20, check=False)
    assert (done.stdout, done.stderr, done.returncode) == ("stopped\n", "", 0)


# It lasts until its time limit of 180 s, so it is not over when the signal comes.
LONG_FLIGHT = ("fly", "round-1", "--mission", "frame_challenge", "--lockstep")


@pytest.mark.parametrize("seconds", [0.1, 0.4, 0.8, 1.6])
def test_sigterm_while_a_flight_starts_ends_it_without_a_traceback(tmp_path, seconds):
    program = [sys.executable, "-m", "framerunner", *LONG_FLIGHT]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        program, cwd=tmp_path, env=environment, stderr=subprocess.PIPE, text=True
    ) as running:
        time.sleep(seconds)  # at any point of the start
        running.send_signal(signal.SIGTERM)
        said = running.communicate(timeout=20)[1]
    assert "Traceback" not in said
    assert "ignored" not in said
    assert running.returncode in (130, -signal.SIGTERM, -signal.SIGINT), said
    assert all(any(folder.iterdir()) for folder in (tmp_path / "runs").glob("*"))


def test_sigterm_ends_a_flight_in_order_where_ctrl_c_is_ignored(tmp_path):
    """As in the background of a script."""
    script = f'trap "" INT; exec "{sys.executable}" -m framerunner {" ".join(LONG_FLIGHT)}'
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        ["sh", "-c", script], cwd=tmp_path, env=environment, stderr=subprocess.PIPE
    ) as running:
        for line in running.stderr:
            if b"times real time" in line:  # it flies
                break
        running.send_signal(signal.SIGINT)
        running.send_signal(signal.SIGTERM)
        running.communicate(timeout=20)
    assert running.returncode == 130
    (folder,) = (tmp_path / "runs").iterdir()
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert result["verdict"] == "aborted"
    assert "interrupted" in result["reason"]


def test_a_reader_that_closes_its_pipe_is_no_fault():
    schema = [sys.executable, "-m", "framerunner", "scenario", "schema"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(schema, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as writer:
        writer.stdout.close()
        assert writer.stderr.read() == b""
        assert writer.wait(20) == 0


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_closed_standard_stream_is_no_fault(closed):
    shell = f'"$0" -m framerunner scenario list {closed}'
    done = subprocess.run(["sh", "-c", shell, sys.executable], cwd=ROOT, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")


def test_the_version_is_printed(capsys):
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.strip().count(".") == 2


def test_help_keeps_text_in_angle_brackets(capsys):
    assert run(["fly", "--help"]) == 0
    assert "runs/<time>-<scenario>/" in capsys.readouterr().out


def test_bounds_of_one_scenario_and_of_a_level(capsys, refused):
    assert run(["bound", "test-case-1", "--out", "bound.png"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("test-case-1, class contest: no try is shorter than ")
    assert [line.split()[0] for line in lines[2:]] == ["start", "red", "green", "blue", "motors", "possible:"]
    assert cv2.imread("bound.png").shape[1] > 1000
    assert run(["bound", "--level", "calm", "--seeds", "3:5", "--class", "open"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert [row[0] for row in rows] == ["calm-3", "calm-4", "calm-5", "5", "median,", "95"]
    for _, bound_s, possible_s, times in rows[:3]:
        assert float(times) == pytest.approx(float(possible_s) / float(bound_s), abs=0.01)
        assert float(times) > 1.0
    middle = sorted(float(row[1]) for row in rows[:3])[1]
    assert float(rows[4][-3]) == pytest.approx(middle, abs=0.01)
    assert "give either a scenario or --level" in refused("bound")
    assert "give either a scenario or --level" in refused("bound", "calm-1", "--level", "calm")
    assert "add --level, or leave it out" in refused("bound", "calm-1", "--seeds", "1:2")
    assert "--seeds: say which, such as 1:300" in refused("bound", "--level", "calm")
    assert "give the first and the last" in refused("bound", "--level", "calm", "--seeds", "5:3")
    assert "is for one scenario" in refused("bound", "--level", "calm", "--seeds", "5:6", "--out", "a.png")
    assert "has no frames" in refused("bound", "empty")
    assert "plot" in refused("bound", "calm-1", "--out", "bound.doc")
