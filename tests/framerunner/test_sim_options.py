"""Invalid options of `framerunner sim`: one line each, and nothing is opened."""

import pytest

from framerunner.cli import run


@pytest.fixture
def refused(capsys):
    """Run the simulator with options that it must refuse; its one line."""

    def ask(*options):
        assert run(["sim", *map(str, options)]) == 2
        said = capsys.readouterr()
        assert said.out == ""
        assert len(said.err.strip().splitlines()) == 1
        return said.err

    return ask


@pytest.mark.parametrize(
    ("link", "said"),
    [
        ("nonsense", "examples: udpout://"),
        ("udpout://station:99999", "port 99999 must be from 1 to 65535"),
        ("tcpin://127.0.0.1:5760?streams=some", "streams=onboard|ground|normal"),
        ("serial://ttyUSB0:57600", "serial:///dev/ttyUSB0:57600"),
    ],
)
def test_a_bad_link(refused, link, said):
    line = refused("--link", link)
    assert f"--link {link}" in line
    assert said in line


def test_a_link_given_twice(refused):
    link = "tcpin://127.0.0.1:5760"
    assert f"--link {link}: given twice" in refused("--link", link, "--link", link)


@pytest.mark.parametrize("count", ["0", "11", "-1", "1.5", "many"])
def test_a_bad_count(refused, count):
    assert "--count" in refused("--count", count)


def test_a_drone_more_than_there_are_instances(refused):
    assert "--count 3: must be from 1 to 2" in refused("--count", 3, "--instance", 8)


def test_more_drones_than_the_arena_has_room_for(refused, tmp_path):
    small = tmp_path / "small.yaml"
    small.write_text("name: small\narena: {length_x_m: 2, width_y_m: 2}\n", encoding="utf-8")
    line = refused("--count", 9, "--scenario", small)
    assert "--count 9: small has room for 1, not for 9 drones" in line


def test_a_serial_line_serves_one_drone(refused):
    assert "--count 1" in refused("--count", 2, "--link", "serial:///dev/ttyS0:57600")


@pytest.mark.parametrize("option", ["--ground-remote", "--onboard-remote", "--video-rtp"])
def test_a_bad_port_behind_a_host(refused, option):
    assert "station:port: must be a host, or host:port" in refused(option, "station:port")


def test_an_invalid_key(refused, tmp_path):
    key = tmp_path / "key"
    assert f"--signing-key {key}: cannot be read" in refused("--signing-key", key)
    key.write_text("\n", encoding="utf-8")
    assert "64 hexadecimal digits or a passphrase" in refused("--signing-key", key)
    key.write_bytes(b"\xff\xfe\x00")
    assert "64 hexadecimal digits or a passphrase" in refused("--signing-key", key)
    key.write_text("00" * 32, encoding="utf-8")
    line = refused("--signing-key", key)
    assert "not all zero" in line
    assert "00" * 32 not in line


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("1 1 MIS_TAKEOFF_ALT up 9\n", "line 1: MIS_TAKEOFF_ALT: up is not a number"),
        ("# mine\nCOM_DL_LOSS_T 2\n", "line 2: COM_DL_LOSS_T: 2 is outside 5 to 300 s"),
    ],
)
def test_a_bad_line_of_the_parameter_file(tmp_path, capsys, text, complaint):
    path = tmp_path / "drone.params"
    path.write_text(text)
    assert run(["sim", "--instance", "6", "--parameters", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"error: {path}: {complaint}"
    assert path.read_text() == text


@pytest.mark.parametrize("seed", ["-1", "0.5", str(2**63)])
def test_a_bad_seed(refused, seed):
    assert "--seed" in refused("--seed", seed)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("gps of at 3 s", "write PART [NUMBER] KIND [SIZE] at SECONDS"),
        ("barometer off at 3 s", "the sensors ideal have no barometer"),
        ("motor 5 off at 3 s", "the drone has 4 motors"),
    ],
)
def test_a_bad_fault(refused, fault, said):
    assert said in refused("--fault", fault)
