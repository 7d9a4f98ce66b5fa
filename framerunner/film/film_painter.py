"""Paints the images of a film: the arena, the camera's image, the mission's state and the figures."""

from __future__ import annotations

from math import isfinite

import cv2
import numpy as np

from framerunner.film import style
from framerunner.film.arena_view import ArenaView, state_colour
from framerunner.film.style import Bgr, Letters, PixelBox
from framerunner.film.timeline import Instant, Timeline
from framerunner.film.viewpoint import Flyby
from framerunner.recording.recording_messages import box_edges
from scenarios.models import COLOURS
from scenarios.result import FlightResult
from vision.types import Detection, Detections, Image


class FilmPainter:
    """Paints the images of one film, in any order; the speed is the ratio of flight time to film time."""

    def __init__(self, timeline: Timeline, size_px: tuple[int, int], speed: float) -> None:
        camera = timeline.scenario.camera
        self._timeline = timeline
        self._speed = speed
        self._layout = style.lay_out(*size_px, camera.width_px / camera.height_px)
        view = self._layout.view
        self._flyby = Flyby(timeline, (view.width, view.height), speed)
        self._arena = ArenaView(timeline, (view.width, view.height))
        self._letters = Letters()
        self._camera = _CameraView(self._layout.camera, self._letters, self._layout.unit)
        present = {gate.colour for gate in timeline.scenario.frames}
        self._colours = [colour for colour in COLOURS if colour in present]
        self._paper = np.full((size_px[1], size_px[0], 3), style.PAPER, np.uint8)
        self._draw_strip()

    def paint(self, time_s: float, *, over: bool = False) -> Image:
        """Paint a time of the flight, since motors on; if it is over, with its verdict.

        Returns:
            A new image, BGR, shape (height, width, 3).
        """
        instant = self._timeline.at(time_s)
        image = self._paper.copy()
        view = self._layout.view
        film_s = (time_s - self._timeline.begin_s) / self._speed
        image[view.y : view.bottom, view.x : view.right] = self._arena.paint(
            instant, self._flyby.at(time_s), film_s
        )
        self._write_title(image)
        camera = None if instant.image is None else self._timeline.image(instant.image)
        self._camera.paint(image, camera, instant.detections)
        self._write_state(image, instant, over)
        self._write_figures(image, instant, over)
        self._mark_time(image, time_s)
        return image

    def _write_title(self, image: Image) -> None:
        unit, view = self._layout.unit, self._layout.view
        room = view.width - 40 * unit
        title = self._letters.shortened(self._timeline.title, 27 * unit, room, bold=True)
        self._letters.write(image, (18 * unit, 40 * unit), title, 27 * unit, style.INK, bold=True)
        mission = self._letters.shortened(self._timeline.mission.replace("_", " "), 19 * unit, room)
        self._letters.write(image, (18 * unit, 66 * unit), mission, 19 * unit, style.FAINT)

    def _write_state(self, image: Image, instant: Instant, over: bool) -> None:
        """Write the mission's state, with a dot of its trail's colour, and the drone's position."""
        unit, box = self._layout.unit, self._layout.state
        y = box.y + 40 * unit
        group, _, kind = instant.state.rpartition(".")
        name = kind.replace("_", " ") or "no mission"
        radius = 9 * unit
        _dot(image, (box.x + radius + unit, y - 9 * unit), radius, state_colour(instant.kind))
        x = box.x + 28 * unit
        size = 27 * unit
        name = self._letters.shortened(name, size, box.right - x, bold=True)
        x += self._letters.write(image, (x, y), name, size, style.INK, bold=True) + 10 * unit
        group = group.replace("_", " ")
        if x + self._letters.width(group, 20 * unit) <= box.right:
            self._letters.write(image, (x, y), group, 20 * unit, style.FAINT)
        if y + 34 * unit > box.bottom:
            return
        if over and self._timeline.result is not None:
            total = self._letters.shortened(_total_time(self._timeline.result), 20 * unit, box.width)
            self._letters.write(image, (box.x, y + 36 * unit), total, 20 * unit, style.FAINT)
            return
        step = min(116 * unit, box.width / 3)
        for number, (axis, metres) in enumerate(zip("xyz", instant.position_arena_m, strict=True)):
            at = (box.x + number * step, y + 36 * unit)
            width = self._letters.write(image, at, axis, 20 * unit, style.FAINT)
            beside = (at[0] + width + 5 * unit, at[1])
            self._letters.write(image, beside, f"{metres + 0.0:.2f}", 20 * unit, style.INK)

    def _write_figures(self, image: Image, instant: Instant, over: bool) -> None:
        """Write the time, a chip for each gate, and the speed or, at the end, the verdict."""
        unit, box = self._layout.unit, self._layout.figures
        middle = box.y + box.height / 2
        time_s = max(0.0, instant.time_s)
        if self._timeline.try_end_s is not None:
            time_s = min(time_s, self._timeline.try_end_s)
        x = box.x + 18 * unit
        size = 44 * unit
        self._letters.write(image, (x, middle + 16 * unit), f"{time_s:.1f} s", size, style.INK, bold=True)
        x += self._letters.width("000.0 s", size, bold=True) + 22 * unit
        right = box.right - 16 * unit
        if over and self._timeline.result is not None:
            right = self._write_verdict(image, right, self._timeline.result) - 16 * unit
        elif not over:
            speed = f"{self._speed:.3g}×"
            right -= self._letters.width(speed, 20 * unit) + 10 * unit
            self._letters.write(image, (right + 10 * unit, middle + 7 * unit), speed, 20 * unit, style.FAINT)
        self._draw_chips(image, (x, right), instant)

    def _draw_chips(self, image: Image, span: tuple[float, float], instant: Instant) -> None:
        """Draw a chip for each gate: an outline until it is crossed, then filled, with the time."""
        if not self._colours:
            return
        unit, box = self._layout.unit, self._layout.figures
        gap, height, size = 10 * unit, 42 * unit, 23 * unit
        width = min(150 * unit, (span[1] - span[0] + gap) / len(self._colours) - gap)
        middle = box.y + box.height / 2
        for number, colour in enumerate(self._colours):
            left, top = span[0] + number * (width + gap), middle - height / 2
            when_s = instant.crossed.get(colour)
            crossed = when_s is not None
            ink = style.GATE[colour]
            _pill(
                image, (left, top), (width, height), ink if crossed else style.mixed(ink, style.WHITE, 0.35)
            )
            if not crossed:
                edge = 2.2 * unit
                _pill(image, (left + edge, top + edge), (width - 2 * edge, height - 2 * edge), style.PAPER)
            text = colour if when_s is None else f"{when_s:.1f} s"
            text_width = self._letters.width(text, size, bold=crossed)
            at = (left + (width - text_width) / 2, middle + 8 * unit)
            letters = style.WHITE if crossed else style.mixed(ink, style.INK, 0.4)
            self._letters.write(image, at, text, size, letters, bold=crossed)

    def _write_verdict(self, image: Image, right: float, result: FlightResult) -> float:
        """Write the verdict into a chip; returns its left edge."""
        unit, box = self._layout.unit, self._layout.figures
        size, height = 27 * unit, 50 * unit
        width = self._letters.width(result.verdict, size, bold=True) + 40 * unit
        middle = box.y + box.height / 2
        left = right - width
        _pill(
            image, (left, middle - height / 2), (width, height), style.GOOD if result.completed else style.BAD
        )
        at = (left + 20 * unit, middle + 10 * unit)
        self._letters.write(image, at, result.verdict, size, style.WHITE, bold=True)
        return left

    def _draw_strip(self) -> None:
        """Draw the time line: the states in pale colours."""
        strip = self._layout.strip
        for begin_s, end_s, kind in self._timeline.stretches:
            x0, x1 = self._strip_x(begin_s), self._strip_x(end_s)
            self._paper[strip.y : strip.bottom, x0:x1] = style.mixed(state_colour(kind), style.PAPER, 0.55)
        self._paper[strip.y - 1 : strip.y] = style.LINE

    def _mark_time(self, image: Image, time_s: float) -> None:
        """Draw what has passed of the time line in full colours."""
        strip = self._layout.strip
        until = self._strip_x(time_s)
        for begin_s, end_s, kind in self._timeline.stretches:
            x0, x1 = self._strip_x(begin_s), min(until, self._strip_x(end_s))
            if x1 > x0:
                image[strip.y : strip.bottom, x0:x1] = state_colour(kind)
        half = max(1, round(1.5 * self._layout.unit))
        image[strip.y : strip.bottom, max(0, until - half) : until + half] = style.INK

    def _strip_x(self, time_s: float) -> int:
        strip, timeline = self._layout.strip, self._timeline
        share = (time_s - timeline.begin_s) / (timeline.end_s - timeline.begin_s)
        return strip.x + round(min(1.0, max(0.0, share)) * strip.width)


