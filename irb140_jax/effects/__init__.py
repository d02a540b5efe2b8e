"""Left-out physics, one file an effect.  `catalogue.CATALOGUE` lists them by slug."""

from irb140_jax.effects.base import Effect as Effect
from irb140_jax.effects.grids import Scales as Scales
from irb140_jax.effects.left_over import LeftOver as LeftOver
from irb140_jax.effects.motion import Asked as Asked
from irb140_jax.effects.motion import Motion as Motion
from irb140_jax.effects.motion import RigidBody as RigidBody
from irb140_jax.effects.records import At as At
from irb140_jax.effects.records import Export as Export
from irb140_jax.effects.records import Law as Law
from irb140_jax.effects.records import Parameter as Parameter
from irb140_jax.effects.records import Place as Place
from irb140_jax.effects.records import Prior as Prior
from irb140_jax.effects.records import Shapes as Shapes
