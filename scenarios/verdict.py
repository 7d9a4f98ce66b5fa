"""The verdict on a try: one of a few names, and a sentence with the reason."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from scenarios.touchdown import Landing


class Verdict(StrEnum):
    """What a try was worth, best first; a referee never returns `error`."""

    CLEAN = "clean"
    COMPLETED = "completed"
    TIMED_OUT = "timed out"
    CRASHED = "crashed"
    ABORTED = "aborted"
    WRONG_ORDER = "wrong order"
    ERROR = "error"
    """In evaluations: a fault of the program, not of the drone, ended the flight."""


@dataclass(frozen=True, slots=True)
class TryFacts:
    """What the referee saw."""

    expected: tuple[str, ...]  # colours to cross, in order
    crossed: tuple[str, ...]  # colours crossed, each once, in order of its first crossing
    contact_frames: tuple[str, ...]  # what was touched at each contact
    missed_goal: str  # the first of the scenario's goals that is not reached, in words, or ""
    outside_s: float
    try_time_s: float  # motors on to motors off, or to now
    began: bool  # the motors were on
    taken_off: bool
    motors_on: bool  # now
    settled: bool  # the motors are off and the drone is at rest
    timed_out: bool  # the try exceeded its limit
    wrong_order: str  # which gate was crossed too early, or ""
    crash: str  # what happened to the drone, or ""
    landing: Landing | None  # where it came to rest after a flight


def judge(facts: TryFacts, mission_state: str = "", ended: str | None = None) -> tuple[Verdict, str]:
    """Give the verdict.

    The first rule that holds decides:
    1. `wrong order`: a gate was crossed too early, whatever followed.
    2. `crashed`: see `CrashWatch`; coming to rest on its side or back is a crash too.
    3. `timed out`: the try exceeded its limit.
    4. `clean` or `completed`: all gates crossed in order, or all goals of the scenario reached, and standing
       on the base with the motors off.
       Clean has neither contacts nor time outside.
    5. `aborted`: all else. Examples are a mission that was broken off, motors cut in the air without a crash,
       landing beside the base, and landing with a gate not crossed.

    Args:
        facts: what the referee saw.
        mission_state: state the mission was in at the end, such as "red.turning".
        ended: why the flight was broken off, in a few words, when it was.

    Returns:
        The verdict and a sentence without a full stop.
    """
    verdict = _verdict(facts)
    if verdict in {Verdict.CLEAN, Verdict.COMPLETED}:
        details = _flaws(facts)
    else:
        details = [facts.wrong_order] if facts.wrong_order else []
        if facts.crash:
            details.append(f"the drone {facts.crash}")
        if verdict is Verdict.ABORTED:
            details.append(_one_line(ended or "") or _shortfall(facts))
    state = _one_line(mission_state)
    where = f" in {state}" if state else ""
    why = f" ({'; '.join(details)})" if details else ""
    crossed = ", ".join(facts.crossed) or "none"
    return verdict, f"{verdict} after {facts.try_time_s:.1f} s{where}{why}; crossed: {crossed}"


def _verdict(facts: TryFacts) -> Verdict:
    if facts.wrong_order:
        return Verdict.WRONG_ORDER
    if facts.crash:
        return Verdict.CRASHED
    if facts.timed_out:
        return Verdict.TIMED_OUT
    landed_on_base = facts.landing is not None and facts.landing.surface == "base"
    if facts.crossed != facts.expected or facts.missed_goal or not landed_on_base:
        return Verdict.ABORTED
    return Verdict.COMPLETED if _flaws(facts) else Verdict.CLEAN


def _flaws(facts: TryFacts) -> list[str]:
    flaws = []
    if facts.contact_frames:
        touched = ", ".join(dict.fromkeys(facts.contact_frames))
        flaws.append(f"contacts: {len(facts.contact_frames)}, with {touched}")
    if facts.outside_s > 0.0:
        flaws.append(f"outside the arena for {facts.outside_s:.2f} s")
    return flaws


def _shortfall(facts: TryFacts) -> str:
    """What a try that was not broken off lacks; the first that holds."""
    lacks = (
        (not facts.began, "the motors were never on"),
        (facts.motors_on, "the motors were still on"),
        (not facts.settled, "not yet at rest after the motors stopped"),
        (not facts.taken_off, "never took off"),
        (facts.landing is None, "did not come to rest on base or floor"),
    )
    for holds, words in lacks:
        if holds:
            return words
    if facts.landing is not None and facts.landing.surface != "base":
        return f"landed {facts.landing.error_m:.2f} m from the base's centre, not on the base"
    if facts.missed_goal:
        return f"landed on the base without being {facts.missed_goal}"
    missing = ", ".join(colour for colour in facts.expected if colour not in facts.crossed)
    return f"landed on the base without crossing {missing}"


def _one_line(text: str) -> str:
    return " ".join(text.split())
