"""The words of a command line to a command with its options."""

import contextlib
import io
import re
from collections.abc import Sequence
from typing import Any

import tyro

from irb140_jax.cli.commands import Command
from irb140_jax.errors import InputError


def parsed(argv: Sequence[str] | None) -> Any:
    """The command with its options.

    Args:
        argv: Words of the command line, by default those of the process.

    Raises:
        InputError: Wrong words; what tyro says of them in a box becomes one line.
    """
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            return tyro.cli(
                Command, prog="irb140", description="Which physics did your robot model leave out?", args=argv
            )
    except SystemExit as stop:
        if stop.code in (0, None):
            raise
        words = " ".join(re.sub(r"\x1b\[[0-9;]*m|[─│╭╮╰╯]", " ", said.getvalue()).split())
        raise InputError(words) from None
