"""What a swarm has to beat: one linear solve, Levenberg-Marquardt, BFGS, each from one start or from many."""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Float

from irb140_jax.identify.linear_fit import LinearFit
from irb140_jax.types import Scalar

Method = Literal["levenberg_marquardt", "bfgs"]


class Descent(NamedTuple):
    """Where descents ended.

    Attributes:
        x: Shape (s, d).
        fitness: Sum of squares there, shape (s,).
        steps: Steps taken, shape (s,).
    """

    x: Float[Array, "s d"]
    fitness: Float[Array, " s"]
    steps: Float[Array, " s"]


def newton_step(objective: Callable[[Float[Array, " d"]], Scalar], x: Float[Array, " d"]) -> Float[Array, " d"]:
    """Minimum of a quadratic from anywhere: x - H^-1 grad.  For equation 20 within its box, the answer."""
    return x - jnp.linalg.solve(jax.hessian(objective)(x), jax.grad(objective)(x))


@eqx.filter_jit
def descents(
    residual: Callable[[Float[Array, " d"]], Float[Array, " r"]], starts: Float[Array, "s d"],
    method: Method = "levenberg_marquardt", *, scale: Float[Array, " d"] | None = None, tolerance: float = 1e-12,
    max_steps: int = 500,
) -> Descent:  # fmt: skip
    """Minimise |residual|^2 from every start; the best of them is a multi-start.

    Args:
        residual: Of one x; a pytree, whose arrays are inputs of the program.
        starts: Shape (s, d).
        method: "levenberg_marquardt" or "bfgs".
        scale: Size of a unit step of each unknown, shape (d,); descents run in x / scale.
        tolerance: Relative and absolute, of both x and the sum of squares.
        max_steps: Largest number of steps; one that stops there is returned as it is.
    """
    size = jnp.ones(starts.shape[1]) if scale is None else scale
    solver: Any
    if method == "bfgs":
        solver = optx.BFGS(rtol=tolerance, atol=tolerance)
    else:
        solver = optx.LevenbergMarquardt(rtol=tolerance, atol=tolerance)

    def squares(y: Float[Array, " d"], _: None) -> Scalar:
        return jnp.sum(residual(y * size) ** 2)

    def one(start: Float[Array, " d"]) -> Descent:
        options = {"max_steps": max_steps, "throw": False}
        if method == "bfgs":
            solution = optx.minimise(squares, solver, start / size, **options)
        else:
            solution = optx.least_squares(lambda y, _: residual(y * size), solver, start / size, **options)
        return Descent(solution.value * size, squares(solution.value, None), solution.stats["num_steps"])

    return jax.vmap(one)(starts)


def nearest_least_squares(fit: LinearFit, phi: Float[Array, " m"], precision: float = 1e-9) -> Float[Array, " m"]:
    """Least squares on what the motion shows, the rest left as given: phi + R^+ (z - R phi), base parameters in effect.

    Args:
        fit: From `linear_fit`.
        phi: Inertial parameters to start from, as in `Robot.phi`, shape (10 k,).
        precision: Singular values below this share of the largest count as not shown.

    Returns:
        Inertial parameters, shape (10 k,).  Nothing holds them to possible bodies, or the masses to what they were.
    """
    # In units of the parameters' own sizes, so that kg and kg m^2 weigh alike.
    size = jnp.maximum(jnp.abs(phi), 1e-3 * jnp.max(jnp.abs(phi)))
    step, *_ = jnp.linalg.lstsq(fit.R * size, fit.z - fit.R @ phi, rcond=precision)
    return phi + size * step
