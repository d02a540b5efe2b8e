"""Forward dynamics: accelerations from torques."""

import jax
import jax.scipy.linalg

from irb140_jax.dynamics.chain import Plan, chain, plan
from irb140_jax.dynamics.mass import mass_matrix
from irb140_jax.dynamics.newton_euler import rigid_torque
from irb140_jax.dynamics.passive import passive_torque
from irb140_jax.dynamics.stage import always, staged
from irb140_jax.robot import Robot
from irb140_jax.shapes import shape_checked
from irb140_jax.types import Joints


@shape_checked
def forward_dynamics(robot: Robot, q: Joints, qd: Joints, tau: Joints) -> Joints:
    """Joint accelerations, qdd = M(q)^-1 (tau - C(q, qd) qd - g(q) - passive).

    Args:
        robot: Arm with n joints.
        q: Joint positions [rad or m].
        qd: Joint velocities [rad/s or m/s].
        tau: Joint torques [N m or N].

    Returns:
        Joint accelerations [rad/s^2 or m/s^2].

    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), sec. 6.1, inertia matrix method.
    """
    return _forward_dynamics(robot, plan(robot), q, qd, tau)


@jax.jit
def _forward_dynamics(robot: Robot, ahead: Plan, q: Joints, qd: Joints, tau: Joints) -> Joints:
    # Stored apart, so that XLA compiles the mass matrix and the bias as two programs rather than one entangled.
    M = staged(always(q, qd), lambda: mass_matrix(robot, q))
    bias = rigid_torque(chain(robot, ahead), q, qd, None) + passive_torque(robot, q, qd)
    return jax.scipy.linalg.solve(M, tau - bias, assume_a="pos")
