"""What all live camera sources share: a place for the latest image, never a queue, and the error type."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Generic, Protocol, Self, TypeVar
from urllib.parse import urlsplit

from errors import UserError
from vision.types import CameraFrame

T = TypeVar("T")


class CameraError(UserError):
    """A camera cannot be opened or has failed; the message is one line that names it."""


class CameraSource(Protocol):
    """A camera: `async with source: async for frame in source.frames()`.

    A live source gives the latest image, however long the consumer took, and raises `CameraError` from
    `__aenter__` or `frames` when there are no more.
    """

    @property
    def bad_frames(self) -> int:
        """Images skipped so far because they could not be decoded."""
        ...

    async def __aenter__(self) -> Self:
        """Open the camera."""
        ...

    async def __aexit__(self, *exc_info: object) -> None:
        """Close it."""

    def frames(self) -> AsyncIterator[CameraFrame]:
        """Images as they come."""
        ...


class Latest(Generic[T]):
    """Holds the newest item until it is taken; an older one that nobody took is dropped.

    To be used in the event loop's thread.
    """

    def __init__(self) -> None:
        self._item: T | None = None
        self._end: CameraError | None = None
        self._ended = False
        self._changed = asyncio.Event()

    def put(self, item: T) -> None:
        """Replace the item."""
        self._item = item
        self._changed.set()

    def end(self, error: CameraError | None) -> None:
        """Say that nothing comes after the item held now; without an error it is a normal end."""
        self._end, self._ended = error, True
        self._changed.set()

    async def get(self) -> T | None:
        """Take the item, waiting for one if need be; None at a normal end.

        Raises:
            CameraError: the source has failed.
        """
        while self._item is None and not self._ended:
            self._changed.clear()
            await self._changed.wait()
        item, self._item = self._item, None
        if item is None and self._end is not None:
            raise self._end
        return item


def shown(url: str) -> str:
    """Return a URL as it may be shown: without a password, on one line, not too long."""
    text = url
    try:
        parts = urlsplit(url)
        if parts.password is not None:
            text = url.replace(f":{parts.password}@", ":***@", 1)
    except ValueError:
        pass  # not a URL; shown as it is
    text = text.encode("unicode_escape").decode("ascii")
    return text if len(text) <= 120 else text[:117] + "..."


def first_line(error: object) -> str:
    """Return the first line of an error's text, or its type if it has none."""
    lines = str(error).strip().splitlines()
    return lines[0][:200] if lines else type(error).__name__
