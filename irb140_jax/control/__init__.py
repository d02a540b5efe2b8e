"""Controllers, and the motions they are to follow."""

from irb140_jax.control.base import AbstractController as AbstractController
from irb140_jax.control.base import Desired as Desired
from irb140_jax.control.base import Unactuated as Unactuated
from irb140_jax.control.circles import circle as circle
from irb140_jax.control.reference import Reference as Reference
from irb140_jax.control.reference import along as along
from irb140_jax.control.sliding_mode import SlidingMode as SlidingMode
from irb140_jax.control.sliding_mode import sliding_mode as sliding_mode
