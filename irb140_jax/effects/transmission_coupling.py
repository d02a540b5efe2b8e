"""Transmission coupling: friction between parts of two joints that turn relative to each other, as in a wrist."""

import jax.numpy as jnp
import numpy as np

from irb140_jax.effects.base import Effect
from irb140_jax.effects.motion import of_site
from irb140_jax.effects.records import At, Export, Law, Parameter, Place, Prior, Shapes
from irb140_jax.robot.tree import path


def _columns(motion, joints, shape):
    """tau_i = f(v), tau_j = s f(v) with v = qd_i + s qd_j, s = +-1, f(v) = viscous v [+ coulomb sign(v)]."""
    qd, rest = of_site(motion.qd, joints), jnp.take(motion.rest_speed, joints)
    sign = jnp.stack([jnp.ones(()), shape[0]])
    relative = qd @ sign
    friction = jnp.stack([relative, jnp.tanh(relative / jnp.linalg.norm(rest))], axis=-1)
    return friction[:, None, :] * sign[None, :, None]


def _from_physical(values):
    return np.array([values["viscous"], values.get("coulomb", 0.0)]), np.array([values.get("sign", 1.0)])


def _sites(robot):
    # Joints of different branches share no transmission.
    pairs = [
        (i, j) for j in range(robot.n) for i in path(robot.parent, j)[:-1] if robot.is_slide[i] == robot.is_slide[j]
    ]
    pairs.sort()
    return np.array(pairs, dtype=int).reshape(-1, 2)


EFFECT = Effect(
    slug="transmission_coupling",
    title="friction between two coupled joints",
    needs="motion of both joints at speeds that are not in proportion",
    confused_with={"viscous_friction": "motion of each of the two joints while the other one rests"},
    where="on both joints, in proportion to their relative speed, {viscous}",
    law=Law(
        equation="viscous (qd_i + s qd_j) [+ coulomb sign(qd_i + s qd_j)] on joint i, s times that on joint j",
        source="Khalil and Dombre 2002, ch. 9 (Staubli wrist); Gautier, Dynamic identification of robots, ICRA 1997",
        parameters=(Parameter("viscous", "{tau} s/{q}", low=0.0), Parameter("coulomb", "{tau}", low=0.0)),
        columns=_columns,
        from_physical=_from_physical,
        variants=((0,), (0, 1)),
        empirical=True,
    ),
    place=Place(At.FRICTION, _sites),
    prior=Prior(lowest=(0.0, 0.0), dissipative=True),
    shapes=Shapes(grid=lambda scales, joints: np.array([[1.0], [-1.0]])),
    export=Export(
        not_in_mjcf="it is left out: it would need a fixed tendon over both joints (damping, frictionloss)"
    ),
)
