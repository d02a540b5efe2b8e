"""What competes with physics, is fitted like it, and is none that was left out: no finding bears its name."""

import numpy as np

from irb140_jax.effects import AbstractEffect
from irb140_jax.effects.base import Parameter, of_site


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


class Turnover(AbstractEffect):
    """F d sign(qd)/dt: dry friction that changes its sign before the joint does, by F / (friction) seconds.

    No machine's does.  MuJoCo's friction loss is a soft constraint on the acceleration: it turns about 10 ms before the
    joint, and within a few more.  Without it, that would be a lag of the drive or a delay of the log.
    """

    slug = "turnover"
    title = "friction that turns over before the joint stops"
    equation = "w d sign(qd)/dt, w >= 0"
    source = "MuJoCo documentation, Computation: friction loss, solver parameters"
    parameters = (Parameter("impulse", "{tau} s", low=0.0),)
    variants = ((0,),)
    needs = "motion that reverses direction"
    friction = True
    silent = True

    def columns(self, motion, joints, shape):
        return of_site(motion.turning, joints)[:, :, None]

    def physical(self, w, shape):
        return w

    def amplitudes(self, values):
        return np.array([values["impulse"]]), np.zeros(0)

    def lowest(self, robot, joints):
        return np.zeros(1)

    def where(self, names, values, units):
        return f"{names}: about every reversal of the motion"


SILENT = {e.slug: e for e in (LooseInertials(), Turnover())}
