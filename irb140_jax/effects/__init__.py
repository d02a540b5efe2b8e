"""Left-out physics, one file an effect.  `catalogue.CATALOGUE` lists them by slug."""

from irb140_jax.effects.base import AbstractEffect as AbstractEffect
from irb140_jax.effects.base import Motion as Motion
from irb140_jax.effects.base import Parameter as Parameter
from irb140_jax.effects.base import RigidBody as RigidBody
from irb140_jax.effects.base import Scales as Scales
from irb140_jax.effects.left_over import LeftOver as LeftOver
