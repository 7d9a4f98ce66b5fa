import pytest

from framerunner.cli import run


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("1 1 MIS_TAKEOFF_ALT up 9\n", "line 1: MIS_TAKEOFF_ALT: up is not a number"),
        ("# mine\nCOM_DL_LOSS_T 2\n", "line 2: COM_DL_LOSS_T: 2 is outside 5 to 300 s"),
    ],
)
def test_a_wrong_line_of_the_file_ends_the_command_in_one_line(tmp_path, capsys, text, complaint):
    path = tmp_path / "drone.params"
    path.write_text(text)
    assert run(["sim", "--instance", "6", "--parameters", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"error: {path}: {complaint}"
    assert path.read_text() == text
