"""A candidate that is no left-out physics: fitted and compared like an effect, and never reported as a finding."""

from irb140_jax.effects import Effect, Law


def _columns(motion, joints, shape):
    raise NotImplementedError("these columns are the regressor's")


def _amplitudes(values):
    raise NotImplementedError("inertials have no amplitudes of their own")


# A link whose inertials are wrong beyond the stated uncertainty, competing with physics.
LOOSE_INERTIALS = Effect(
    slug="inertials",
    title="inertials wrong beyond their stated uncertainty",
    needs="motion of this joint and the joints before it",
    where="in the rigid body's own torques",
    law=Law(
        equation="Y_link (phi - phi_nominal)",
        source="prior of `inertial_prior_factor`, widened",
        parameters=(),
        columns=_columns,
        to_physical=lambda w, shape: w[:0],
        from_physical=_amplitudes,
        variants=(tuple(range(10)),),
    ),
)
