"""The bases of errors whose message is for people, and advice on files that cannot be written."""

from __future__ import annotations

import errno


class UserError(Exception):
    """An error that the user can correct.

    The message is one line that names the field, the value and what to do; a mission file has one such line
    for each problem. The command line prints it and exits with code 2.
    """


class SettingError(UserError):
    """A command-line option or another setting that cannot be used; the message is one line for people."""


def is_disk_full(error: OSError) -> bool:
    """Whether a file was not written because there is no space, or none left of the user's quota."""
    return error.errno in (errno.ENOSPC, errno.EDQUOT)


def write_advice(error: OSError) -> str:
    """What to do about an option's file or folder that cannot be written to."""
    return "free some space or choose another" if is_disk_full(error) else "choose another"
