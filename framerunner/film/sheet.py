"""One picture of a film: the arena, the camera's image, words and figures."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.film.arena_view import ArenaView, state_colour
from framerunner.film.camera_view import CameraView
from framerunner.film.colours import BAD, FAINT, FRAME, GOOD, INK, LINE, PAPER, WHITE, Bgr, mixed
from framerunner.film.layout import lay_out
from framerunner.film.letters import Letters
from framerunner.film.story import Instant, Story
from framerunner.film.viewpoint import Flyby
from scenarios.models import COLOURS
from scenarios.result import FlightResult

Image = npt.NDArray[np.uint8]

_SHIFT = 4


class Sheet:
    """Paints the pictures of one film, in any order.

    Args:
        story: the flight.
        size_px: width and height.
        speed: flight time a film time.
    """

    def __init__(self, story: Story, size_px: tuple[int, int], speed: float) -> None:
        camera = story.scenario.camera
        self._story = story
        self._speed = speed
        self._layout = lay_out(*size_px, camera.width_px / camera.height_px)
        view = self._layout.view
        self._flyby = Flyby(story, (view.width, view.height), speed)
        self._arena = ArenaView(story, (view.width, view.height))
        self._letters = Letters()
        self._camera = CameraView(self._layout.camera, self._letters, self._layout.unit)
        hung = {frame.colour for frame in story.scenario.frames}
        self._colours = [colour for colour in COLOURS if colour in hung]
        self._paper = np.full((size_px[1], size_px[0], 3), PAPER, np.uint8)
        self._draw_strip()

    def paint(self, time_s: float, *, over: bool = False) -> Image:
        """Paint the picture of a time of the flight.

        Args:
            time_s: since motors on.
            over: the flight is over; its verdict is told.

        Returns:
            A new image, BGR, shape (height, width, 3).
        """
        instant = self._story.at(time_s)
        image = self._paper.copy()
        view = self._layout.view
        film_s = (time_s - self._story.begin_s) / self._speed
        image[view.y : view.bottom, view.x : view.right] = self._arena.paint(
            instant, self._flyby.at(time_s), film_s
        )
        self._write_title(image)
        camera = None if instant.image is None else self._story.image(instant.image)
        self._camera.paint(image, camera, instant.detections)
        self._write_state(image, instant, over)
        self._write_figures(image, instant, over)
        self._mark_time(image, time_s)
        return image

    def _write_title(self, image: Image) -> None:
        unit, view = self._layout.unit, self._layout.view
        room = view.width - 40 * unit
        title = self._letters.shortened(self._story.title, 27 * unit, room, bold=True)
        self._letters.write(image, (18 * unit, 40 * unit), title, 27 * unit, INK, bold=True)
        mission = self._letters.shortened(self._story.mission.replace("_", " "), 19 * unit, room)
        self._letters.write(image, (18 * unit, 66 * unit), mission, 19 * unit, FAINT)

    def _write_state(self, image: Image, instant: Instant, over: bool) -> None:
        """The mission's state with the colour of its trail, and the place."""
        unit, box = self._layout.unit, self._layout.state
        y = box.y + 40 * unit
        group, _, kind = instant.state.rpartition(".")
        name = kind.replace("_", " ") or "no mission"
        radius = 9 * unit
        _dot(image, (box.x + radius + unit, y - 9 * unit), radius, state_colour(instant.kind))
        x = box.x + 28 * unit
        size = 27 * unit
        name = self._letters.shortened(name, size, box.right - x, bold=True)
        x += self._letters.write(image, (x, y), name, size, INK, bold=True) + 10 * unit
        group = group.replace("_", " ")
        if x + self._letters.width(group, 20 * unit) <= box.right:
            self._letters.write(image, (x, y), group, 20 * unit, FAINT)
        if y + 34 * unit > box.bottom:
            return
        if over and self._story.result is not None:
            words = self._letters.shortened(_total(self._story.result), 20 * unit, box.width)
            self._letters.write(image, (box.x, y + 36 * unit), words, 20 * unit, FAINT)
            return
        metres = zip("xyz", instant.position_arena_m, strict=True)
        step = min(116 * unit, box.width / 3)
        for number, (axis, value) in enumerate(metres):
            at = (box.x + number * step, y + 36 * unit)
            width = self._letters.write(image, at, axis, 20 * unit, FAINT)
            beside = (at[0] + width + 5 * unit, at[1])
            self._letters.write(image, beside, f"{value + 0.0:.2f}", 20 * unit, INK)

    def _write_figures(self, image: Image, instant: Instant, over: bool) -> None:
        unit, box = self._layout.unit, self._layout.figures
        middle = box.y + box.height / 2
        time_s = max(0.0, instant.time_s)
        if self._story.try_end_s is not None:
            time_s = min(time_s, self._story.try_end_s)
        x = box.x + 18 * unit
        size = 44 * unit
        self._letters.write(image, (x, middle + 16 * unit), f"{time_s:.1f} s", size, INK, bold=True)
        x += self._letters.width("000.0 s", size, bold=True) + 22 * unit
        right = box.right - 16 * unit
        if over and self._story.result is not None:
            right = self._write_verdict(image, right) - 16 * unit
        elif not over:
            words = f"{self._speed:.3g}×"
            right -= self._letters.width(words, 20 * unit) + 10 * unit
            self._letters.write(image, (right + 10 * unit, middle + 7 * unit), words, 20 * unit, FAINT)
        self._chips(image, (x, right), instant)

    def _chips(self, image: Image, span: tuple[float, float], instant: Instant) -> None:
        """A chip for each frame: an outline until it is crossed, then filled, with the time."""
        if not self._colours:
            return
        unit, box = self._layout.unit, self._layout.figures
        gap, height = 10 * unit, 42 * unit
        width = min(150 * unit, (span[1] - span[0] + gap) / len(self._colours) - gap)
        middle = box.y + box.height / 2
        for number, colour in enumerate(self._colours):
            left = span[0] + number * (width + gap)
            when_s = instant.crossed.get(colour)
            ink = FRAME[colour]
            corner = (left, middle - height / 2)
            _pill(image, corner, (width, height), mixed(ink, WHITE, 0.35) if when_s is None else ink)
            if when_s is None:
                edge = 2.2 * unit
                inside = (width - 2 * edge, height - 2 * edge)
                _pill(image, (corner[0] + edge, corner[1] + edge), inside, PAPER)
            text = colour if when_s is None else f"{when_s:.1f} s"
            size = 23 * unit
            text_width = self._letters.width(text, size, bold=when_s is not None)
            at = (left + (width - text_width) / 2, middle + 8 * unit)
            letters = mixed(ink, INK, 0.4) if when_s is None else WHITE
            self._letters.write(image, at, text, size, letters, bold=when_s is not None)

    def _write_verdict(self, image: Image, right: float) -> float:
        """The verdict at the right, in a chip; returns where it begins."""
        result = self._story.result
        if result is None:
            return right
        unit, box = self._layout.unit, self._layout.figures
        size, height = 27 * unit, 50 * unit
        width = self._letters.width(result.verdict, size, bold=True) + 40 * unit
        middle = box.y + box.height / 2
        colour = GOOD if result.completed else BAD
        left = right - width
        _pill(image, (left, middle - height / 2), (width, height), colour)
        at = (left + 20 * unit, middle + 10 * unit)
        self._letters.write(image, at, result.verdict, size, WHITE, bold=True)
        return left

    def _draw_strip(self) -> None:
        """The line of time: the states in their colours."""
        strip = self._layout.strip
        for begin_s, end_s, kind in self._story.stretches:
            x0, x1 = self._strip_x(begin_s), self._strip_x(end_s)
            self._paper[strip.y : strip.bottom, x0:x1] = mixed(state_colour(kind), PAPER, 0.55)
        self._paper[strip.y - 1 : strip.y] = LINE

    def _mark_time(self, image: Image, time_s: float) -> None:
        strip = self._layout.strip
        until = self._strip_x(time_s)
        for begin_s, end_s, kind in self._story.stretches:
            x0, x1 = self._strip_x(begin_s), min(until, self._strip_x(end_s))
            if x1 > x0:
                image[strip.y : strip.bottom, x0:x1] = state_colour(kind)
        half = max(1, round(1.5 * self._layout.unit))
        image[strip.y : strip.bottom, max(0, until - half) : until + half] = INK

    def _strip_x(self, time_s: float) -> int:
        strip, story = self._layout.strip, self._story
        share = (time_s - story.begin_s) / (story.end_s - story.begin_s)
        return strip.x + round(min(1.0, max(0.0, share)) * strip.width)


