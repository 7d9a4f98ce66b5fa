"""How well a drone knows where it is: by which sensors, and how accurately by its own account.

PX4's ESTIMATOR_STATUS tells what is in use. Parameters tell only what was wished for.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

from framerunner.doctor import names
from framerunner.doctor.findings import Finding, Level
from framerunner.doctor.record import Record
from wire.dialect import Message, mavlink

ACCURATE_M = 0.1  # standard deviation; PX4 with GPS says 0.3, with motion capture 0.01
WANDER_M = 0.1
_GUIDE = "docs/real-drone.md, section 3"
_EV_POSITION, _EV_HEIGHT = 1, 2  # bits of EKF2_EV_CTRL
_SLOW_ESTIMATOR = (
    # name, more than this is too much, unit
    ("EKF2_EVP_NOISE", 0.05, "m"),
    ("EKF2_EVV_NOISE", 0.05, "m/s"),
    ("EKF2_DELAY_MAX", 50.0, "ms"),
    ("EKF2_TAU_POS", 0.15, "s"),
    ("EKF2_TAU_VEL", 0.15, "s"),
)


def check_position(record: Record) -> Iterator[Finding]:
    """Something tells the drone its place, to within a part of a frame's opening."""
    status = record.latest.get("ESTIMATOR_STATUS")
    if status is None:
        yield Finding(Level.NOTE, "position", "it does not say what its estimate is made from")
        return
    if not status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_REL:
        yield Finding(
            Level.MISSING, "position", "no sensor tells the drone where it is", _position_mend(record)
        )
        return
    source, accuracy_m = _position_source(record, status), status.pos_horiz_accuracy
    if accuracy_m <= ACCURATE_M:
        yield Finding(Level.GOOD, "position", f"by {source}, estimated accuracy {accuracy_m:.2f} m")
        return
    accuracy = f"estimated accuracy {accuracy_m:.1f} m" if isfinite(accuracy_m) else "unknown accuracy"
    text = f"by {source}, {accuracy}: the drone will stray; a frame's opening is 0.38 m wide"
    yield Finding(Level.MISSING, "position", text, _position_mend(record))


def check_height(record: Record) -> Iterator[Finding]:
    """The height comes from something better than air pressure or GPS."""
    status, parameters = record.latest.get("ESTIMATOR_STATUS"), record.parameters
    if status is None:
        return
    reference = parameters.get("EKF2_HGT_REF")
    if not status.flags & mavlink.ESTIMATOR_POS_VERT_ABS:
        yield Finding(Level.MISSING, "height", "no sensor tells the drone its height", f"see {_GUIDE}")
        return
    accuracy_m = status.pos_vert_accuracy
    accuracy = f"estimated accuracy {accuracy_m:.2f} m"
    if reference is None:
        fine = accuracy_m <= ACCURATE_M
        mend = "" if fine else f"take height from vision or a range finder: {_GUIDE}"
        yield Finding(Level.GOOD if fine else Level.MISSING, "height", accuracy, mend)
        return
    wished = names.HEIGHT_SOURCE.get(int(reference), "unknown means")
    source = _height_source(record, status, wished)
    if source in ("vision", "range finder") and accuracy_m <= ACCURATE_M:
        yield Finding(Level.GOOD, "height", f"by {source}, {accuracy}")
        return
    but = "" if source == wished else f", though EKF2_HGT_REF asks for {wished}"
    text = f"by {source}{but}, {accuracy}; in flight it wanders, and a frame's opening is 0.18 m high"
    yield Finding(Level.MISSING, "height", text, _height_mend(record, wished))


def check_vision_settings(record: Record) -> Iterator[Finding]:
    """With vision: the estimate follows it closely."""
    status = record.latest.get("ESTIMATOR_STATUS")
    if status is None or not _vision_in_use(record, status):
        return
    slow = [
        f"{name} {record.parameters[name]:g} {unit}"
        for name, limit, unit in _SLOW_ESTIMATOR
        if record.parameters.get(name, 0.0) > limit
    ]
    if slow:
        text = f"follows vision too slowly for the frames: {', '.join(slow)}"
        mend = "set what docs/real-drone.md, section 7.3, advises, then restart the drone"
        yield Finding(Level.MISSING, "estimator", text, mend)


def check_still(record: Record) -> Iterator[Finding]:
    """The position stays where the drone stands."""
    if not record.places or record.armed:
        return
    wander_m = record.wander_m
    if wander_m > WANDER_M:
        text = f"wanders {wander_m:.2f} m while it stands; a frame's opening is 0.18 m high"
        yield Finding(Level.NOTE, "estimate", text, f"see {_GUIDE}")
    else:
        yield Finding(Level.GOOD, "estimate", f"still within {wander_m:.2f} m")


def _position_mend(record: Record) -> str:
    if int(record.parameters.get("EKF2_EV_CTRL", 0)) & _EV_POSITION:
        return (
            "EKF2_EV_CTRL asks for vision, but none is used: send ODOMETRY with estimator type VISION (not "
            f"MOCAP), or VISION_POSITION_ESTIMATE, at 50 Hz: {_GUIDE}"
        )
    return f"give it its position by motion capture or visual odometry: {_GUIDE}"


def _height_mend(record: Record, wished: str) -> str:
    if wished != "vision":
        return f"take height from vision (EKF2_HGT_REF 3) or a range finder (2): {_GUIDE}"
    if not int(record.parameters.get("EKF2_EV_CTRL", 0)) & _EV_HEIGHT:
        return f"set EKF2_EV_CTRL to 15: {_GUIDE}"
    return "as for the position"


def _vision_in_use(record: Record, status: Message) -> bool:
    """Whether external vision is what the position is made from, as far as flags and accuracy can tell."""
    asked = int(record.parameters.get("EKF2_EV_CTRL", 0)) & _EV_POSITION
    aided = status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_REL
    return bool(asked and aided and status.pos_horiz_accuracy <= ACCURATE_M)


def _position_source(record: Record, status: Message) -> str:
    sources = []
    if status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS:
        sources.append("GPS")
    if _vision_in_use(record, status):
        sources.append("vision")
    return " and ".join(sources) or "optical flow or another relative sensor"


def _height_source(record: Record, status: Message, wished: str) -> str:
    """Where the height comes from: PX4 turns to the barometer when its reference is not there."""
    parameters = record.parameters
    there = {
        "barometer": True,
        "GPS": bool(status.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS),
        "range finder": bool(parameters.get("EKF2_RNG_CTRL", 1.0)) and "DISTANCE_SENSOR" in record.counts,
        "vision": _vision_in_use(record, status) and bool(int(parameters["EKF2_EV_CTRL"]) & _EV_HEIGHT),
    }
    return wished if there.get(wished) else "barometer"
