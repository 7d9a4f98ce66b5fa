"""`framerunner doctor`: what a drone reports about itself, and what it lacks for the challenge."""

from __future__ import annotations

from contextlib import closing
from typing import Annotated

from cyclopts import Parameter

from framerunner.commands import check_range


def doctor(
    *,
    drone: Annotated[str, Parameter(help="MAVLink URL of the drone")] = "udpin://0.0.0.0:14540",
    seconds: Annotated[float, Parameter(help="how long to listen")] = 6.0,
) -> int:
    """Listen to a drone, request its data, and say in one page whether it can fly the challenge.

    Any vehicle with PX4 or ArduPilot, simulated or real. It is never armed and none of its parameters is
    changed; ArduPilot is asked for streams of messages on this link, since it sends none by itself.

    Exit code 0: it can fly, 1: something is missing, 2: bad input.

    **Examples**

        framerunner doctor

        framerunner doctor --drone udpin://0.0.0.0:14540

        framerunner doctor --drone serial:///dev/ttyUSB0:57600 --seconds 15
    """
    check_range("--seconds", seconds, 2.0, 600.0)

    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    from framerunner.doctor.checks import can_fly, examine
    from framerunner.doctor.listen import COMPONENT_ID, FIND_S, SYSTEM_ID, Record, find, listen
    from framerunner.doctor.page import print_page
    from wire.transports.vehicle_link import VehicleLink

    record = Record()
    errors = Console(stderr=True)
    bar = Progress(TextColumn("{task.description}"), BarColumn(), console=errors, transient=True)
    with closing(VehicleLink(drone, system_id=SYSTEM_ID, component_id=COMPONENT_ID)) as link, bar:
        task = bar.add_task("", total=1.0)

        def show(what: str, share: float) -> None:
            bar.update(task, description=what, completed=share)

        if not find(link, record, show):
            errors.print(
                f"no vehicle was heard on {link.url} within {FIND_S:g} s; "
                "is it running and sending to this address?",
                highlight=False,
                soft_wrap=True,
            )
            return 1
        listen(link, record, seconds, show)
    findings = examine(record)
    print_page(Console(highlight=False), link.url, record, findings)
    return 0 if can_fly(findings) else 1
