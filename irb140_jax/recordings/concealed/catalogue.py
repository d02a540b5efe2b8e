"""Every kind of physics that can be concealed, by its name in the vocabulary."""

from irb140_jax.errors import InputError
from irb140_jax.recordings.concealed import drive, friction, surroundings, transmission
from irb140_jax.recordings.concealed.hidden import Hidden

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


def hidden_kind(slug: str) -> type[Hidden]:
    """The class that hides an effect.

    Raises:
        InputError: No such effect; the message lists those there are.
    """
    if slug not in HIDDEN:
        raise InputError(f"effect {slug!r} can't be concealed; choose one of {', '.join(sorted(HIDDEN))}")
    return HIDDEN[slug]