class _CameraView:
    """Paints the camera's image and its detections into a box, as large as it fits; `unit` as in `Layout`."""

    def __init__(self, box: PixelBox, letters: Letters, unit: float) -> None:
        self._box = box
        self._letters = letters
        self._unit = unit

    def paint(self, image: Image, camera: Image | None, seen: Detections) -> None:
        """Paint the camera's image, BGR, onto the film's image; "no image" if it is None."""
        box = self._box
        if camera is None:
            image[box.y : box.bottom, box.x : box.right] = style.LINE
            text, size = "no image", 20 * self._unit
            x = box.x + (box.width - self._letters.width(text, size)) / 2
            self._letters.write(image, (x, box.y + box.height / 2 + 0.35 * size), text, size, style.FAINT)
            return
        height, width = camera.shape[:2]
        scale = min(box.width / width, box.height / height)
        shown = (max(1, round(scale * width)), max(1, round(scale * height)))
        how = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
        part: Image = np.ascontiguousarray(cv2.resize(camera, shown, interpolation=how), np.uint8)
        for colour in COLOURS:
            detection: Detection = getattr(seen, colour)
            if all(map(isfinite, (detection.n, detection.s, detection.e, detection.w))):
                left, top, right, bottom = (scale * edge for edge in box_edges(detection, (width, height)))
                self._mark(part, (left, top, right, bottom), detection)
        left_px, top_px = box.x + (box.width - shown[0]) // 2, box.y + (box.height - shown[1]) // 2
        image[top_px : top_px + shown[1], left_px : left_px + shown[0]] = part

    def _mark(self, part: Image, edges: tuple[float, float, float, float], detection: Detection) -> None:
        """Draw the box of a detection, and write its distance and angle if they are known."""
        grow = 2.0 * self._unit
        left, top = edges[0] - grow, edges[1] - grow
        right, bottom = edges[2] + grow, edges[3] + grow
        corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
        outline = [style.fixed_point(np.array(corners))]
        for width, colour in ((3.6, style.INK), (1.8, style.WHITE)):
            thickness = max(1, round(width * self._unit))
            cv2.polylines(part, outline, True, colour, thickness, cv2.LINE_AA, style.SUBPIXEL_BITS)
        if isfinite(detection.d):
            angle = f"  {detection.a:.0f}°" if isfinite(detection.a) else ""
            self._label(part, (left, top, bottom), f"{detection.d:.2f} m{angle}")

    def _label(self, part: Image, beside: tuple[float, float, float], text: str) -> None:
        """Write above a box, or below it where there is no room above."""
        left, top, bottom = beside
        size, pad = 18 * self._unit, 5 * self._unit
        width, height = self._letters.width(text, size) + 2 * pad, size + 1.2 * pad
        x = min(max(left, 0.0), max(0.0, part.shape[1] - width))
        y = top - height - pad
        if y < 0.0:
            y = min(bottom + pad, part.shape[0] - height)
        x0, y0 = round(x), max(0, round(y))
        under = part[y0 : round(y0 + height), x0 : round(x0 + width)]
        under[:] = under // 3 + np.array(style.INK, np.uint8) // 3 * 2
        self._letters.write(part, (x0 + pad, y0 + 0.4 * pad + 0.86 * size), text, size, style.WHITE)


