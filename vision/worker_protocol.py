"""Requests to the process that decodes images, and its answers, as bytes."""

from __future__ import annotations

import struct
from enum import IntEnum

MAX_IMAGE_BYTES = 3 * 4096 * 4096
DECODE_LIMIT_S = 0.5
"""Longest time for one image: thirty times what a baseline JPEG of 1920 x 1080 pixels takes."""
REQUEST = struct.Struct("<BI")  # what is asked, and the length of what belongs to it
ANSWER = struct.Struct(
    "<BIId"
)  # what it is, width and height in pixels, monotonic time of arrival in seconds


class Request(IntEnum):
    """What is asked."""

    DECODE = 1  # an image file follows
    OPEN = 2  # time limit in milliseconds, a space and the URL follow; a number is a device
    NEXT = 3  # the next image of what was opened


class Reply(IntEnum):
    """What the answer is."""

    IMAGE = 1
    NO_IMAGE = 2  # it cannot be decoded, or is too large
    READY = 3  # said once, without being asked, when the process can work
    OPENED = 4
    NOT_OPENED = 5
    END_OF_FILE = 6
    END_OF_STREAM = 7
