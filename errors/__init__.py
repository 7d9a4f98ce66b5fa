"""The base of all errors that are meant for people."""


class UserError(Exception):
    """An error that the user can correct.

    The message is one line that names the field, the value and what to do; a mission file has one such line
    for each problem. The command line prints it and exits with code 2.
    """
