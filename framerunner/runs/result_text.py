"""A flight's result in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def result_lines(result: Mapping[str, Any]) -> str:
    """A result in two lines for people.

    Args:
        result: as in `result.json`.

    Raises:
        KeyError, TypeError, ValueError: it is not such a result.
    """
    error_m = result["landing_error_m"]
    landing = "did not land" if error_m is None else f"landed {100 * error_m:.1f} cm from the base's centre"
    verdict, reason = str(result["verdict"]), str(result["reason"])
    said = reason if reason.startswith(verdict) else f"{verdict}: {reason}"
    kept_s = result.get("kept_in_box_s", 0.0)
    kept = f", kept in its box for {kept_s:.1f} s" if kept_s else ""
    return (
        f"{said}\n"
        f"try {result['try_time_s']:.1f} s, penalty {result['penalty_s']:.1f} s, "
        f"path {result['path_length_m']:.1f} m, {landing}, judged by {result['judged_by']}{kept}"
    )


def timing_line(result: Mapping[str, Any]) -> str:
    """One line for people if the machine did not keep up; empty if it did, or nothing is known.

    Args:
        result: as in `result.json`.
    """
    timing = result.get("timing")
    if timing is None or timing["kept_up"]:
        return ""
    late = ", ".join(
        f"{timing[key]} {what}"
        for key, what in (
            ("late_ticks", "ticks"),
            ("late_images", "images"),
            ("late_setpoints", "setpoints"),
        )
        if timing[key]
    )
    if late:
        return (
            f"the machine did not keep up: {late} came late (oldest image {timing['oldest_image_s']:.2f} s); "
            "the flight may differ from one on a free machine"
        )
    return (
        f"the machine did not keep up: vehicle time ran at {timing['speed']:.2f} of the wanted speed; "
        "it waited for the app, so the flight is the same as on a free machine"
    )
