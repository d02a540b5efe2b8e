"""What a person sees while a command runs, and where."""

import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from irb140_jax.report import Results


def console(*, stderr: bool = False):
    """Where a person reads: stdout, or stderr where stdout belongs to a program."""
    from rich.console import Console

    stream = sys.stderr if stderr else sys.stdout
    # Into a file or a pipe, tables keep their width instead of being folded to the 80 columns of no terminal.
    return Console(highlight=False, stderr=stderr, width=None if stream.isatty() else 120)


@contextlib.contextmanager
def progress(steps: Mapping[str, float] | None = None) -> Iterator[Callable[[str], None]]:
    """Where a run tells what it is doing: a moving line on a terminal, plain lines elsewhere; always on stderr.

    Args:
        steps: Words that say a step has begun -> share of the time that is over by then, in the order of the steps.
    """
    from rich.console import Console

    terminal, done = Console(stderr=True, highlight=False), Share(steps or {})
    if terminal.is_terminal:
        with terminal.status("") as status:
            yield lambda sentence: status.update(done.with_share(sentence))
        return
    held: list[str] = []

    def tell(sentence: str) -> None:
        # The first sentence waits for the second: input that can't be used is refused in the first step, and then
        # stderr holds nothing but the line that says why.
        held.append(done.with_share(sentence))
        if len(held) == 2:
            print(held[0], file=sys.stderr, flush=True)
        if len(held) >= 2:
            print(held[-1], file=sys.stderr, flush=True)

    yield tell
    if len(held) == 1:
        print(held[0], file=sys.stderr, flush=True)


class Share:
    """How much of a run is done, and how long the rest will take if it goes on as it has begun."""

    def __init__(self, steps: Mapping[str, float], clock: Callable[[], float] = time.monotonic):
        self._steps, self._clock, self._start, self._share = steps, clock, clock(), 0.0

    def with_share(self, sentence: str) -> str:
        """The sentence, with the share done and the time left, as far as anything is known of them.

        What is done "once more" begins anew.
        """
        if sentence.startswith("once more"):
            self._start, self._share = self._clock(), 0.0
        begun = [share for words, share in self._steps.items() if words in sentence]
        self._share = max([self._share, *begun])
        if not self._share:
            return sentence
        left = (self._clock() - self._start) * (1.0 / self._share - 1.0)
        return f"{sentence} ({self._share:.0%} done, {rough(left)} left)"


def rough(seconds: float) -> str:
    """A time as nobody would take it for exact."""
    if seconds < 10.0:
        return "some seconds"
    return f"about {10 * round(seconds / 10)} s" if seconds < 90.0 else f"about {round(seconds / 60)} min"


def tell_kept(results: "Results") -> None:
    """Say which files of the user stood in the way, and what they are called now."""
    for old, new in results.kept:
        print(f"{old} differs from what this command wrote; it is kept as {new.name}", file=sys.stderr)
