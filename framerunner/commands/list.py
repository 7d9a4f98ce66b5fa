"""`framerunner list`: what is installed, by kind."""

from __future__ import annotations

from collections.abc import Callable

from framerunner.files.extensions import KINDS, Kind, extensions


def list_() -> int:
    """List what is installed by kind: what comes with framerunner, and what other packages add to it.

    **Example**

        framerunner list
    """
    for kind in KINDS:
        own = _own_names(kind)
        rows = [(name, "framerunner") for name in own]
        for each in extensions(kind):
            hidden = "; not used: framerunner has one of this name" if each.name in own else ""
            rows.append((each.name, f"{each.package} {each.version}{hidden}"))
        print(kind if kind.endswith("s") else f"{kind}s")
        for name, origin in rows:
            print(f"  {name:24s} {origin}")
    return 0


def _own_names(kind: Kind) -> list[str]:
    """Names that no other package can have."""
    from framerunner.vehicle.airframe import AIRFRAME_FILES
    from offboard.mission import own_missions
    from scenarios.random_scenarios import LEVEL_FILES
    from sitl.sensors.suite import SUITE_FILES
    from vision.detectors import OWN_DETECTORS

    own: dict[Kind, Callable[[], list[str]]] = {
        "mission": own_missions,
        "pilot": list,
        "detector": lambda: list(OWN_DETECTORS),
        "level": LEVEL_FILES.own_names,
        "airframe": AIRFRAME_FILES.own_names,
        "sensors": SUITE_FILES.own_names,
    }
    return own[kind]()
