"""What a table is, and what may be said about a file that can't be seen in it."""

import dataclasses

import numpy as np

MAX_BYTES = 2**30  # of a table, unpacked; ten minutes of six joints at 5 kHz are half of it
MAX_VALUES = 10**8  # of a table; as many floats are 0.8 GB


@dataclasses.dataclass(frozen=True)
class FileOptions:
    """How to read a file where its own form leaves it open.

    Attributes:
        encoding: Of a text file, a name that Python knows.
        separator: Between columns of a text file; "blanks" for any number of them.
        decimal: The decimal mark of a text file, "." or ",".
        comment: The sign at which a comment begins in a text file.
        time_format: Of times given as text, in the letters of `strptime`.
        topic: The ROS topic to read, where several hold joint states.
        episode: The episode of a LeRobot file to read.
    """

    encoding: str | None = None
    separator: str | None = None
    decimal: str | None = None
    comment: str | None = None
    time_format: str | None = None
    topic: str | None = None
    episode: int | None = None


@dataclasses.dataclass(frozen=True)
class Table:
    """Columns by name.

    Attributes:
        columns: Each of shape (T,), floats or objects.
        notes: What was guessed or left out, a sentence each.
        units: The unit that the file itself states for a column.
        format: What kind of file it was, for a person.
    """

    columns: dict[str, np.ndarray]
    notes: list[str] = dataclasses.field(default_factory=list)
    units: dict[str, str] = dataclasses.field(default_factory=dict)
    format: str = ""
