"""Every kind of physics that can be concealed, by its name in the vocabulary."""

from irb140_jax.errors import InputError
from irb140_jax.recordings.concealed import drive, friction, surroundings, transmission
from irb140_jax.recordings.concealed.hidden import Hidden
from irb140_jax.recordings.concealed.other_laws import OTHER_LAWS
from irb140_jax.recordings.concealed.outside import OUTSIDE

HIDDEN: dict[str, type[Hidden]] = {
    kind.slug: kind
    for kind in (
        friction.Coulomb, friction.Viscous, friction.Asymmetric, friction.Stribeck, friction.LoadDependent,
        drive.RotorInertia, drive.TorqueOffset, drive.TorqueGain, drive.TransmissionCoupling,
        friction.NonlinearViscous, friction.ThermalDrift, friction.Presliding, friction.PositionDependent,
        drive.TorqueRipple, drive.ActuatorLag, drive.TimeDelay, transmission.Elasticity, transmission.Backlash,
        surroundings.GravitySpring, surroundings.GravityTilt, surroundings.Payload, surroundings.EncoderOffset,
        surroundings.Contact, surroundings.ExternalWrench,
    )
}
FIRST_NINE = tuple(HIDDEN)[:9]


def hidden_kind(slug: str, other_law: bool = False) -> type[Hidden]:
    """The class that hides an effect of the vocabulary, or physics outside it.

    Args:
        slug: Its name.
        other_law: Whether to hide it under another formula than the library's, where there is one.

    Raises:
        InputError: No such effect; the message lists those there are.
    """
    kinds = {**HIDDEN, **OUTSIDE, **(OTHER_LAWS if other_law else {})}
    if slug not in kinds:
        raise InputError(f"effect {slug!r} can't be concealed; choose one of {', '.join(sorted(kinds))}")
    return kinds[slug]
