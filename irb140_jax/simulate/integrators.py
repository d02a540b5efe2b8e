"""Steps of fixed length from one state to the next, in scalars.

An integrator spans a few samples of the reference: Euler one, Runge-Kutta two, since it looks half a step ahead.
"""

from abc import abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp

from irb140_jax.dynamics.scalar_arm import Scalars
from irb140_jax.types import Scalar

# (what acts at this moment, q, qd) -> (qdd, torque of the motors)
Law = Callable[[Any, Scalars, Scalars], tuple[Scalars, Scalars]]
State = tuple[tuple, tuple]


class AbstractIntegrator(eqx.Module):
    """A rule that advances the state by one step.

    Attributes:
        span: Samples of the reference from the start of a step to its end.
        stages: For every evaluation of the law within a step, the sample it happens at, counted from the step's start.
    """

    span: eqx.AbstractClassVar[int]
    stages: eqx.AbstractClassVar[tuple[int, ...]]

    @abstractmethod
    def step(self, law: Law, moments: Any, state: State, dt: Scalar) -> tuple[State, Scalars, Scalars]:
        """The state after a step, and accelerations and motor torques at its start.

        Args:
            law: The closed loop.
            moments: What acts at each stage; leaves of shape (stages, ...).
            state: Positions and velocities, n scalars each.
            dt: Length of the step [s].
        """


class SemiImplicitEuler(AbstractIntegrator):
    """qd' = qd + dt qdd, q' = q + dt qd': order 1, symplectic, and what MuJoCo calls Euler.

    Source: Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), section I.1.2.
    """

    span: ClassVar[int] = 1
    stages: ClassVar[tuple[int, ...]] = (0,)

    def step(self, law: Law, moments: Any, state: State, dt: Scalar) -> tuple[State, Scalars, Scalars]:
        """One evaluation of the law."""
        q, qd = state
        qdd, tau = law(jax.tree.map(lambda x: x[0], moments), list(q), list(qd))
        qd = tuple(v + dt * a for v, a in zip(qd, qdd, strict=True))
        return (tuple(x + dt * v for x, v in zip(q, qd, strict=True)), qd), qdd, tau


class RungeKutta4(AbstractIntegrator):
    """The classical Runge-Kutta method of order 4; the control law is evaluated at every stage, as if continuous.

    The stages are a loop: written out, XLA would compute each stage again for every number of the next.

    Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), section II.1.
    """

    span: ClassVar[int] = 2
    stages: ClassVar[tuple[int, ...]] = (0, 1, 1, 2)

    def step(self, law: Law, moments: Any, state: State, dt: Scalar) -> tuple[State, Scalars, Scalars]:
        """Four evaluations of the law."""
        q, qd = state
        n = len(q)
        reach = dt * jnp.array([0.0, 0.5, 0.5, 1.0])
        weight = dt * jnp.array([1.0, 2.0, 2.0, 1.0]) / 6.0

        def stage(carry, x):
            (slope_q, slope_qd), (sum_q, sum_qd) = carry
            moment, h, b = x
            here = [q[i] + h * slope_q[i] for i in range(n)], [qd[i] + h * slope_qd[i] for i in range(n)]
            qdd, tau = law(moment, *here)
            sums = tuple(sum_q[i] + b * here[1][i] for i in range(n)), tuple(sum_qd[i] + b * qdd[i] for i in range(n))
            return ((tuple(here[1]), tuple(qdd)), sums), (tuple(qdd), tuple(tau))

        zeros = tuple(jnp.zeros_like(x) for x in q)
        start = ((zeros, zeros), (q, qd))
        (_, end), (qdd, tau) = jax.lax.scan(stage, start, (moments, reach, weight))
        return end, *jax.tree.map(lambda x: x[0], (qdd, tau))
