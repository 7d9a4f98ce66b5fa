"""Commands that fly: arming, modes, take-off, places, circles, home, region of interest, the end."""

from __future__ import annotations

from math import copysign, floor, isfinite, isinf, isnan, nan

from firmware_py.guidance.orbit import Orbit, OrbitYaw
from firmware_py.mavlink import mission_commands
from firmware_py.mavlink.command import Command, CommandHandler
from firmware_py.mavlink.exchange import Exchange
from firmware_py.status import CommandResult, FlightMode
from firmware_py.types import GeodeticPoint
from geometry.vectors import NAN3, Vec3
from wire.dialect import mavlink

FORCE_MAGIC = 21196.0  # param2 of COMPONENT_ARM_DISARM
_STANDARD_MODES = {
    mavlink.MAV_STANDARD_MODE_POSITION_HOLD: FlightMode.POSITION,
    mavlink.MAV_STANDARD_MODE_ORBIT: FlightMode.ORBIT,
    mavlink.MAV_STANDARD_MODE_ALTITUDE_HOLD: FlightMode.ALTITUDE,
    mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY: FlightMode.RETURN,
    mavlink.MAV_STANDARD_MODE_MISSION: FlightMode.MISSION,
    mavlink.MAV_STANDARD_MODE_LAND: FlightMode.LAND,
    mavlink.MAV_STANDARD_MODE_TAKEOFF: FlightMode.TAKEOFF,
}
_MODES = {mode.value: mode for mode in FlightMode}
_WARNING = mavlink.MAV_SEVERITY_WARNING
_CRITICAL = mavlink.MAV_SEVERITY_CRITICAL
_SMALLEST_ORBIT_M = 1.0


def choose_mode(exchange: Exchange, main: int, sub: int) -> CommandResult:
    """Ask the autopilot for the mode with PX4's numbers; a mode that is not there is refused in words."""
    mode = _MODES.get((main, sub))
    if mode is None:
        exchange.autopilot.say(_WARNING, f"Mode change refused: no mode {main}.{sub} here")
        return CommandResult.TEMPORARILY_REJECTED
    return exchange.autopilot.set_mode(mode)


def set_mode(exchange: Exchange, base_mode: float, main: float, sub: float) -> CommandResult:
    """A mode change by any of the ways to ask for it; only PX4's custom modes are understood."""
    if not isfinite(base_mode) or not int(base_mode) & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
        exchange.autopilot.say(_WARNING, "Mode change refused: only PX4 custom modes are understood")
        return CommandResult.TEMPORARILY_REJECTED
    return choose_mode(exchange, _small(main), _small(sub))


def _arm_disarm(exchange: Exchange, command: Command) -> CommandResult | None:
    autopilot, wanted = exchange.autopilot, command.params[0]
    if isnan(wanted):
        return CommandResult.ACCEPTED  # PX4's odd answer: nothing happens
    action = floor(wanted + 0.5) if isfinite(wanted) else -1
    force = command.params[1] == FORCE_MAGIC
    if action == 1:
        return autopilot.arm(force=force)
    if action == 0:
        return autopilot.disarm(force=force)
    autopilot.say(_CRITICAL, f"Unsupported ARM_DISARM param: {wanted:g}")
    return None  # PX4 does not acknowledge this either


def _takeoff(exchange: Exchange, command: Command) -> CommandResult:
    if isinf(command.altitude_m):
        return CommandResult.DENIED
    return exchange.autopilot.takeoff(command.altitude_amsl_m(exchange.autopilot.status.home))


def _land(exchange: Exchange, _command: Command) -> CommandResult:
    return exchange.autopilot.land()


def _return(exchange: Exchange, _command: Command) -> CommandResult:
    return exchange.autopilot.set_mode(FlightMode.RETURN)


def _set_mode(exchange: Exchange, command: Command) -> CommandResult:
    return set_mode(exchange, *command.params[:3])


def _set_standard_mode(exchange: Exchange, command: Command) -> CommandResult:
    wanted = command.params[0]
    mode = _STANDARD_MODES.get(_small(wanted))
    if mode is None:
        exchange.autopilot.say(_WARNING, f"Mode change refused: no standard mode {wanted:g} here")
        return CommandResult.TEMPORARILY_REJECTED
    return exchange.autopilot.set_mode(mode)


def _small(number: float) -> int:
    """A mode number; what cannot be one is 0, which is no mode."""
    return int(number) if isfinite(number) and 0 <= number <= 255 else 0


def _reposition(exchange: Exchange, command: Command) -> CommandResult:
    """DO_REPOSITION: param 2 must be 1, as in PX4; what is left open stays as it is."""
    speed_m_s, flags, _, yaw_rad = command.params
    if flags != 1.0:
        return CommandResult.UNSUPPORTED
    target = _place(exchange, command, command.altitude_amsl_m(exchange.autopilot.status.home))
    if target is None:
        return CommandResult.DENIED
    return exchange.autopilot.reposition(
        target,
        yaw_rad if isfinite(yaw_rad) else nan,
        speed_m_s if isfinite(speed_m_s) and speed_m_s > 0 else nan,
    )


