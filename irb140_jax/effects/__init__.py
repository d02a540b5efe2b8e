"""Left-out physics, one file an effect.  `catalogue.CATALOGUE` lists them by slug."""

from irb140_jax.effects.base import AbstractEffect as AbstractEffect
from irb140_jax.effects.base import Parameter as Parameter
from irb140_jax.effects.grids import Scales as Scales
from irb140_jax.effects.left_over import LeftOver as LeftOver
from irb140_jax.effects.motion import Motion as Motion
from irb140_jax.effects.motion import RigidBody as RigidBody
