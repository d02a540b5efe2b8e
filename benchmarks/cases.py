# pyright: reportMissingImports=false, reportAttributeAccessIssue=false
"""What is measured.  Each function returns metrics: name -> value; a disagreement with the peer is an error."""

import timing  # noqa: I001  first: it sets the number of threads

import jax
import jax.numpy as jnp
import numpy as np
import peers
import pinocchio as pin

from irb140_jax import dynamics
from irb140_jax.robot import Robot

ROUNDS = 7
# Agreement of two independent double precision recursions, relative to the largest torque.
AGREE = 1e-11


def motion(robot: Robot, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random positions, speeds and accelerations, shape (size, n) each."""
    rng = np.random.default_rng(0)
    q, qd, qdd = rng.uniform(-2.0, 2.0, (3, size, robot.n))
    return q, qd, 5.0 * qdd


def check(ours, theirs, what: str) -> None:
    """Raise unless both agree."""
    error = float(np.max(np.abs(np.asarray(ours) - theirs)) / np.max(np.abs(theirs)))
    if not error < AGREE:
        raise AssertionError(f"{what}: ours and the peer's differ by {error:.1e} of the largest")


def inverse_dynamics(robot: Robot) -> dict[str, float]:
    """Inverse dynamics against Pinocchio's own loop in C++ on one thread."""
    model = peers.pinocchio_model(robot)
    pool = pin.ModelPool(model, 1)
    metrics = {}
    for name, size, repeats in (("1e3", 1000, 20), ("1e5", 100_000, 1)):
        samples = motion(robot, size)
        arrays = [jnp.asarray(x) for x in samples]
        columns = [np.asfortranarray(x.T) for x in samples]
        result = np.empty((robot.n, size), order="F")
        ours = lambda arrays=arrays: dynamics.inverse_dynamics_batch(robot, *arrays)  # noqa: E731
        theirs = lambda columns=columns, out=result: pin.rneaInParallel(1, pool, *columns, out)  # noqa: E731
        metrics[f"inverse_dynamics_{name}_compile_s"] = timing.compile_seconds(ours)
        theirs()
        check(ours(), result.T, f"inverse dynamics of {size}")
        median = timing.medians({"ours": ours, "pinocchio": theirs}, ROUNDS, repeats)
        metrics[f"inverse_dynamics_{name}_per_s"] = size / median["ours"]
        metrics[f"inverse_dynamics_{name}_pinocchio_per_s"] = size / median["pinocchio"]
        metrics[f"inverse_dynamics_{name}_ratio"] = median["pinocchio"] / median["ours"]
    return metrics


def paper_style(robot: Robot, size: int = 2000) -> dict[str, float]:
    """M, Christoffel C and g as the study writes them, against C by differentiating M automatically."""

    def ours(robot: Robot, q, qd, qdd):
        C = dynamics.coriolis_matrix(robot, q, qd)
        return dynamics.mass_matrix(robot, q) @ qdd + C @ qd + dynamics.gravity_torque(robot, q)

    def autodiff(robot: Robot, q, qd, qdd):
        dM = jax.jacfwd(dynamics.mass_matrix, argnums=1)(robot, q)
        C = 0.5 * (dM @ qd + jnp.einsum("ikj,k->ij", dM, qd) - jnp.einsum("jki,k->ij", dM, qd))
        return dynamics.mass_matrix(robot, q) @ qdd + C @ qd + dynamics.gravity_torque(robot, q)

    arrays = [jnp.asarray(x) for x in motion(robot, size)]
    batched = {f.__name__: jax.jit(jax.vmap(f, in_axes=(None, 0, 0, 0))) for f in (ours, autodiff)}
    cases = {name: lambda f=f: f(robot, *arrays) for name, f in batched.items()}
    metrics = {f"paper_style_compile_{name}_s": timing.compile_seconds(case) for name, case in cases.items()}
    check(cases["ours"](), np.asarray(cases["autodiff"]()), "paper style")
    median = timing.medians(cases, ROUNDS, 3)
    metrics["paper_style_per_s"] = size / median["ours"]
    metrics["paper_style_autodiff_per_s"] = size / median["autodiff"]
    metrics["paper_style_ratio"] = median["autodiff"] / median["ours"]
    return metrics


def identification(robot: Robot, size: int = 60_000) -> dict[str, float]:
    """Least squares of a minute at 1 kHz: Gram matrix in one pass against Pinocchio's regressors and NumPy's lstsq."""
    samples = motion(robot, size)
    tau = np.asarray(dynamics.inverse_dynamics_batch(robot, *samples))
    tau = tau - np.asarray(robot.armature) * samples[2] + np.random.default_rng(1).normal(size=tau.shape)
    model = peers.pinocchio_model(robot)
    arrays = [jnp.asarray(x) for x in (*samples, tau)]

    def ours() -> tuple[np.ndarray, float]:
        gram = np.asarray(dynamics.regressor_gram(robot, *arrays))
        phi = np.linalg.lstsq(gram[:-1, :-1], gram[:-1, -1], rcond=1e-12)[0]
        return phi, float(gram[-1, -1] - 2.0 * phi @ gram[:-1, -1] + phi @ gram[:-1, :-1] @ phi)

    def theirs() -> tuple[np.ndarray, float]:
        Y = peers.regressor_loop(model, *samples)
        phi = np.linalg.lstsq(Y, tau.ravel(), rcond=1e-9)[0]
        return phi[peers.our_columns(robot.n)], float(np.sum((Y @ phi - tau.ravel()) ** 2))

    metrics = {"identification_compile_s": timing.compile_seconds(ours)}
    metrics["identification_extra_mb"] = timing.extra_megabytes(ours)
    # Normal equations and orthogonal factors agree on the sum of squares, whatever they make of the null space.
    residual = ours()[1]
    if not abs(residual / theirs()[1] - 1.0) < 1e-9:
        raise AssertionError("identification: ours and the peer's leave different residuals")
    median = timing.medians({"ours": ours, "pinocchio": theirs}, ROUNDS)
    metrics["identification_s"] = median["ours"]
    metrics["identification_pinocchio_s"] = median["pinocchio"]
    metrics["identification_ratio"] = median["pinocchio"] / median["ours"]
    return metrics
