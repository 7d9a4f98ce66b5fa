"""The base of all errors whose message is for people, and the one for settings, which all programs share."""


class UserError(Exception):
    """An error that the user can correct.

    The message is one line that names the field, the value and what to do; a mission file has one such line
    for each problem. The command line prints it and exits with code 2.
    """


class SettingError(UserError):
    """A command-line option or another setting that cannot be used; the message is one line for people."""
