"""Candidates that are no left-out physics: fitted and compared like effects, and never reported as findings."""

from irb140_jax.effects import AbstractEffect


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


SILENT = {LooseInertials.slug: LooseInertials()}
