"""The command line: one file a command, and one line for each in `commands`."""

from irb140_jax.cli.run import main as main
