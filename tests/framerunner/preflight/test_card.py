from datetime import UTC, datetime
from pathlib import Path

import pytest

from framerunner.preflight.card import HTML_NAME, PDF_NAME, make_card, write_card
from framerunner.preflight.run import ParameterChange, PreflightReport, PreflightSettings
from offboard.safety.check import Check, Outcome
from offboard.safety.fence import flight_fence
from offboard.safety.rules import SafetyRules

NOW = datetime(2026, 11, 24, 9, 30, tzinfo=UTC)


@pytest.fixture
def card(plan):
    checks = (
        Check("battery", Outcome.PASS, "88 %", "40 % or more"),
        Check("fence", Outcome.ACCEPTED, "no answer", "4 corners", "fly inside a net"),
        Check("camera", Outcome.NOTE, "<b>odd</b> & 'quoted'"),
    )
    report = PreflightReport(
        "PX4, quadrotor, system 1",
        1,
        checks,
        flight_fence(plan.box, plan.start_pose[:3]),
        (ParameterChange("NAV_RCL_ACT", 2.0, 3.0),),
        Path("parameters-before.params"),
    )
    settings = PreflightSettings("udpin://0.0.0.0:14540", "rtsp://10.0.0.2/1")
    return make_card(
        plan, settings, report, safety=SafetyRules("land"), operator="Ada", kind="flight", now=NOW
    )


def test_the_card_has_all_that_matters(card, tmp_path):
    write_card(card, tmp_path)
    page = (tmp_path / HTML_NAME).read_text(encoding="utf-8")
    for words in (
        *("Ada", "2026-11-24 09:30 UTC", "PX4, quadrotor, system 1", "explorer_soft_landing", "test-case-1"),
        *("2 m/s level", "(-6.3, -6.3)", "NAV_RCL_ACT", "parameters-before.params", "SPACE", "88 %"),
        "Failed checks that the operator accepts",
    ):
        assert words in page, words
    assert "<b>odd" not in page
    assert "<script" not in page


def test_the_card_is_a_pdf_too(card, tmp_path):
    write_card(card, tmp_path)
    data = (tmp_path / PDF_NAME).read_bytes()
    assert data.startswith(b"%PDF-")
    assert data.count(b"/Type /Page\n") + data.count(b"/Type /Page ") >= 1


def test_a_card_that_cannot_be_written_is_a_warning(card, tmp_path, capsys):
    write_card(card, tmp_path / "nowhere")
    assert capsys.readouterr().err.count("warning: cannot write") == 2
