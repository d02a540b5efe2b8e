"""Plants on servos: MuJoCo's torques against recursive Newton-Euler, and forms of a case that tell of one motion."""

from functools import cache

import numpy as np
import pytest

from testbed import rigid
from testbed.arms import built, irb140, random_arm
from testbed.motions import STEP, fourier
from testbed.plants import Plant, sizes_of
from testbed.scoring import stated_classes
from testbed.servos import KINDS, LAWS, Form, Loop, make_servo, simulated


def loop_of(arm, rng):
    sizes = sizes_of(arm, [fourier(arm, rng, 2.0)])
    inertia, swing = sizes.inertia + arm.rotor, 2.0 * np.pi * 5.0
    return Loop(Plant(arm, built(arm, rng, 0.1)), inertia * swing**2, 1.4 * inertia * swing), sizes


def accelerations(q):
    return np.gradient(np.gradient(q, STEP, axis=0), STEP, axis=0)


@pytest.mark.parametrize("name", ["irb140", "random"])
def test_the_motors_torque_is_what_newton_and_euler_ask_along_the_motion(name):
    rng = np.random.default_rng(3)
    arm = irb140() if name == "irb140" else random_arm(rng, 4)
    loop, _ = loop_of(arm, rng)
    loop.damping[:] = 0.5
    motion = fourier(arm, rng, 2.0)
    q, qd, tau = simulated(loop, motion, motion.q)
    asked = rigid.torque(loop.plant.arm, q, qd, accelerations(q)) + loop.damping * qd
    inner = slice(200, -200)
    off = np.sqrt(np.mean((tau - asked)[inner] ** 2, axis=0)) / np.sqrt(np.mean(tau[inner] ** 2, axis=0)).max()
    assert off.max() < 3e-3


def test_the_motor_s_torque_is_the_servos_law():
    rng = np.random.default_rng(4)
    arm = random_arm(rng, 3)
    loop, _ = loop_of(arm, rng)
    loop.plant.zero[1] = 0.03
    motion = fourier(arm, rng, 2.0)
    q, qd, tau = simulated(loop, motion, motion.q)
    law = loop.kp * (motion.q - (q + loop.plant.zero)) - loop.kd * qd
    np.testing.assert_allclose(tau, law, atol=1e-6 * np.abs(tau).max())


def test_a_stiff_second_joint_is_none_and_a_soft_one_is_seen():
    rng = np.random.default_rng(5)
    arm = random_arm(rng, 2)
    loop, sizes = loop_of(arm, rng)
    motion = fourier(arm, rng, 1.0)
    none = simulated(loop, motion, motion.q)[0]
    KINDS["joint_elasticity"](loop, sizes, rng, 1, 1.0)
    assert loop.second is not None
    j, stiffness, damping, gap = loop.second
    assert (j, gap) == (1, 0.0)
    soft = simulated(loop, motion, motion.q)[0]
    loop.second = (j, 400.0 * stiffness, 20.0 * damping, gap)
    stiff = simulated(loop, motion, motion.q)[0]
    assert np.abs(stiff - none).max() < 0.1 * np.abs(soft - none).max()


@cache
def without_any(seed):
    """The torque of the motors of a plant in which nothing is hidden."""
    loop, _, motion, _ = plant_of(seed)
    return simulated(loop, motion, motion.q)[2]


def plant_of(seed):
    rng = np.random.default_rng(seed)
    arm = random_arm(rng, 3)
    loop, sizes = loop_of(arm, rng)
    return loop, sizes, fourier(arm, rng, 2.0), rng


@pytest.mark.parametrize("kind", sorted(KINDS | LAWS))
def test_every_kind_moves_otherwise_and_says_what_is_true(kind):
    bare, (loop, sizes, motion, rng) = without_any(6), plant_of(6)
    (KINDS | LAWS)[kind](loop, sizes, rng, 1, 0.2 * float(sizes.tau[1]))
    assert loop.plant.hidden and loop.plant.hidden[-1].accept
    with_it = simulated(loop, motion, motion.q)[2]
    assert np.isfinite(with_it).all()
    assert np.sqrt(np.mean((with_it - bare)[:, 1] ** 2)) > 1e-3 * sizes.tau[1]


def test_forms_of_a_case_tell_of_the_same_motion():
    forms: tuple[Form, ...] = ("torque", "wrong", "unknown")  # "known" differs from "wrong" in its model's gains alone
    cases = {form: make_servo("work", 1, form) for form in forms}  # two joints, the quickest
    first = {form: case.recordings[0] for form, case in cases.items()}
    for r in first.values():
        np.testing.assert_array_equal(r["q"], first["torque"]["q"])
    assert "qdes" not in first["torque"] and all("tau" not in first[form] for form in forms[1:])
    assert "position" not in cases["unknown"].xml and "<position" in cases["wrong"].xml
    for case in cases.values():
        assert [h["slug"] for h in case.truth["hidden"]] == ["coulomb_friction"] * 2 + ["viscous_friction"] * 2
        assert stated_classes({"truth": case.truth, "diagnosis": {"findings": []}}) == []
