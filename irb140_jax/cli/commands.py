"""Every command of the command line.  A new one is a file with a dataclass that has `run`, and a line here."""

import re
from typing import Annotated, Any, Union

from tyro.conf import subcommand

from irb140_jax.cli.compare import Compare
from irb140_jax.cli.demo import Demo
from irb140_jax.cli.diagnose import Diagnose
from irb140_jax.cli.diagnose_many import DiagnoseMany
from irb140_jax.cli.excite import Excite
from irb140_jax.cli.inspect import Inspect
from irb140_jax.cli.predict import Predict

COMMANDS = (
    Diagnose,
    Predict,
    Demo,
    Excite,
    Inspect,
    DiagnoseMany,
    Compare,
)


def word(command: type) -> str:
    """What a command is called: its class in small letters, with hyphens between words."""
    return re.sub(r"(?<!^)(?=[A-Z])", "-", command.__name__).lower()


# One of them.
Command: Any = Union[tuple(Annotated[command, subcommand(word(command))] for command in COMMANDS)]  # noqa: UP007
