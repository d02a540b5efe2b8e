"""Laws that MJCF has no numbers for, in simulations of the corrected model."""

import json

import mujoco
import numpy as np
import pytest
from helpers import random_robot

from irb140_jax import CorrectedMujoco
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.columns.torques import Named
from irb140_jax.mismatch.corrected.model import CorrectedModel, to_json
from irb140_jax.mismatch.motion.laws import law_of, without_those
from irb140_jax.mismatch.motion.models import FILE, compiled_robot, positions_of, simulated
from irb140_jax.oracle.rollout import positions_under_law, simulated_model
from irb140_jax.recordings.drive import stated_drive
from irb140_jax.recordings.low_pass import Band

STEP, CONSTANT, SLOPE = 1e-3, 0.05, 0.3
PENDULUM = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"/><worldbody>
  <body><joint name="hinge" axis="0 1 0" damping="0.02" frictionloss="0.01"/>
    <inertial pos="0 0 -0.1" mass="0.5" diaginertia="1e-4 1e-4 1e-4"/></body>
</worldbody><actuator><position joint="hinge" kp="2" kv="0.05"/></actuator></mujoco>"""


def stepped(control: np.ndarray) -> np.ndarray:
    """Positions by MuJoCo step by step, whose level follows the forces that MuJoCo itself reports."""
    model = simulated_model(PENDULUM, STEP)
    data, out = mujoco.MjData(model), []
    for u in control:
        out.append(data.qpos[0])
        load = data.qfrc_actuator[0] + data.qfrc_passive[0] + data.qfrc_constraint[0]  # damping is friction, too
        model.dof_frictionloss[0] = 0.01 + CONSTANT + SLOPE * abs(load)
        data.ctrl[:] = u
        mujoco.mj_step(model, data)
    return np.array([*out, data.qpos[0]])


def test_friction_that_grows_with_load_acts_as_step_by_step():
    t = np.arange(4000) * STEP
    control = 1.2 * np.sin(2.0 * np.pi * 0.6 * t) + 0.3 * np.sin(2.0 * np.pi * 1.7 * t)
    friction = lambda t, q, qd, load, control: (CONSTANT + SLOPE * np.abs(load), 0.0 * q)  # noqa: E731
    none = np.zeros((1, 1))
    given = np.zeros((1, len(t), 1)), control[None, :, None]
    went = positions_under_law([simulated_model(PENDULUM, STEP)], none, none, *given, friction)[0, :, 0]
    without = positions_under_law(
        [simulated_model(PENDULUM, STEP)], none, none, *given, lambda t, q, *_: (0.0 * q, 0.0 * q)
    )[0, :, 0]
    true = stepped(control)
    apart = lambda x: float(np.sqrt(np.mean((x - true) ** 2)))  # noqa: E731
    # Held for 5 ms each time, and by accelerations that are as old.
    assert apart(went) < 0.05 * apart(without) and apart(without) > 0.02


KP = 20.0


@pytest.mark.parametrize(
    ("slug", "amplitudes", "shape", "level", "torque"),
    [
        ("load_dependent_friction", (0.2, 0.3), (), lambda q, qd, load, u: 0.2 + 0.3 * np.abs(load), None),
        ("stribeck_friction", (0.2, 0.1), (0.5,), lambda q, qd, load, u: 0.2 + 0.1 * np.exp(-((qd / 0.5) ** 2)), None),
        ("asymmetric_friction", (0.3, 0.2), (), lambda q, qd, load, u: np.where(qd > 0.0, 0.3, 0.2), None),
        ("nonlinear_viscous_friction", (0.4,), (2.0,), lambda q, qd, load, u: 0.4 * (qd**2 + 1e-8), None),
        ("servo_deadband", (1.0,), (0.3,), lambda q, qd, load, u: 0.0,
         lambda q, u: 2.0 * KP * np.clip(u - q, -0.3, 0.3)),
    ],
)  # fmt: skip
def test_a_law_is_parted_into_what_holds_and_what_pushes(slug, amplitudes, shape, level, torque):
    robot, rng, joint = random_robot("HSH", 3)[0], np.random.default_rng(0), 1
    effect, phi = CATALOGUE[slug], np.asarray(robot.phi)
    named = Named(effect, (joint,), tuple(range(effect.law.width)), np.array(amplitudes), np.array(shape))
    model = CorrectedModel(robot, phi, phi, (named,), Band(10.0, 16.0, 200.0, 4), np.full(robot.n, 0.01))
    drive, gear = stated_drive(np.full(robot.n, KP), np.zeros(robot.n)), np.full(robot.n, 2.0)
    law = law_of([model] * 5, [drive] * 5, [gear] * 5, np.zeros(5))
    assert law is not None
    q, qd, load, control = rng.normal(size=(4, 5, robot.n))
    holds, pushes = law(np.zeros(5), q, qd, load, control)
    only = np.arange(robot.n) == joint
    np.testing.assert_allclose(holds, np.where(only, level(q, qd, load, control), 0.0) + 0.0 * q, atol=1e-12)
    np.testing.assert_allclose(pushes, np.where(only, torque(q, control) if torque else 0.0, 0.0) + 0.0 * q, atol=1e-12)
    assert not without_those(model).named and law_of([without_those(model)], [drive], [gear], np.zeros(1)) is None


def test_a_users_own_simulation_goes_where_the_proof_in_motion_goes(tmp_path):
    """Servos on a random arm whose friction grows with load, stepped by MuJoCo alone."""
    robot = random_robot("HHH", 5)[0]
    n, phi = robot.n, np.asarray(robot.phi)
    effect = CATALOGUE["load_dependent_friction"]
    named = tuple(Named(effect, (j,), (0, 1), np.array([0.1, 0.2]), np.zeros(0)) for j in range(n))
    drive = stated_drive(np.full(n, 200.0), np.full(n, 20.0))
    model = CorrectedModel(robot, phi, phi, named, Band(10.0, 16.0, 200.0, 4), np.full(n, 0.01), drive=drive)
    (tmp_path / "model.json").write_text(json.dumps(to_json(model)))
    t = np.arange(1500) * STEP
    control = 0.5 * np.sin(2.0 * np.pi * np.array([0.7, 0.9, 1.3]) * t[:, None])
    made = simulated(model, compiled_robot(robot, STEP), STEP)
    assert made is not None
    still = np.zeros((1, n))
    given = np.zeros((1, *control.shape)), control[None], np.zeros(1)
    ours = {name: positions_of([made], name, [drive], still, still, *given) for name in ("corrected", FILE)}
    taken = CorrectedMujoco(tmp_path)
    taken.model.opt.timestep, taken.model.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    taken.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    data, went = mujoco.MjData(taken.model), []
    data.qpos[:] = 0.0
    for u in control:
        went.append(data.qpos.copy())
        data.ctrl[:] = u
        taken.act(data)
        mujoco.mj_step(taken.model, data)
    apart = {name: np.abs(x[0, :-1] - np.array(went)).max() for name, x in ours.items()}
    assert apart["corrected"] < 0.05 * apart[FILE] and apart[FILE] > 0.01
