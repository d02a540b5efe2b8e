"""Differentiable dynamics of serial arms, and a diagnosis of the physics a model left out."""

import jax

# Every formula here is meant in double precision; this is the one place that says so.
jax.config.update("jax_enable_x64", True)

from irb140_jax import robot as robot  # noqa: E402
from irb140_jax.robot import Robot as Robot  # noqa: E402
from irb140_jax.robot import load_robot as load_robot  # noqa: E402
