"""Which masses and inertias a body can have, and the nearest that it can have to those it can't."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

# MuJoCo compiles no moving body without mass or inertia; it gets this instead [kg, kg m^2], below any torque seen.
NEGLIGIBLE = 1e-12
# Files print moments to some digits: a flat plate's largest may exceed the sum of the others by the last of them.
PRINTED = 1e-6
# By what share of their sum mended moments stay clear of the bound, so that rounding does not bring them back.
CLEAR = 1e-9


class Inertial(NamedTuple):
    """Mass [kg], centre of mass [m], shape (3,), and inertia about it [kg m^2], shape (3, 3), in a body's axes."""

    mass: float
    com: Float[np.ndarray, "3"]
    inertia: Float[np.ndarray, "3 3"]


def moments(inertia: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3"]:
    """Principal moments, rising."""
    return np.linalg.eigvalsh(inertia)


def is_negative(mass: float, inertia: Float[np.ndarray, "3 3"]) -> bool:
    """Whether the mass or a principal moment is below zero by more than printing does."""
    low, _, high = moments(inertia)
    return mass < 0.0 or low < -PRINTED * max(high, 0.0) - 1e-18


def is_lopsided(inertia: Float[np.ndarray, "3 3"]) -> bool:
    """Whether one principal moment exceeds the sum of the other two, by more than printing does."""
    low, middle, high = moments(inertia)
    return high - low - middle > PRINTED * abs(high)


def possible(inertia: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """The nearest inertia that a body can have; the same where this one is possible.

    With J = tr(I)/2 1 - I, the second moments of mass, a body can have I if J has no eigenvalue below zero: those are
    raised to it, and the largest moment stays.

    Source: Traversaro, Brossette, Escande, Nori, Identification of fully physical consistent inertial parameters,
        IROS 2016.
    """
    size, axes = np.linalg.eigh(0.5 * np.trace(inertia) * np.eye(3) - inertia)
    least = CLEAR * np.abs(size).sum()
    if size[0] >= 0.0:
        return inertia
    size = np.maximum(size, least)
    J = axes @ np.diag(size) @ axes.T
    return np.trace(J) * np.eye(3) - J


def described(inertia: Float[np.ndarray, "3 3"]) -> str:
    """Principal moments for a sentence."""
    return ", ".join(f"{x:.3g}" for x in moments(inertia)) + " kg m^2"