def _orbit(exchange: Exchange, command: Command) -> CommandResult:
    """DO_ORBIT: a negative radius turns counter-clockwise; what is left open is as PX4 has it."""
    autopilot = exchange.autopilot
    radius_m, speed_m_s, yaw, _ = command.params
    centre = _place(exchange, command, command.altitude_m)
    if centre is None:
        return CommandResult.DENIED
    radius_m = radius_m if isfinite(radius_m) and radius_m != 0.0 else _SMALLEST_ORBIT_M
    most_m = autopilot.parameters.value("MC_ORBIT_RAD_MAX")
    if not _SMALLEST_ORBIT_M <= abs(radius_m) <= most_m:
        autopilot.say(_CRITICAL, f"Orbit refused: radius {radius_m:g} m, it must be 1 to {most_m:g} m")
        return CommandResult.DENIED
    speed_m_s = speed_m_s if isfinite(speed_m_s) else 1.0
    most_m_s = autopilot.parameters.value("MPC_XY_CRUISE")
    speed_m_s = min(max(speed_m_s, -most_m_s), most_m_s)
    known = yaw in tuple(OrbitYaw)
    behaviour = OrbitYaw(int(yaw) if known else autopilot.parameters.integer("MC_ORBIT_YAW_MOD"))
    here = autopilot.state.position_ned_m
    north_m, east_m, down_m = (
        place if isnan(wanted) else wanted for wanted, place in zip(centre, here, strict=True)
    )
    return autopilot.orbit(
        Orbit((north_m, east_m, down_m), abs(radius_m), copysign(1.0, radius_m) * speed_m_s, behaviour)
    )


def _change_speed(exchange: Exchange, command: Command) -> CommandResult:
    speed_m_s = command.params[1]
    return exchange.autopilot.change_speed(speed_m_s if isfinite(speed_m_s) and speed_m_s > 0 else nan)


def _set_home(exchange: Exchange, command: Command) -> CommandResult:
    if command.params[0] > 0.5:
        return exchange.autopilot.set_home(None)
    if not command.has_place or not isfinite(command.altitude_m):
        return CommandResult.DENIED
    return exchange.autopilot.set_home(
        GeodeticPoint(command.latitude_deg, command.longitude_deg, command.altitude_m)
    )


def _set_origin(exchange: Exchange, command: Command) -> CommandResult:
    return exchange.autopilot.set_origin(
        GeodeticPoint(command.latitude_deg, command.longitude_deg, command.altitude_m)
    )


def _look_at(exchange: Exchange, command: Command) -> CommandResult:
    place = _place(exchange, command, command.altitude_m)
    if place is None or any(map(isnan, place)):
        return CommandResult.DENIED
    return exchange.autopilot.look_at(place)


def _look_ahead(exchange: Exchange, _command: Command) -> CommandResult:
    return exchange.autopilot.look_at(None)


def _look_mode(exchange: Exchange, command: Command) -> CommandResult:
    """The older DO_SET_ROI: param 1 is the mode, of which none and a place can be had."""
    mode = command.params[0]
    if mode == mavlink.MAV_ROI_NONE:
        return _look_ahead(exchange, command)
    return _look_at(exchange, command) if mode == mavlink.MAV_ROI_LOCATION else CommandResult.UNSUPPORTED


def _terminate(exchange: Exchange, command: Command) -> CommandResult:
    if not command.params[0] > 0.5 or not exchange.autopilot.status.armed:
        return CommandResult.DENIED
    return exchange.autopilot.terminate()


def _start_mission(exchange: Exchange, command: Command) -> CommandResult:
    first = command.params[0]
    return mission_commands.start(exchange, first if isfinite(first) else -1.0)


def _set_mission_item(exchange: Exchange, command: Command) -> CommandResult:
    return mission_commands.set_current(exchange, command.params[0])


def _place(exchange: Exchange, command: Command, altitude_m: float) -> Vec3 | None:
    """A command's place, NED metres with NaN for what is not given; None if it is no place on Earth.

    Args:
        exchange: of the vehicle.
        command: with latitude and longitude.
        altitude_m: above mean sea level. PX4 takes all commands so, whatever the frame. MAVSDK relies on it
            for circles and home: it names a relative frame and means an absolute altitude. Where no peer does
            so, take-off and places to fly to, the frame counts.
    """
    autopilot = exchange.autopilot
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


FLIGHT_COMMANDS: dict[int, CommandHandler] = {
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: _return,
    mavlink.MAV_CMD_NAV_LAND: _land,
    mavlink.MAV_CMD_NAV_TAKEOFF: _takeoff,
    mavlink.MAV_CMD_DO_ORBIT: _orbit,
    mavlink.MAV_CMD_NAV_ROI: _look_mode,
    mavlink.MAV_CMD_DO_SET_MODE: _set_mode,
    mavlink.MAV_CMD_DO_CHANGE_SPEED: _change_speed,
    mavlink.MAV_CMD_DO_SET_HOME: _set_home,
    mavlink.MAV_CMD_DO_FLIGHTTERMINATION: _terminate,
    mavlink.MAV_CMD_DO_REPOSITION: _reposition,
    mavlink.MAV_CMD_DO_SET_ROI_LOCATION: _look_at,
    mavlink.MAV_CMD_DO_SET_ROI_NONE: _look_ahead,
    mavlink.MAV_CMD_DO_SET_ROI: _look_mode,
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: _set_mission_item,
    mavlink.MAV_CMD_DO_SET_STANDARD_MODE: _set_standard_mode,
    mavlink.MAV_CMD_MISSION_START: _start_mission,
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: _arm_disarm,
    mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN: _set_origin,
}
