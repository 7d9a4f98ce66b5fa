"""Flight logs in PX4's ULog format: what pyulog, Flight Review and PlotJuggler read."""

from firmware_py.ulog.recorder import UlogRecorder

__all__ = ["UlogRecorder"]
