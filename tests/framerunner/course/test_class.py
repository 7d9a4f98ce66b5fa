"""A small class at the first lesson, each pupil in a browser context of its own."""

from tests.framerunner.course.class_of_pupils import hold_class


async def test_pupils_check_a_lesson_at_once_and_change_nothing_of_each_other_or_the_contest():
    seen = await hold_class(pupils=2, lessons=1)
    assert len(seen.checks_s[1]) == 2
