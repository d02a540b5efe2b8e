"""Every command of the command line.  A new one is a file with a dataclass that has `run`, and a line here."""

from typing import Annotated, Any, Union

from tyro.conf import subcommand

from irb140_jax.cli.demo import Demo
from irb140_jax.cli.diagnose import Diagnose
from irb140_jax.cli.excite import Excite
from irb140_jax.cli.inspect import Inspect
from irb140_jax.cli.predict import Predict

COMMANDS = (
    Diagnose,
    Predict,
    Demo,
    Excite,
    Inspect,
)

# One of them, each called as its class in small letters.
Command: Any = Union[tuple(Annotated[command, subcommand(command.__name__.lower())] for command in COMMANDS)]  # noqa: UP007
