"""An ArduCopter that the user has built for SITL: found and started."""

from __future__ import annotations

import os
from pathlib import Path

from framerunner.errors import SettingError
from framerunner.vehicle.geodesy import GeodeticPoint
from sitl.ardupilot.json_interface import PORTS_AN_INSTANCE
from sitl.ardupilot.parameters import file_of
from sitl.ardupilot.relay import RELAY_PORT
from sitl.ardupilot.sensor_link import SENSOR_PORT
from sitl.autopilots.parameters import Value
from sitl.autopilots.process import AutopilotProcess
from sitl.links import UdpAddresses
from sitl.server_settings import ServerSettings

PROGRAM = "arducopter"
PARAMETER_FILE = "framerunner.parm"
_PLACES = ("", "build/sitl/bin", "bin")


def find_build(folder: Path) -> Path:
    """ArduCopter's program: in the given folder, or in ArduPilot's sources after a build for SITL.

    Raises:
        SettingError: there is none.
    """
    for place in _PLACES:
        program = folder / place / PROGRAM
        if os.access(program, os.X_OK) and program.is_file():
            return program.resolve()
    raise SettingError(
        f"--ardupilot {folder}: has no {PROGRAM}; give ArduPilot's folder after "
        "`./waf configure --board sitl` and `./waf copter`"
    )


def options(
    settings: ServerSettings,
    home: GeodeticPoint,
    defaults: str,
    *,
    takes_sensors: bool,
    relayed: bool = False,
) -> list[str]:
    """The options by which ArduCopter flies here, with MAVLink on this simulator's usual ports.

    Args:
        settings: instance, ports and speed.
        home: the scenario's origin.
        defaults: file of parameters.
        takes_sensors: the simulator sends those that come over MAVLink.
        relayed: MAVLink with the app goes through the simulator; see `sitl.ardupilot.relay`.
    """
    instance, here = settings.instance, f"udpclient:{settings.bind}"
    shift = PORTS_AN_INSTANCE * instance
    app = f"{here}:{RELAY_PORT + shift}" if relayed else _udp(settings.onboard)
    return [
        *("--model", f"JSON:{settings.bind}", "-I", str(instance), "--sysid", str(instance + 1)),
        *("--home", f"{home.latitude_deg:.9f},{home.longitude_deg:.9f},{home.altitude_m:.3f},0"),
        *("--speedup", f"{settings.speed:g}", "--defaults", defaults),
        *("--serial0", app, "--serial1", _udp(settings.ground)),
        *(("--serial2", f"{here}:{SENSOR_PORT + shift}") if takes_sensors else ()),
    ]


def _udp(link: UdpAddresses) -> str:
    """The device by which ArduPilot sends a link's telemetry."""
    assert link.remote is not None, "the simulator's default links have one"
    return f"udpclient:{link.remote[0]}:{link.remote[1]}"


class ArduPilotProcess(AutopilotProcess):
    """ArduCopter as a child process.

    Args:
        program: as `find_build` returns.
        settings: instance, ports and speed.
        home: the scenario's origin.
        parameters: for its start; in a folder that is kept, those that were changed in flight win.
        folder: where it runs and keeps parameters and logs. None: a temporary one.
        takes_sensors: the simulator sends those that come over MAVLink.
        relayed: MAVLink with the app goes through the simulator.
    """

    def __init__(
        self,
        program: Path,
        settings: ServerSettings,
        home: GeodeticPoint,
        parameters: dict[str, Value],
        folder: Path | None,
        *,
        takes_sensors: bool,
        relayed: bool = False,
    ) -> None:
        super().__init__("ArduPilot", "--ardupilot", folder, {})
        self._takes_sensors, self._relayed = takes_sensors, relayed
        self._program, self._settings, self._home = program, settings, home
        self._parameters = parameters

    def command(self) -> list[str]:
        """ArduCopter's own options."""
        (self.folder / PARAMETER_FILE).write_text(file_of(self._parameters), encoding="ascii")
        how = {"takes_sensors": self._takes_sensors, "relayed": self._relayed}
        chosen = options(self._settings, self._home, PARAMETER_FILE, **how)
        return [str(self._program), *chosen]
