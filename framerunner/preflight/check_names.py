"""The names of all checks before arming, so that one that is misspelt is found before any check is run."""

from __future__ import annotations

from typing import get_args

from framerunner.doctor.subjects import CAMERA_SUBJECTS, Subject
from offboard.safety.failsafes import DOCUMENTS, failsafe_rows

_FAILSAFES = tuple(name for autopilot in DOCUMENTS for row in failsafe_rows(autopilot) for name in row.names)

REPLACED = frozenset(
    # Findings of the doctor that checks with a limit replace.
    (
        *("battery", "link", "innovations", "setpoints lost", "ground station lost", "battery low", "fence"),
        *_FAILSAFES,
    )
)
RENAMED = {"estimator": "estimator settings"}
"""Findings of the doctor whose name is that of a check with a limit."""
_OWN = ("battery", "estimator", "link loss", "link latency", *CAMERA_SUBJECTS)
_OF_RUN = ("failsafes", "fence", "caps")

CHECK_NAMES = frozenset(
    (
        *(RENAMED.get(each, each) for each in get_args(Subject) if each not in REPLACED),
        *_FAILSAFES,
        *_OWN,
        *_OF_RUN,
    )
)
"""All names that `--accept` takes, of each autopilot."""
