"""The visit: find the drone, listen, ask, for some seconds of wall time."""

from __future__ import annotations

import time
from collections.abc import Callable

from framerunner.doctor.questions import open_questions, prearm_question, station_heartbeat
from framerunner.doctor.record import Record
from wire.transports.vehicle_link import VehicleLink, companion_heartbeat

SYSTEM_ID = 247
COMPONENT_ID = 190
FIND_S = 10.0
_ASK_AGAIN_S = 1.0
_QUESTION_GAP_S = 0.02  # a serial line should not choke on questions
_PREARM_S = 0.5
_PREARM_AGAIN_S = 2.0  # while no report of its arming checks has come

Progress = Callable[[str, float], None]


def find(link: VehicleLink, record: Record, progress: Progress) -> bool:
    """Wait for a vehicle's heartbeat.

    Args:
        link: on which to listen.
        record: takes what is heard.
        progress: called with what is done and how far, 0 to 1.

    Returns:
        Whether one was found within ten seconds.
    """
    began_s = time.monotonic()
    beat_s = -1.0
    while (now_s := time.monotonic()) - began_s < FIND_S:
        if now_s - beat_s >= 1.0:
            beat_s = now_s
            link.send(companion_heartbeat())  # over udpout the vehicle does not know us before
        progress("looking for a vehicle", (now_s - began_s) / FIND_S)
        _hear(link, record)
        if record.system_id is not None:
            return True
    return False


def listen(link: VehicleLink, record: Record, seconds: float, progress: Progress) -> None:
    """Hear and ask.

    While the vehicle is disarmed this speaks as a ground station, since PX4 tells its reasons to no one
    else. To an armed one it does not: when it leaves, that would be a lost ground station to the vehicle.

    Args:
        link: to the vehicle.
        record: of it, which knows its system id.
        seconds: how long.
        progress: called with what is done and how far, 0 to 1.
    """
    began_s = time.monotonic()
    beat_s = asked_s = -10.0
    prearm_s = began_s + _PREARM_S
    questions = open_questions(record)
    question_s = began_s
    while (now_s := time.monotonic()) - began_s < seconds:
        progress("listening and asking", (now_s - began_s) / seconds)
        if now_s - beat_s >= 1.0:
            beat_s = now_s
            link.send(companion_heartbeat() if record.armed else station_heartbeat())
        if now_s > prearm_s and not record.armed and record.arming.armable_modes is None:
            prearm_s = now_s + _PREARM_AGAIN_S
            link.send(prearm_question(record))
        if now_s - question_s >= _QUESTION_GAP_S:
            question_s = now_s
            question = next(questions, None)
            if question is not None:
                asked_s = now_s
                link.send(question)
            elif now_s - asked_s >= _ASK_AGAIN_S:
                questions = open_questions(record)
        _hear(link, record)


def _hear(link: VehicleLink, record: Record) -> None:
    messages = link.receive(0.02)
    now_s = time.monotonic()
    for message in messages:
        record.take(message, now_s)
