"""`framerunner scenario markers`: pages that are true to size, and can be read."""

import re

import cv2
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from framerunner.cli import run
from framerunner.geometry.marker_cells import marker_dictionary
from framerunner.runs.marker_sheets import marker_sheets
from scenarios.models import Base, BaseMarker, Scenario

PX_PER_MM = 4.0


@pytest.mark.parametrize(("family", "edge_mm"), [("aruco_4x4", 140), ("apriltag_36h11", 300)])
def test_pages_show_the_markers_true_to_size(family, edge_mm):
    marker = BaseMarker(family=family, first=3, edge_m=edge_mm / 1000)
    detector = cv2.aruco.ArucoDetector(marker_dictionary(marker.markers.family))
    numbers = []
    for page in marker_sheets(Scenario(name="marked", base=Base(marker=marker))):
        page.set_dpi(25.4 * PX_PER_MM)
        canvas = FigureCanvasAgg(page)
        canvas.draw()
        found, seen, _ = detector.detectMarkers(np.asarray(canvas.buffer_rgba())[..., 0].copy())
        (corners,) = (each.reshape(4, 2) for each in found)
        numbers += seen.ravel().tolist()
        sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        assert sides / PX_PER_MM == pytest.approx(edge_mm, abs=1.0)
    assert numbers == [3, 4, 5, 6, 7]


def test_the_file_has_pages_of_a_paper_that_is_large_enough(tmp_path, capsys):
    scenario, out = tmp_path / "my.yaml", tmp_path / "sheets.pdf"
    scenario.write_text("name: my\nbase: {marker: {edge_m: 0.2}}\n")
    command = ["scenario", "markers", str(scenario), "--out", str(out)]
    assert run(command) == 0
    boxes = re.findall(rb"/MediaBox \[ ?([\d. ]+) ?\]", out.read_bytes())
    assert len(boxes) == 5
    a3_mm = np.array([float(each) for each in boxes[0].split()][2:]) / 72 * 25.4
    assert a3_mm == pytest.approx([297, 420], abs=0.1)
    assert run(command) == 2
    assert "is there already" in capsys.readouterr().err


def test_a_base_without_markers_is_named(tmp_path, capsys):
    assert run(["scenario", "markers", "test-case-1", "--out", str(tmp_path / "none.pdf")]) == 2
    assert "its base has no markers" in capsys.readouterr().err
    assert not (tmp_path / "none.pdf").exists()


@pytest.mark.parametrize(
    ("marker", "said"),
    [("{edge_m: 0.4}", "0.375 or less"), ("{first: 46}", "use 45 or less"), ("{family: qr}", "family")],
)
def test_markers_that_cannot_be_on_the_base_are_refused(tmp_path, capsys, marker, said):
    (tmp_path / "my.yaml").write_text(f"name: my\nbase: {{marker: {marker}}}\n")
    assert run(["scenario", "check", str(tmp_path / "my.yaml")]) == 2
    assert said in capsys.readouterr().err
