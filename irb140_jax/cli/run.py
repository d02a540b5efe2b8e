"""A command line from its words to its exit code."""

import os
import sys
from collections.abc import Sequence

from irb140_jax.allocator import keep_memory
from irb140_jax.cli.parsing import parsed
from irb140_jax.errors import InputError


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command.

    Args:
        argv: Words of the command line, by default those of the process.

    Returns:
        Exit code: 0 done, 2 the input can't be used (one line on stderr says why, nothing is written).
    """
    if argv is None:  # the process is ours
        keep_memory()
    try:
        _run(argv)
    except InputError as error:
        print("irb140: " + " ".join(str(error).split()), file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130  # what a shell makes of an interrupted program
    except BrokenPipeError:  # whoever read our words has stopped, as in `irb140 --help | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python would flush into the pipe at its end
        return 141
    return 0


def _run(argv: Sequence[str] | None) -> None:
    try:
        command = parsed(argv)
        from irb140_jax.compilation_cache import set_up_compilation_cache

        set_up_compilation_cache()
        command.run()
    finally:
        sys.stdout.flush()  # here, where a pipe that nobody reads is an exception; at Python's end it is a complaint
