"""The words of a command line to a command with its options."""

import contextlib
import io
import re
import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

import tyro

from irb140_jax.cli.commands import COMMANDS, Command, word
from irb140_jax.errors import InputError

FIRST_STEPS = """\
irb140 demo --out demo                               see it work: an effect is hidden, found, revealed
irb140 diagnose log.csv --robot arm.urdf --out d     your own robot; then look at d/report.html
irb140 diagnose --help                               what a command takes, with examples
irb140 --version                                     which version this is"""


def parsed(argv: Sequence[str] | None) -> Any:
    """The command with its options.

    Args:
        argv: Words of the command line, by default those of the process.

    Raises:
        InputError: Wrong words; what tyro says of them in a box becomes one line.
        SystemExit: The words asked for help or for the version, which has been printed.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    if words == ["--version"]:
        print(f"irb140 {version('irb140_jax')}")
        raise SystemExit(0)
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            return tyro.cli(
                Command, prog="irb140", description="Which physics did your robot model leave out?", args=words
            )
    except SystemExit as stop:
        if stop.code in (0, None):
            print(_examples(words))
            raise
        box = r"\x1b\[[0-9;]*m|[─│╭╮╰╯]|^\+-|-{3,}\+?|^\||\|$"  # the lines of a plain terminal, too
        message = " ".join(re.sub(box, " ", said.getvalue(), flags=re.MULTILINE).split())
        # The box's text may repeat its heading.
        raise InputError(re.sub(r"^(.+?) \1\b", r"\1", message)) from None


def _examples(words: Sequence[str]) -> str:
    """What to end a help with: lines that can be copied."""
    asked = [command for command in COMMANDS if word(command) in words[:1]]
    lines = getattr(asked[0], "EXAMPLES", FIRST_STEPS) if asked else FIRST_STEPS
    return "examples:\n" + "\n".join(f"  {line}" for line in lines.splitlines())
