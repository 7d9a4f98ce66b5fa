"""Parameters as data: MAVLink's list, errors, metadata and the reference page follow from one declaration.

Names, units, defaults and meanings are PX4's (v1.17, as its SITL has them) wherever PX4 has such a parameter.
One intended difference: PX4 accepts any value of the right type; here a value out of range or not finite is
refused and the old one kept, so that a ground station always reads back the value that is used.
"""

from firmware_py.parameters.declarations import DECLARATIONS, Parameter, ParameterError
from firmware_py.parameters.store import Parameters

__all__ = ["DECLARATIONS", "Parameter", "ParameterError", "Parameters"]
