"""Options for XLA that suit programs of scalars."""

from importlib.metadata import version

# Compiles programs of thousands of scalar operations on the CPU in half the time, and they run as fast: for
# `jax.jit(f, compiler_options=QUICK)` of a function that is not called from another compiled one.  Programs on whole
# arrays, such as swarms, can lose a quarter.  Empty on versions that may not know the option, which would be an error.
QUICK: dict[str, bool | int | str] = (
    {"xla_cpu_use_fusion_emitters": False} if version("jaxlib").startswith("0.10.") else {}
)
