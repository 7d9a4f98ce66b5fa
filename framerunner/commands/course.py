"""`framerunner course`: lessons from take-off to the whole challenge."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Parameter

from framerunner.commands import NamedPilot, say, write_new

app = App(
    name="course", help="Five short lessons: take off, fly to points, look, cross, the whole challenge."
)

LessonName = Annotated[str, Parameter(help="number or name")]
LanguageOption = Annotated[Literal["en", "es"], Parameter(help="English or Spanish")]
_FAILED = 1


@app.command(name="list")
def list_(*, language: LanguageOption = "en") -> int:
    """List the lessons, with what the drone has to do in each.

    **Examples**

        framerunner course list

        framerunner course list --language es
    """
    from framerunner.course.lessons import load_lessons

    for lesson in load_lessons():
        text = lesson.text
        print(f"{lesson.number}  {text.title.in_language(language)} ({text.minutes} min)")
        print(f"   {text.goal.in_language(language)}")
    return 0


@app.command
def start(
    lesson: LessonName,
    *,
    out: Path = Path("."),
    language: LanguageOption = "en",
) -> int:
    """Begin a lesson: print what to do, and write the mission to start from. Nothing is overwritten.

    **Examples**

        framerunner course start 1

        framerunner course start 3 --out missions --language es

    Args:
        lesson: number or name.
        out: folder to write the mission to
        language: of the texts.
    """
    from framerunner.course.lessons import find_lesson

    found = find_lesson(lesson)
    text, path = found.text, out / f"lesson_{found.number}.yaml"
    write_new({path: found.start}, makes_folder=True)
    print(f"{text.title.in_language(language)}\n\n{text.goal.in_language(language)}\n")
    print(f"written: {path}. The steps are for the editor:\n\n  framerunner edit {path}\n")
    for number, step in enumerate(text.steps, start=1):
        print(f"{number}. {step.in_language(language)}")
    for hint in text.hints:
        print(f"*  {hint.in_language(language)}")
    print("\nOnly the editor's page Course has a tab Lesson; a file is checked by this command instead:\n")
    print(f"  framerunner course check {found.number} {path}")
    return 0


@app.command
def check(
    lesson: LessonName,
    mission: str,
    *,
    pilot: NamedPilot = None,
) -> int:
    """Fly a mission in a lesson's scenario, as fast as the machine can, and say whether it passes.

    Exit code 1: it does not.

    **Examples**

        framerunner course check 1 lesson_1.yaml

        framerunner course check 5 frame_challenge

    Args:
        lesson: number or name.
        mission: name or file
        pilot: primitives of your own.
    """
    from framerunner.course.lessons import find_lesson
    from framerunner.flying.lockstep import fly_lockstep
    from framerunner.flying.plan import FlightPlan
    from offboard.mission import load_mission

    found = find_lesson(lesson)
    say(f"flying lesson {found.number} …")
    result = fly_lockstep(FlightPlan(found.scenario, load_mission(mission, pilot))).result
    print(f"{'passed' if result.completed else 'not yet'}: {result.reason}")
    return 0 if result.completed else _FAILED
