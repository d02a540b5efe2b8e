"""Which effect to hide, where, and how strong."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from irb140_jax.errors import InputError
from irb140_jax.recordings.concealed.catalogue import hidden_kind
from irb140_jax.recordings.concealed.hidden import Hidden, Survey


@dataclasses.dataclass(frozen=True)
class Concealment:
    """One effect to hide.

    Attributes:
        effect: Its name in the vocabulary.
        joints: The joints it acts on, by name; all of them for effects that act everywhere, then best left empty.
        share: RMS of its torque as a share of the joint's torque RMS.
        parameters: Parameters given instead of drawn; when all are given, `share` is not used.
        other_law: Hide it under another formula than the library's, where there is one.
    """

    effect: str
    joints: tuple[str, ...] = ()
    share: float = 0.1
    parameters: dict[str, float] = dataclasses.field(default_factory=dict)
    other_law: bool = False


def chosen(concealment: Concealment, survey: Survey, names: Sequence[str], seed: int, k: int) -> Hidden:
    """The effect with its joints looked up, its shapes drawn and its amplitude set.

    Args:
        concealment: What is asked for.
        survey: What the arm does.
        names: Names of its joints.
        seed: Of the case.
        k: Which of its effects this is; each draws from a stream of its own.

    Raises:
        InputError: Unknown effect, joint or parameter, or the wrong number of joints.
    """
    kind = hidden_kind(concealment.effect, concealment.other_law)
    rng = np.random.default_rng([seed, 10, k])
    for name in concealment.joints:
        if name not in names:
            raise InputError(f"{concealment.effect}: no joint {name!r}; the robot has {', '.join(names)}")
    if set(concealment.parameters) - set(kind.units):
        raise InputError(f"{concealment.effect}: parameters are {', '.join(kind.units)}; "
                         f"got {', '.join(concealment.parameters)}")
    joints = tuple(list(names).index(name) for name in concealment.joints)
    if kind.joints_acted_on == 0:
        joints = tuple(range(len(names)))
    elif len(joints) != kind.joints_acted_on:
        raise InputError(f"{concealment.effect} acts on {kind.joints_acted_on} joint(s); got {len(joints)}")
    drawn = kind.drawn(joints, concealment.share, survey, rng)
    drawn.parameters.update(concealment.parameters)
    return drawn


def meaningful_sites(effect: str, survey: Survey) -> list[tuple[int, ...]]:
    """Joints on which an effect is something of its own, not another effect under its name.

    A torque gain or load-dependent friction on a joint that carries nothing but its own rotor is, in any data, a
    rotor inertia or Coulomb friction.  A coupling is felt on both joints only where their torques are comparable.

    Args:
        effect: Name in the vocabulary.
        survey: What the nominal arm does.

    Returns:
        Groups of joint indices, never empty.
    """
    n = survey.q.shape[1]
    if hidden_kind(effect).joints_acted_on == 0:
        return [tuple(range(n))]
    if hidden_kind(effect).joints_acted_on == 2:
        pairs = [(j, j + 1) for j in range(n - 1) if survey.is_slide(j) == survey.is_slide(j + 1)]
        if not pairs:
            raise InputError(f"{effect} needs two neighbouring joints of one kind; this robot has none")
        ratio = [abs(math.log(survey.rms(i) / survey.rms(j))) for i, j in pairs]
        near = [pair for pair, r in zip(pairs, ratio, strict=True) if r < math.log(6.0)]
        return near or [pairs[int(np.argmin(ratio))]]
    own = np.array([_own_share(survey, j) for j in range(n)])
    if effect in ("torque_gain", "rotor_inertia"):
        carrying = [(j,) for j in range(n) if own[j] > 0.15]
        return carrying or [(int(np.argmax(own)),)]
    return [(j,) for j in range(n)]


def _own_share(survey: Survey, joint: int) -> float:
    """Share of a joint's torque (RMS) that is not in proportion to its own acceleration."""
    tau, qdd = survey.load[:, joint], survey.qdd[:, joint]
    rest = tau - qdd * (tau @ qdd) / max(float(qdd @ qdd), 1e-300)
    return float(np.linalg.norm(rest) / max(float(np.linalg.norm(tau)), 1e-300))
