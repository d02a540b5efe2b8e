"""Payload: a mass on the last link that is not in the model."""

import numpy as np

from irb140_jax.arrays import on_device
from irb140_jax.effects.base import Effect
from irb140_jax.effects.records import Export, Law, Parameter, Place, Prior, all_joints
from irb140_jax.robot import about_origin, with_phi

REACH = 0.1  # [m] about which what is held lies off the tool: ties moments and inertias to the mass where data don't
SIZES = np.repeat([1.0, REACH, REACH**2], [1, 3, 6])


def _columns(motion, joints, shape):
    """tau = Y_tool phi_payload: mass, first moment and inertia of a body held by the last link, about the tool."""
    return motion.rigid.held * SIZES


def _from_physical(values):
    c = np.array([values.get(k, 0.0) for k in "xyz"])
    inertia = c @ c * np.eye(3) - np.outer(c, c)
    return values["mass"] * np.concatenate([[1.0], c, inertia[np.triu_indices(3)]]) / SIZES, np.zeros(0)


def _in_model(robot, joints, w, shape):
    return with_phi(robot, robot.phi.at[-1].add(about_origin(robot.tool_position) @ on_device(w * SIZES)))


EFFECT = Effect(
    slug="payload",
    title="an unmodelled payload",
    needs="motion of the last link in several orientations, slow and fast",
    confused_with={
        "gravity_tilt": "the same poses with and without a known mass",
        "torque_gain": "the same motion with and without a known payload",
    },
    where="in the weight and inertia of the last link, {mass} more than in the model",
    law=Law(
        equation="Y_tool(q, qd, qdd) [m, m c, I]",
        source="Khalil, Gautier, Lemoine, Identification of the payload inertial parameters, ICRA 2007",
        parameters=(Parameter("mass", "kg", low=0.0),),
        columns=_columns,
        to_physical=lambda w, shape: w[:1],
        from_physical=_from_physical,
        variants=(tuple(range(10)),),
        own=tuple(range(10)),
    ),
    place=Place(sites=all_joints, everywhere=True),
    # Most likely a mass at the tool itself.
    prior=Prior(lowest=(0.0, *(-np.inf,) * 9), tied=True, proportion=(1.0, *(0.0,) * 9)),
    export=Export(mjcf="the last link's inertial", in_model=_in_model),
)
