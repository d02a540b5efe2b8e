"""A command line from its words to its exit code."""

import gc
import os
import signal
import sys
import warnings
from collections.abc import Sequence

from irb140_jax.allocator import keep_memory
from irb140_jax.cli.parsing import parsed
from irb140_jax.errors import InputError, MisplacedResultError


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command.

    Args:
        argv: Words of the command line, by default those of the process.

    Returns:
        Exit code: 0 done, 2 the input can't be used (one line on stderr says why, nothing is written), 3 the program
        is at fault or the result is not where it was wanted (one line on stderr says where the rest is).
    """
    if argv is None:  # the process is ours
        keep_memory()
        gc.set_threshold(50_000, 20, 20)  # tracing makes millions of objects, of which hardly any is garbage
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # as an exception, so that nothing is left half-written
    try:
        _run(argv)
    except InputError as error:
        return _said(error, 2)
    except MisplacedResultError as error:
        return _said(error, 3)
    except KeyboardInterrupt:
        return 130  # what a shell makes of an interrupted program
    except BrokenPipeError:  # whoever read our words has stopped, as in `irb140 --help | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python would flush into the pipe at its end
        return 141
    except Exception as error:
        from irb140_jax.cli.unexpected import report

        return _said(report(error, sys.argv[1:] if argv is None else argv), 3)
    return 0


def _run(argv: Sequence[str] | None) -> None:
    try:
        command = parsed(argv)
        from irb140_jax.compilation_cache import set_up_compilation_cache

        set_up_compilation_cache()
        with warnings.catch_warnings():
            if not sys.warnoptions:  # nobody asked for them with python -W
                warnings.simplefilter("ignore")  # what odd numbers make a library say: checks say it in our words
            command.run()
    finally:
        sys.stdout.flush()  # here, where a pipe that nobody reads is an exception; at Python's end it is a complaint


def _said(message: object, code: int) -> int:
    """An exit code, with one line that says why."""
    print("irb140: " + " ".join(str(message).split()), file=sys.stderr)
    return code
