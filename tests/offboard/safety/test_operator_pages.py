"""What the operators' pages demand, and when: late, silent and lost ones among them. Time is the test's."""

import pytest

from framerunner.wire.operator_messages import PageMessage
from offboard.safety.operator import Operator
from offboard.safety.operator_pages import LOST, OperatorPages

FLIGHT = "test-case-1 7"


class Pages:
    """A flight's pages with a clock; a page answers each beat after a delay."""

    def __init__(self, *, alone=False, asks=True):
        self.operator = Operator()
        if asks:
            self.operator.ask_for_go()
        self.pages = OperatorPages(self.operator, FLIGHT, alone=alone)
        self.now_s = 100.0
        self.beats = []

    def pass_time(self, seconds, what=None, page=1, delay_s=0.05):
        """Beats five times a second; ten times a second the page says something."""
        for step in range(round(seconds * 10)):
            if step % 2 == 0:
                self.beats.append((self.pages.beat(self.now_s), self.now_s))
            if what is not None:
                self.say(what, page, delay_s)
            self.pages.check(self.now_s)
            self.now_s += 0.1

    def say(self, what, page=1, delay_s=0.05, flight=FLIGHT):
        """A message that was on its way for some time, and so did the beat that it names."""
        known = [number for number, sent_s in self.beats if sent_s <= self.now_s - delay_s + 1e-6]
        beat = known[-1] if known else -1
        return self.pages.take(
            PageMessage(page=page, name="Ada", what=what, beat=beat, flight=flight), self.now_s
        )

    def hold_go_until_given(self):
        """A page holds the button; the go is given between 0.8 and 1.2 s."""
        self.pass_time(0.8, "go")
        assert not self.operator.has_go
        self.pass_time(0.4, "go")
        assert self.operator.has_go


def test_a_button_that_is_held_gives_the_go():
    pages = Pages()
    pages.pass_time(1.0, "here")
    pages.hold_go_until_given()


def test_a_button_that_is_let_go_gives_none():
    pages = Pages()
    pages.pass_time(1.0, "here")
    for _ in range(4):
        pages.pass_time(0.8, "go")
        pages.say("let_go")
    assert not pages.operator.has_go


def test_what_was_held_before_it_was_asked_for_does_not_count():
    pages = Pages(asks=False)
    pages.pass_time(3.0, "go")
    pages.operator.ask_for_go()
    pages.hold_go_until_given()


def test_messages_that_a_connection_has_kept_back_give_no_go():
    pages = Pages()
    pages.pass_time(1.0, "here")
    pages.pass_time(0.3, "go")
    pages.pass_time(3.0)
    for _ in range(30):
        pages.say("go")  # all at once; the last one may be older than the button's release
    assert not pages.operator.has_go


def test_a_connection_that_is_late_gives_no_go():
    pages = Pages()
    pages.pass_time(2.0, "here", delay_s=0.9)
    pages.pass_time(3.0, "go", delay_s=0.9)
    assert not pages.operator.has_go
    assert pages.say("go", delay_s=0.9) == "the connection is too slow for a go"


@pytest.mark.parametrize("loss", ["gone", "monitor lost"])
def test_a_page_that_is_lost_while_go_is_held_gives_none(loss):
    pages = Pages()
    pages.pass_time(1.0, "here")
    pages.pass_time(0.9, "go")
    if loss == "gone":
        pages.say("gone")
    else:
        pages.pages.lose_all()
    pages.pass_time(0.5, "go", page=2)
    pages.pass_time(5.0)
    assert not pages.operator.has_go


def test_two_pages_do_not_hold_one_go_together():
    pages = Pages()
    pages.pass_time(1.0, "here")
    for page in (1, 2, 1, 2):
        pages.pass_time(0.6, "go", page)
    assert not pages.operator.has_go


def test_a_stop_counts_however_late_and_the_motors_need_another_control_in_time():
    pages = Pages()
    pages.pass_time(10.0, "here")
    assert pages.say("stop_motors") == "land first"
    for _ in range(5):
        pages.say("stop", delay_s=8.0)
    assert (pages.operator.stops, pages.operator.stopped_by) == (1, "Ada, on the page")
    assert pages.say("stop_motors", delay_s=3.0) == "it came too late; press it again"
    assert not pages.operator.kills
    pages.say("stop_motors", page=2)
    assert pages.operator.kills


def test_demands_for_another_flight_are_ignored():
    pages = Pages()
    pages.pass_time(1.0, "here")
    assert pages.say("stop", flight="an earlier one") == "this flight is over"
    assert pages.operator.stops == 0


def test_a_flight_without_a_terminal_lands_when_no_page_is_left():
    pages = Pages(alone=True)
    pages.pass_time(20.0)  # nobody is needed before the go
    assert pages.operator.stops == 0
    pages.operator.phase = "flying"
    pages.pass_time(4.0, "here")
    pages.say("gone")
    pages.pass_time(3.0)
    pages.pass_time(3.0, "here", page=2)  # it is open again
    assert pages.operator.stops == 0
    pages.pass_time(7.0)
    assert (pages.operator.stops, pages.operator.stopped_by) == (1, LOST)
    pages.pass_time(20.0)
    assert not pages.operator.kills


def test_a_flight_with_a_terminal_flies_on_without_pages():
    pages = Pages(alone=False)
    pages.operator.phase = "flying"
    pages.pass_time(20.0)
    assert pages.operator.stops == 0


def test_the_delay_of_each_page_is_told():
    pages = Pages()
    pages.pass_time(2.0, "here", delay_s=0.3)
    pages.pass_time(0.2, "here", page=2, delay_s=0.0)
    told = {each.page: each for each in pages.pages.states(pages.now_s)}
    assert 200 <= told[1].delay_ms <= 500
    assert told[2].delay_ms < 200
    pages.pass_time(2.0, "here", page=2)
    assert [each.alive for each in pages.pages.states(pages.now_s)] == [False, True]
