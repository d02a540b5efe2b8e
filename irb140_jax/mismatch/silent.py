"""What competes with physics, is fitted like it, and is none that was left out: no finding bears its name."""

import jax
import jax.numpy as jnp
import numpy as np

from irb140_jax.effects import AbstractEffect
from irb140_jax.effects.base import Parameter
from irb140_jax.effects.grids import geometric_grid
from irb140_jax.effects.motion import of_site

LEADS = (0.0, 0.0095)  # s before the joint: a plain simulator's, and MuJoCo's by default
CREEPS = 12
STIFF = 9.0  # share of the constraint by its softness: d/(1 - d) of an impedance d of 0.9
ROUNDS = 20  # from a start that is right but for the smoothing


class LooseInertials(AbstractEffect):
    """Not left-out physics: a link whose inertials are wrong beyond the stated uncertainty, competing with physics."""

    slug = "inertials"
    title = "inertials wrong beyond their stated uncertainty"
    equation = "Y_link (phi - phi_nominal)"
    source = "prior of `inertial_prior_factor`, widened"
    parameters = ()
    variants = (tuple(range(10)),)
    needs = "motion of this joint and the joints before it"
    silent = True

    def columns(self, motion, joints, shape):
        raise NotImplementedError("these columns are the regressor's")

    def physical(self, w, shape):
        return w[:0]

    def amplitudes(self, values):
        raise NotImplementedError("inertials have no amplitudes of their own")

    def where(self, names, values, units):
        return f"{names}: in the rigid body's own torques"


class SoftFriction(AbstractEffect):
    """w (clip((qd + lead qdd)/creep, -1, 1) - sign(qd)): dry friction that lets a joint creep, and turns over early.

    No machine's does, but a simulator's is not the sign of a speed either.  MuJoCo's friction loss F is a soft
    constraint on the acceleration: a joint of inertia m creeps beneath F / (9 m b), b = 105/s, and friction turns 1/b
    before the joint.  Others round the sign off over some range of speed.  Without this law the one would be a lag or a
    delay, the other a Stribeck law with a bent drag.
    """

    slug = "soft_friction"
    title = "friction that lets a joint creep, or turns over before it"
    equation = "w (clip((qd + lead qdd)/creep, -1, 1) - sign(qd)), w >= 0"
    source = "MuJoCo documentation, Computation: friction loss, solver parameters"
    parameters = (
        Parameter("friction", "{tau}", low=0.0), Parameter("creep", "{q}/s", low=0.0), Parameter("lead", "s", low=0.0)
    )  # fmt: skip
    variants = ((0,),)
    needs = "motion that reverses direction"
    friction = True
    alters = "coulomb_friction"
    silent = True

    def shapes(self, scales, joints):
        speed, rest = float(scales.speed[joints[0]]), float(scales.rest_speed[joints[0]])
        return _with_leads(geometric_grid(0.03 * rest, max(0.1 * speed, 3.0 * rest), CREEPS))

    def refines(self):
        return True

    def finer(self, grid, best):
        creep = np.unique(grid[:, :1], axis=0)
        near = super().finer(creep, best)[::2]
        # The first was chosen among wrong companions: all others stay within reach.
        return _with_leads(np.concatenate([geometric_grid(creep[0, 0], creep[-1, 0], CREEPS - len(near)), near]))

    def columns(self, motion, joints, shape):
        creep, lead = shape
        ahead = of_site(motion.qd, joints) + lead * of_site(motion.qdd, joints)

        def closer(_, s):
            # Friction's own part of qdd is as smooth as qdd: taken out, and put in again as sharp as it is.
            smooth = jnp.pad(s, ((1, 1), (0, 0)), mode="edge")
            smooth = jnp.where(lead > 0.0, (smooth[:-2] + 2.0 * s + smooth[2:]) / 4.0, s)
            return jnp.clip((ahead / creep + STIFF * smooth) / (1.0 + STIFF), -1.0, 1.0)

        soft = jax.lax.fori_loop(0, ROUNDS, closer, jnp.clip(ahead / creep, -1.0, 1.0))
        return (soft - of_site(motion.direction, joints))[:, :, None]

    def physical(self, w, shape):
        return jnp.concatenate([w, shape])

    def amplitudes(self, values):
        return np.array([values["friction"]]), np.array([values["creep"], values["lead"]])

    def lowest(self, robot, joints):
        return np.zeros(1)

    def where(self, names, values, units):
        return f"{names}: about every reversal of the motion"


def _with_leads(creep: np.ndarray) -> np.ndarray:
    """Every creep with every lead, shape (both, 2)."""
    return np.concatenate([np.column_stack([creep, np.full(len(creep), lead)]) for lead in LEADS])


SILENT = {e.slug: e for e in (LooseInertials(), SoftFriction())}
