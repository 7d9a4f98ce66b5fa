"""The base of all errors that are meant for people."""

from __future__ import annotations


class UserError(Exception):
    """Something a user can put right.

    The message is one line that names the field, the value and what to do; a mission file has one such line
    for each problem. The command line prints it and exits with code 2.
    """
