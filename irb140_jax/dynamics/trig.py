"""Sine and cosine together, in plain arithmetic.

XLA calls the C library once per float64 element, which alone would take most of the time of an inverse dynamics;
arithmetic is vectorised and fused with what uses it.
"""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

# pi/2 in three parts (Cody, Waite): the first two have so few bits that k times them is exact up to |k| = 2^20.
HALF_PI = (float.fromhex("0x1.921fb544p+0"), float.fromhex("0x1.0b4611a6p-34"), float.fromhex("0x1.3198a2e037073p-69"))
# Taylor coefficients in r^2.  |r| <= pi/4, so the first term left out is below 1e-18.
SINE = [(-1) ** k / math.factorial(2 * k + 1) for k in range(9)]
COSINE = [(-1) ** k / math.factorial(2 * k) for k in range(9)]


@jax.custom_jvp
def sincos(x: Float[Array, "..."]) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """Sine and cosine, to 3e-16.

    Args:
        x: Angle [rad], |x| <= 1e6 for full accuracy.

    Returns:
        sin x and cos x.

    Source: Cody, Waite (1980), Software Manual for the Elementary Functions, ch. 8.
    """
    k = jnp.round(x * (2.0 / math.pi))
    r = ((x - k * HALF_PI[0]) - k * HALF_PI[1]) - k * HALF_PI[2]
    sine, cosine = r * _horner(SINE, r * r), _horner(COSINE, r * r)
    quadrant = k - 4.0 * jnp.floor(0.25 * k)
    odd = (quadrant == 1.0) | (quadrant == 3.0)
    s, c = jnp.where(odd, cosine, sine), jnp.where(odd, sine, cosine)
    negative_c = (quadrant == 1.0) | (quadrant == 2.0)
    return jnp.where(quadrant >= 2.0, -s, s), jnp.where(negative_c, -c, c)


def _horner(coefficients: list[float], z: Float[Array, "..."]) -> Float[Array, "..."]:
    result = jnp.full_like(z, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        result = result * z + coefficient
    return result


@sincos.defjvp
def _sincos_jvp(primals, tangents):
    s, c = sincos(*primals)
    return (s, c), (c * tangents[0], -s * tangents[0])
