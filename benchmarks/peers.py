# pyright: reportMissingImports=false, reportAttributeAccessIssue=false
"""The same arm in Pinocchio, the peer (`pip install pin`)."""

import numpy as np
import pinocchio as pin

from irb140_jax.robot import Robot

# Pinocchio's inertial parameters are ours with Iyy before Ixz.
OUR_ORDER = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]


def pinocchio_model(robot: Robot) -> pin.Model:
    """The robot as a Pinocchio model: hinges only, as the IRB 140 has."""
    model = pin.Model()
    model.gravity = pin.Motion(np.asarray(robot.gravity), np.zeros(3))
    parent = 0
    for i in range(robot.n):
        place = pin.SE3(np.array(robot.rotation[i]), np.array(robot.position[i]))
        joint = _aligned(np.array(robot.axis[i]))
        parent = model.addJoint(parent, joint, place, robot.joint_names[i])
        inertia = pin.Inertia(float(robot.mass[i]), np.array(robot.com[i]), np.array(robot.inertia[i]))
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
    model.armature = np.array(robot.armature)
    return model


def _aligned(axis: np.ndarray):
    """The joint type Pinocchio is fastest with."""
    return (pin.JointModelRX(), pin.JointModelRY(), pin.JointModelRZ())[int(np.argmax(np.abs(axis)))]


def regressor_loop(model: pin.Model, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """All regressors, stacked, shape (T n, 10 n), columns as in `Robot.phi`."""
    data, n = model.createData(), model.nv
    Y = np.empty((len(q), n, 10 * n))
    for k in range(len(q)):
        Y[k] = pin.computeJointTorqueRegressor(model, data, q[k], qd[k], qdd[k])
    return Y.reshape(-1, 10 * n)


def our_columns(n: int) -> np.ndarray:
    """Where our parameters stand among Pinocchio's."""
    return np.concatenate([10 * i + np.array(OUR_ORDER) for i in range(n)])
