"""Commands for flight: arming, modes, take-off, positions, orbits, home, region of interest, termination."""

from __future__ import annotations

from collections.abc import Callable
from math import copysign, floor, isfinite, isinf, isnan, nan

from firmware_py.autopilot import Autopilot
from firmware_py.guidance.orbit import Orbit, OrbitYaw
from firmware_py.mavlink.service import Service, VehicleCommand
from firmware_py.status import CommandResult, FlightMode
from framerunner.geometry.vectors import NAN3, Vec3
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire.dialect import mavlink

FORCE_MAGIC = 21196.0  # param2 of COMPONENT_ARM_DISARM
_STANDARD_MODES = {mode.value.standard: mode for mode in FlightMode if mode.value.standard}
_MODES = {(mode.value.main, mode.value.sub): mode for mode in FlightMode}
_WARNING = mavlink.MAV_SEVERITY_WARNING
_CRITICAL = mavlink.MAV_SEVERITY_CRITICAL
_MIN_ORBIT_M = 1.0


class FlightCommands(Service):
    """Passes these commands to the autopilot; regions of interest to `look_at` too."""

    def __init__(self, autopilot: Autopilot, look_at: Callable[[Vec3 | None], None]) -> None:
        self._autopilot = autopilot
        self._gimbal_look_at = look_at
        self.commands = {
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda _command: autopilot.set_mode(FlightMode.RETURN),
            mavlink.MAV_CMD_NAV_LAND: lambda _command: autopilot.land(),
            mavlink.MAV_CMD_NAV_TAKEOFF: self._takeoff,
            mavlink.MAV_CMD_DO_ORBIT: self._orbit,
            mavlink.MAV_CMD_NAV_ROI: self._set_roi,
            mavlink.MAV_CMD_DO_SET_MODE: self._set_mode,
            mavlink.MAV_CMD_DO_CHANGE_SPEED: self._change_speed,
            mavlink.MAV_CMD_DO_SET_HOME: self._set_home,
            mavlink.MAV_CMD_DO_FLIGHTTERMINATION: self._terminate,
            mavlink.MAV_CMD_DO_REPOSITION: self._reposition,
            mavlink.MAV_CMD_DO_SET_ROI_LOCATION: self._set_roi_location,
            mavlink.MAV_CMD_DO_SET_ROI_NONE: lambda _command: self._look_at(None),
            mavlink.MAV_CMD_DO_SET_ROI: self._set_roi,
            mavlink.MAV_CMD_DO_SET_STANDARD_MODE: self._set_standard_mode,
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_disarm,
        }

    def _arm_disarm(self, command: VehicleCommand) -> CommandResult | None:
        autopilot, requested = self._autopilot, command.params[0]
        if isnan(requested):
            return CommandResult.ACCEPTED  # as PX4, which does nothing
        action = floor(requested + 0.5) if isfinite(requested) else -1
        force = command.params[1] == FORCE_MAGIC
        if action == 1:
            return autopilot.arm(force=force)
        if action == 0:
            return autopilot.disarm(force=force)
        autopilot.say(_CRITICAL, f"Unsupported ARM_DISARM param: {requested:g}")
        return None  # PX4 does not acknowledge this either

    def _takeoff(self, command: VehicleCommand) -> CommandResult:
        if isinf(command.altitude_m):
            return CommandResult.DENIED
        return self._autopilot.takeoff(command.altitude_amsl_m(self._autopilot.status.home))

    def _set_mode(self, command: VehicleCommand) -> CommandResult:
        """DO_SET_MODE: only PX4's custom modes are accepted; an unknown mode is refused with a text."""
        base_mode, main, sub, _ = command.params
        if not isfinite(base_mode) or not int(base_mode) & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            self._autopilot.say(_WARNING, "Mode change refused: only PX4 custom modes are understood")
            return CommandResult.TEMPORARILY_REJECTED
        numbers = (_small(main), _small(sub))
        mode = _MODES.get(numbers)
        if mode is None:
            self._autopilot.say(_WARNING, f"Mode change refused: no mode {numbers[0]}.{numbers[1]} here")
            return CommandResult.TEMPORARILY_REJECTED
        return self._autopilot.set_mode(mode)

    def _set_standard_mode(self, command: VehicleCommand) -> CommandResult:
        number = command.params[0]
        mode = _STANDARD_MODES.get(_small(number))
        if mode is None:
            self._autopilot.say(_WARNING, f"Mode change refused: no standard mode {number:g} here")
            return CommandResult.TEMPORARILY_REJECTED
        return self._autopilot.set_mode(mode)

    def _reposition(self, command: VehicleCommand) -> CommandResult:
        """DO_REPOSITION: param 2 must be 1, as in PX4; params that are not given stay as they are."""
        speed_m_s, flags, _, yaw_rad = command.params
        if flags != 1.0:
            return CommandResult.UNSUPPORTED
        target = self._place(command, command.altitude_amsl_m(self._autopilot.status.home))
        if target is None:
            return CommandResult.DENIED
        return self._autopilot.reposition(
            target,
            yaw_rad if isfinite(yaw_rad) else nan,
            speed_m_s if isfinite(speed_m_s) and speed_m_s > 0 else nan,
        )

    def _orbit(self, command: VehicleCommand) -> CommandResult:
        """DO_ORBIT: a negative radius means counter-clockwise; params not given have PX4's defaults."""
        autopilot = self._autopilot
        radius_m, speed_m_s, yaw, _ = command.params
        centre = self._place(command, command.altitude_m)
        if centre is None:
            return CommandResult.DENIED
        radius_m = radius_m if isfinite(radius_m) and radius_m != 0.0 else _MIN_ORBIT_M
        max_m = autopilot.parameters.value("MC_ORBIT_RAD_MAX")
        if not _MIN_ORBIT_M <= abs(radius_m) <= max_m:
            autopilot.say(_CRITICAL, f"Orbit refused: radius {radius_m:g} m, it must be 1 to {max_m:g} m")
            return CommandResult.DENIED
        speed_m_s = speed_m_s if isfinite(speed_m_s) else 1.0
        max_m_s = autopilot.parameters.value("MPC_XY_CRUISE")
        speed_m_s = min(max(speed_m_s, -max_m_s), max_m_s)
        known = yaw in tuple(OrbitYaw)
        behaviour = OrbitYaw(int(yaw) if known else autopilot.parameters.integer("MC_ORBIT_YAW_MOD"))
        here = autopilot.state.position_ned_m
        north_m, east_m, down_m = (
            present if isnan(given) else given for given, present in zip(centre, here, strict=True)
        )
        return autopilot.orbit(
            Orbit((north_m, east_m, down_m), abs(radius_m), copysign(1.0, radius_m) * speed_m_s, behaviour)
        )

    def _change_speed(self, command: VehicleCommand) -> CommandResult:
        speed_m_s = command.params[1]
        return self._autopilot.change_speed(speed_m_s if isfinite(speed_m_s) and speed_m_s > 0 else nan)

    def _set_home(self, command: VehicleCommand) -> CommandResult:
        if command.params[0] > 0.5:
            return self._autopilot.set_home(None)
        if not command.has_place or not isfinite(command.altitude_m):
            return CommandResult.DENIED
        return self._autopilot.set_home(
            GeodeticPoint(command.latitude_deg, command.longitude_deg, command.altitude_m)
        )

    def _set_roi_location(self, command: VehicleCommand) -> CommandResult:
        place = self._place(command, command.altitude_m)
        if place is None or any(map(isnan, place)):
            return CommandResult.DENIED
        return self._look_at(place)

    def _look_at(self, point_ned_m: Vec3 | None) -> CommandResult:
        """Set the region of interest, for the vehicle's yaw and, if there is one, for the gimbal."""
        self._gimbal_look_at(point_ned_m)
        return self._autopilot.look_at(point_ned_m)

    def _set_roi(self, command: VehicleCommand) -> CommandResult:
        """The older DO_SET_ROI: param 1 is the mode, of which NONE and LOCATION are supported."""
        mode = command.params[0]
        if mode == mavlink.MAV_ROI_NONE:
            return self._look_at(None)
        if mode == mavlink.MAV_ROI_LOCATION:
            return self._set_roi_location(command)
        return CommandResult.UNSUPPORTED

    def _terminate(self, command: VehicleCommand) -> CommandResult:
        if not command.params[0] > 0.5 or not self._autopilot.status.armed:
            return CommandResult.DENIED
        return self._autopilot.terminate()

    def _place(self, command: VehicleCommand, altitude_m: float) -> Vec3 | None:
        """A command's position, NED metres with NaN where not given; None if it is not on Earth.

        Args:
            command: with latitude and longitude.
            altitude_m: above mean sea level. PX4 ignores the frame of all commands. MAVSDK relies on it for
                orbits and home: it sends a relative frame with an absolute altitude. Take-off and reposition,
                for which no peer does so, respect the frame.
        """
        autopilot = self._autopilot
        here = autopilot.global_position()
        if here is None:
            return None
        if isnan(command.latitude_deg) and isnan(command.longitude_deg) and isnan(command.altitude_m):
            return NAN3
        local = autopilot.local_position(
            GeodeticPoint(
                command.latitude_deg if command.has_place else here.latitude_deg,
                command.longitude_deg if command.has_place else here.longitude_deg,
                here.altitude_m if isnan(altitude_m) else altitude_m,
            )
        )
        if local is None:
            return None
        north_m, east_m, down_m = local
        return (
            north_m if command.has_place else nan,
            east_m if command.has_place else nan,
            nan if isnan(altitude_m) else down_m,
        )


def _small(number: float) -> int:
    """A mode number; 0, which is no mode, if it is invalid."""
    return int(number) if isfinite(number) and 0 <= number <= 255 else 0
