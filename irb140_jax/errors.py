"""Errors that say what was wrong, what came, what is allowed and what to do.

Every error a user can cause derives from `InputError`; the command line turns it into one line and exit code 2.
"""


class InputError(ValueError):
    """The input can't be used.  The message is one line: where, what is wrong, what would mend it."""


class RobotError(InputError):
    """The robot model can't be represented as hinges and slides on a fixed base."""


class RecordingError(InputError):
    """The recording can't be used: names file, column, row and remedy."""


class MisplacedResultError(Exception):
    """The work is done, but its result could not be put where it was wanted; the message says where it is."""
