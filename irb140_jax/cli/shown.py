"""What a person sees while a command runs, and where."""

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from irb140_jax.report import Results


def console():
    """Where a person reads."""
    from rich.console import Console

    # Into a file or a pipe, tables keep their width instead of being folded to the 80 columns of no terminal.
    return Console(highlight=False, width=None if sys.stdout.isatty() else 120)


@contextlib.contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """Where a run tells what it is doing: a moving line on a terminal, plain lines elsewhere; always on stderr."""
    from rich.console import Console

    terminal = Console(stderr=True, highlight=False)
    if terminal.is_terminal:
        with terminal.status("") as status:
            yield lambda sentence: status.update(sentence)
        return
    held: list[str] = []

    def tell(sentence: str) -> None:
        # The first sentence waits for the second: input that can't be used is refused in the first step, and then
        # stderr holds nothing but the line that says why.
        held.append(sentence)
        if len(held) == 2:
            print(held[0], file=sys.stderr, flush=True)
        if len(held) >= 2:
            print(sentence, file=sys.stderr, flush=True)

    yield tell
    if len(held) == 1:
        print(held[0], file=sys.stderr, flush=True)


def tell_kept(results: "Results") -> None:
    """Say which files of the user stood in the way, and what they are called now."""
    for old, new in results.kept:
        print(f"{old} is not as this command wrote it: kept as {new.name}", file=sys.stderr)
