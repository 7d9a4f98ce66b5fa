"""Makes the JSBSim model of a multicopter from its declared airframe.

Forces and moments are `external_reactions` in body axes, computed by JSBSim itself from rotor speeds and
air-relative velocity, so a physics step costs no Python. JSBSim's structural axes are x aft, y right, z up.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from firmware_py.airframe import Airframe

POUNDS_PER_NEWTON = 1 / 4.4482216152605
FEET_PER_METRE = 1 / 0.3048
POUND_FEET_PER_NEWTON_METRE = POUNDS_PER_NEWTON * FEET_PER_METRE

COMMAND_PROPERTY = "fcs/motor{}/command-rad_s"
SPEED_PROPERTY = "fcs/motor{}/speed-rad_s"
TOUCH_FORCES = ("fcs/touch/force-x-n", "fcs/touch/force-y-n", "fcs/touch/force-z-n")
TOUCH_MOMENTS = ("fcs/touch/moment-roll-nm", "fcs/touch/moment-pitch-nm", "fcs/touch/moment-yaw-nm")

_AXES = ("x", "y", "z")
_UNITS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_AIR_VELOCITY_FPS = ("velocities/u-aero-fps", "velocities/v-aero-fps", "velocities/w-aero-fps")
_RATE_RAD_S = ("velocities/p-aero-rad_sec", "velocities/q-aero-rad_sec", "velocities/r-aero-rad_sec")


def airframe_xml(airframe: Airframe) -> str:
    """Return the `fdm_config` document of an airframe.

    Args:
        airframe: the declared numbers.
    """
    root = ET.Element("fdm_config", name=airframe.name, version="2.0", release="ALPHA")
    ET.SubElement(root, "fileheader")
    _metrics(root)
    _mass_balance(root, airframe)
    _ground_reactions(root, airframe)
    _motors(root, airframe)
    _external_reactions(root, airframe)
    aerodynamics = ET.SubElement(root, "aerodynamics")  # JSBSim refuses a model without its axes
    for name in ("DRAG", "SIDE", "LIFT", "ROLL", "PITCH", "YAW"):
        ET.SubElement(aerodynamics, "axis", name=name)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _value(parent: ET.Element, tag: str, content: float | str, **attributes: str) -> None:
    text = content if isinstance(content, str) else repr(float(content))
    ET.SubElement(parent, tag, attributes).text = text


def _location(parent: ET.Element, position_m: tuple[float, float, float], **attributes: str) -> None:
    location = ET.SubElement(parent, "location", attributes, unit="M")
    for axis, value in zip(_AXES, position_m, strict=True):
        _value(location, axis, value)


def _metrics(root: ET.Element) -> None:
    metrics = ET.SubElement(root, "metrics")
    _value(metrics, "wingarea", 1.0, unit="M2")
    _value(metrics, "wingspan", 1.0, unit="M")
    _value(metrics, "chord", 1.0, unit="M")
    for name in ("AERORP", "EYEPOINT", "VRP"):
        _location(metrics, (0.0, 0.0, 0.0), name=name)


def _mass_balance(root: ET.Element, airframe: Airframe) -> None:
    mass = ET.SubElement(root, "mass_balance")
    for tag, inertia in zip(("ixx", "iyy", "izz"), airframe.inertia_kg_m2, strict=True):
        _value(mass, tag, inertia, unit="KG*M2")
    _value(mass, "emptywt", airframe.mass_kg, unit="KG")
    _location(mass, (0.0, 0.0, 0.0), name="CG")


def _ground_reactions(root: ET.Element, airframe: Airframe) -> None:
    """Eight corners of the envelope touch the ground, so it may also lie on its back."""
    ground = ET.SubElement(root, "ground_reactions")
    length, width, height = (extent / 2 for extent in airframe.envelope_m)
    contact = airframe.contact
    corners = [(x, y, z) for z in (-height, height) for x in (-length, length) for y in (-width, width)]
    for index, (x, y, z) in enumerate(corners):
        point = ET.SubElement(ground, "contact", type="STRUCTURE", name=f"CORNER{index}")
        _location(point, (x, y, z))
        _value(point, "static_friction", contact.friction)
        _value(point, "dynamic_friction", contact.friction)
        _value(point, "spring_coeff", contact.stiffness_n_m, unit="N/M")
        _value(point, "damping_coeff", contact.damping_n_s_m, unit="N/M/SEC")


def _motors(root: ET.Element, airframe: Airframe) -> None:
    system = ET.SubElement(root, "system", name="motors")
    for name in (*TOUCH_FORCES, *TOUCH_MOMENTS):
        _value(system, "property", name, value="0.0")
    channel = ET.SubElement(system, "channel", name="motors")
    lag_s = airframe.motor.time_constant_s
    for index in range(len(airframe.rotors)):
        command, speed = COMMAND_PROPERTY.format(index), SPEED_PROPERTY.format(index)
        _value(system, "property", command, value="0.0")
        tag, gain = ("lag_filter", ("c1", 1 / lag_s)) if lag_s > 0 else ("pure_gain", ("gain", 1.0))
        component = ET.SubElement(channel, tag, name=speed)
        _value(component, "input", command)
        _value(component, *gain)
        _value(component, "output", speed)


def _product(parent: ET.Element, factor: float, *properties: str, magnitude_of: str | None = None) -> None:
    product = ET.SubElement(parent, "product")
    _value(product, "value", factor)
    for name in properties:
        _value(product, "property", name)
    if magnitude_of is not None:
        _value(ET.SubElement(product, "abs"), "property", magnitude_of)


def _reaction(
    parent: ET.Element,
    name: str,
    direction: tuple[float, float, float],
    at_m: tuple[float, float, float] | None,
) -> ET.Element:
    """Add a force at a structural position, or a moment (no position); returns its `function` element.

    Args:
        parent: the `external_reactions` element.
        name: of the reaction.
        direction: unit vector in body FRD.
        at_m: in structural axes.
    """
    reaction = ET.SubElement(parent, "moment" if at_m is None else "force", name=name, frame="BODY")
    function = ET.SubElement(reaction, "function")
    if at_m is not None:
        _location(reaction, at_m)
    element = ET.SubElement(reaction, "direction")
    for letter, value in zip(_AXES, direction, strict=True):
        _value(element, letter, value)
    return function


def _external_reactions(root: ET.Element, airframe: Airframe) -> None:
    reactions = ET.SubElement(root, "external_reactions")
    motor = airframe.motor
    for index, rotor in enumerate(airframe.rotors):
        speed = SPEED_PROPERTY.format(index)
        forward, right, down = rotor.position_frd_m
        function = _reaction(reactions, f"rotor{index}", (0.0, 0.0, -1.0), (-forward, right, -down))
        _product(function, motor.thrust_n_s2 * POUNDS_PER_NEWTON, speed, speed)

    for axis, letter in enumerate(_AXES):
        function = _reaction(reactions, f"body-{letter}", _UNITS[axis], (0.0, 0.0, 0.0))
        total = ET.SubElement(function, "sum")
        drag = -airframe.drag.force_n_s2_m2[axis] * POUNDS_PER_NEWTON / FEET_PER_METRE**2
        _product(total, drag, _AIR_VELOCITY_FPS[axis], magnitude_of=_AIR_VELOCITY_FPS[axis])
        _product(total, POUNDS_PER_NEWTON, TOUCH_FORCES[axis])

    for axis, letter in enumerate(_AXES):
        function = _reaction(reactions, f"body-moment-{letter}", _UNITS[axis], None)
        total = ET.SubElement(function, "sum")
        drag = -airframe.drag.moment_nm_s2[axis] * POUND_FEET_PER_NEWTON_METRE
        _product(total, drag, _RATE_RAD_S[axis], magnitude_of=_RATE_RAD_S[axis])
        _product(total, POUND_FEET_PER_NEWTON_METRE, TOUCH_MOMENTS[axis])
        if axis == 2:
            for index, rotor in enumerate(airframe.rotors):
                speed = SPEED_PROPERTY.format(index)
                torque = rotor.yaw_sign * motor.torque_nm_s2 * POUND_FEET_PER_NEWTON_METRE
                _product(total, torque, speed, speed)
