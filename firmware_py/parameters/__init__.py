"""Parameters as data: one declaration makes MAVLink's list, errors, metadata and the reference page.

Names, units, defaults and meanings are PX4's (v1.17, as its SITL has them) wherever PX4 has such a parameter.
One difference, on purpose: PX4 accepts any value of the right type; here a value out of range or not finite
is refused and the old one stays, so that what a ground station reads back is always what is flown.
"""

from firmware_py.parameters.declarations import DECLARATIONS
from firmware_py.parameters.model import Parameter, ParameterError, ParameterKind
from firmware_py.parameters.store import Parameters

__all__ = ["DECLARATIONS", "Parameter", "ParameterError", "ParameterKind", "Parameters"]