def _total_time(result: FlightResult) -> str:
    text = f"total {result.total_time_s:.1f} s"
    return f"{text}, of it penalty {result.penalty_s:.1f} s" if result.penalty_s else text


def _dot(image: Image, centre_px: tuple[float, float], radius_px: float, colour: Bgr) -> None:
    x, y, radius = (round(value * (1 << style.SUBPIXEL_BITS)) for value in (*centre_px, radius_px))
    cv2.circle(image, (x, y), radius, colour, cv2.FILLED, cv2.LINE_AA, style.SUBPIXEL_BITS)


def _pill(image: Image, corner_px: tuple[float, float], size_px: tuple[float, float], colour: Bgr) -> None:
    """Fill a box with round ends."""
    (x, y), (width, height) = corner_px, size_px
    if width <= 0 or height <= 0:
        return
    radius = min(width, height) / 2
    angles = np.linspace(-np.pi / 2, np.pi / 2, 24)
    across, along = radius * np.cos(angles), radius * np.sin(angles)
    right = np.stack((x + width - radius + across, y + height / 2 + along), 1)
    left = np.stack((x + radius - across, y + height / 2 - along), 1)
    outline = style.fixed_point(np.concatenate((right, left)))
    cv2.fillConvexPoly(image, outline, colour, cv2.LINE_AA, style.SUBPIXEL_BITS)