def _total(result: FlightResult) -> str:
    words = f"total {result.total_time_s:.1f} s"
    return f"{words}, of it penalty {result.penalty_s:.1f} s" if result.penalty_s else words


def _dot(image: Image, centre_px: tuple[float, float], radius_px: float, colour: Bgr) -> None:
    centre = (_sixteenths(centre_px[0]), _sixteenths(centre_px[1]))
    cv2.circle(image, centre, _sixteenths(radius_px), colour, cv2.FILLED, cv2.LINE_AA, _SHIFT)


def _pill(image: Image, corner_px: tuple[float, float], size_px: tuple[float, float], colour: Bgr) -> None:
    """Fill a box with round ends."""
    (x, y), (width, height) = corner_px, size_px
    if width <= 0 or height <= 0:
        return
    radius = min(width, height) / 2
    steps = np.linspace(-np.pi / 2, np.pi / 2, 24)
    across, along = radius * np.cos(steps), radius * np.sin(steps)
    right = np.stack((x + width - radius + across, y + height / 2 + along), 1)
    left = np.stack((x + radius - across, y + height / 2 - along), 1)
    outline = np.rint(np.concatenate((right, left)) * (1 << _SHIFT)).astype(np.int32)
    cv2.fillConvexPoly(image, outline, colour, cv2.LINE_AA, _SHIFT)


def _sixteenths(value: float) -> int:
    return round(value * (1 << _SHIFT))
