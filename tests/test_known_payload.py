"""A mass that the tool carried in one recording, and that is known, tells wrong torque constants from wrong masses."""

import dataclasses
from functools import cache

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from helpers import random_robot, random_robot_xml

from irb140_jax import dynamics
from irb140_jax.cli.payloads import known_payloads
from irb140_jax.errors import InputError
from irb140_jax.mismatch import diagnose
from irb140_jax.oracle.mujoco import inverse_dynamics, oracle_model
from irb140_jax.recordings import Payload, Recording
from irb140_jax.recordings.conceal import Concealment, conceal
from irb140_jax.recordings.conceal import random_robot as plant
from irb140_jax.recordings.concealed.plant import arm_spec
from irb140_jax.recordings.excite import three_motions
from irb140_jax.recordings.payload import carrying, inertials_per_metre
from irb140_jax.robot import Robot, robot_from_model, with_phi

MASS, OFF = 2.0, (0.01, -0.02, 0.02)  # kg, m: it does not hang where it is said to


def test_a_carried_body_weighs_as_in_mujoco():
    rng = np.random.default_rng(5)
    robot, bare = random_robot("HSH", 3)
    payload = Payload(0.7, (0.05, -0.1, 0.02), (0.01, 0.0, -0.03))
    spec = mujoco.MjSpec.from_string(random_robot_xml(3, 3, kinds="HSH"))
    tool = spec.site("tool")
    ball = tool.parent.add_body(pos=tool.pos, quat=tool.quat)
    ball.mass, ball.inertia, ball.explicitinertial = payload.mass, 1e-12 * np.ones(3), True
    ball.ipos = np.add(payload.at, payload.off)
    moving = rng.normal(size=(3, robot.n))
    more = [inverse_dynamics(m, *moving) for m in (oracle_model(spec.compile()), bare)]
    ours = [dynamics.inverse_dynamics(r, *map(jnp.asarray, moving)) for r in (carrying(robot, payload), robot)]
    np.testing.assert_allclose(ours[0] - ours[1], more[0] - more[1], rtol=1e-7, atol=1e-7)


def test_its_inertials_change_along_the_tools_axes_as_differences_say():
    robot, step = random_robot("HSH", 3)[0], 1e-6
    at = lambda x: Payload(0.7, (0.05, -0.1, 0.02), tuple(x))  # noqa: E731
    phi = lambda x: np.asarray(carrying(robot, at(x)).phi)[-1]  # noqa: E731
    numeric = np.stack([(phi(step * e) - phi(-step * e)) / (2.0 * step) for e in np.eye(3)], axis=1)
    np.testing.assert_allclose(inertials_per_metre(robot, at(np.zeros(3))), numeric, atol=1e-8)


@cache
def arm() -> tuple[Robot, list[Recording]]:
    """An arm with inertials 5 % wrong, and three motions, in the last of which it carries a mass."""
    xml = plant(2, 3, slides=0.0)
    robot = robot_from_model(arm_spec(xml).compile(), "random")
    motions = three_motions(robot, 8.0, 250.0, seed=2)
    there = np.asarray(robot.tool_position) + np.asarray(robot.tool_rotation) @ OFF
    carried = Concealment("payload", (), parameters={"mass": MASS, **dict(zip("xyz", there.tolist(), strict=True))})
    bare, loaded = (conceal(xml, hidden, motions, seed=3).recordings for hidden in ((), (carried,)))
    return robot, [*bare[:2], dataclasses.replace(loaded[2], payload=Payload(MASS))]


def test_torque_constants_that_are_all_wrong_are_named():
    robot, recordings = arm()
    diagnosis = diagnose(robot, [dataclasses.replace(r, tau=1.15 * r.tau) for r in recordings]).diagnosis
    (finding,) = diagnosis.findings
    assert (finding.effect, finding.joints) == ("torque_gain", robot.joint_names)
    gain = finding.parameters["gain"]
    assert gain.value and gain.std
    assert abs(gain.value * 1.15 - 1.0) < 0.03 and abs(gain.value - 1.0 / 1.15) < 2.0 * gain.std
    assert "by what the known payload adds to it" in finding.certain
    assert diagnosis.verdict == "physics_left_out" and not diagnosis.unexplained
    (note,) = [n for n in diagnosis.notes if "carries 2 kg" in n]
    assert note.endswith("the fit moves it by 1.0, -2.0, 2.0 cm.")


def test_masses_that_are_all_wrong_are_no_torque_constant():
    robot, recordings = arm()
    lighter = with_phi(robot, robot.phi / 1.15)
    diagnosis = diagnose(lighter, recordings).diagnosis
    assert (diagnosis.verdict, diagnosis.findings) == ("parameters_only", ())


def test_payloads_are_given_by_recording(tmp_path):
    bare, loaded = tmp_path / "bare.csv", tmp_path / "loaded.csv"
    said = known_payloads((f"{loaded}=2.5@0,0,0.05", "bare.csv=1"), (bare, loaded))
    assert said == {loaded: Payload(2.5, (0.0, 0.0, 0.05)), bare: Payload(1.0)}


@pytest.mark.parametrize(
    "words", [("loaded.csv",), ("loaded.csv=-1",), ("loaded.csv=2.5@0,0",), ("loaded.csv=2 kg",), ("other.csv=2",),
              ("loaded.csv=nan",), ("loaded.csv=1", "loaded.csv=2")]
)  # fmt: skip
def test_a_payload_that_is_none_is_refused_with_what_would_be(words, tmp_path):
    with pytest.raises(InputError, match="--known-payload"):
        known_payloads(words, (tmp_path / "bare.csv", tmp_path / "loaded.csv"))
