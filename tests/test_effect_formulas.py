"""Columns of every effect against the contract's equations, written down once more."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from helpers_effects import SCALES, a_shape, every_effect, motion, robot, some_values

from irb140_jax.effects.backlash import STEPS, _flight, _scan
from irb140_jax.effects.catalogue import CATALOGUE

# The contract's equations written down once more: parameters, then qd, qdd, load and total torque of the site, (T, m).
SIGN = {"sign": -1.0}
LAWS = {
    "coulomb_friction": lambda p, v, a, load, total: p["coulomb"] * np.sign(v),
    "viscous_friction": lambda p, v, a, load, total: p["viscous"] * v,
    "asymmetric_friction": lambda p, v, a, load, total: np.where(v > 0, p["coulomb_pos"], -p["coulomb_neg"]),
    "stribeck_friction": lambda p, v, a, load, total: np.sign(v) * (
        p["coulomb"] + (p["static"] - p["coulomb"]) * np.exp(-((v / p["stribeck_velocity"]) ** 2))),
    "load_dependent_friction": lambda p, v, a, load, total: np.sign(v) * (
        p["coulomb"] + p["load_coefficient"] * np.abs(load)),
    "rotor_inertia": lambda p, v, a, load, total: p["inertia"] * a,
    "torque_offset": lambda p, v, a, load, total: np.full_like(v, p["offset"]),
    "torque_gain": lambda p, v, a, load, total: total / p["gain"] - total,
    "transmission_coupling": lambda p, v, a, load, total: np.stack([
        p["viscous"] * (v[:, 0] - v[:, 1]) + p["coulomb"] * np.sign(v[:, 0] - v[:, 1]),
        p["viscous"] * (v[:, 1] - v[:, 0]) + p["coulomb"] * np.sign(v[:, 1] - v[:, 0])], axis=1),
    "nonlinear_viscous_friction": lambda p, v, a, load, total: (
        p["coefficient"] * np.abs(v) ** p["exponent"] * np.sign(v)),
}  # fmt: skip


def dahl(p, q):
    """F -> Fc s + (F - Fc s) exp(-stiffness |dq| / Fc), step by step."""
    force = np.zeros_like(q)
    for k in range(1, len(q)):
        dq = q[k] - q[k - 1]
        limit = p["coulomb"] * np.sign(dq)
        force[k] = limit + (force[k - 1] - limit) * np.exp(-p["stiffness"] * np.abs(dq) / p["coulomb"])
    return force


def of_link(m, j):
    """Load, and what the link's own motion u makes of it: mass, damping, spring; each (T,)."""
    own = (np.asarray(x)[:, j, j] for x in (m.rigid.mass, m.rigid.by_qd, m.rigid.by_q))
    return np.asarray(m.carried)[:, j], *own


def moved(m, j, bend):
    """Torque on all joints that a link displaced by u, du/dt, d2u/dt2 no longer needs, (T, n)."""
    parts = (m.rigid.by_q, m.rigid.by_qd, m.rigid.mass)
    return -sum(np.asarray(x)[:, :, j] * u[:, None] for x, u in zip(parts, bend, strict=True))


def swing(p, m, j):
    """Newmark's rule, step by step, for a link on a spring K with 5 % of critical damping."""
    load, mass, damping, spring = of_link(m, j)
    K, dt, gamma = p["stiffness"], float(m.t[1] - m.t[0]), 0.55
    beta = 0.25 * (gamma + 0.5) ** 2
    damping, spring = damping + 0.1 * np.sqrt(K * mass), spring + K
    u, v, a, out = load[0] / spring[0], (load[1] / spring[1] - load[0] / spring[0]) / dt, 0.0, []
    for k in range(len(load)):
        ahead, rate = u + dt * v + dt**2 * (0.5 - beta) * a, v + dt * (1 - gamma) * a
        a = (load[k] - damping[k] * rate - spring[k] * ahead) / (
            mass[k] + gamma * dt * damping[k] + beta * dt**2 * spring[k])
        u, v = ahead + beta * dt**2 * a, rate + gamma * dt * a
        out.append((u, v, a))
    return np.transpose(out)


def flight(p, m, j):
    """A free link between two springy flanks, in quarters of a sample, step by step; derivatives by differences."""
    load, mass, damping, spring = of_link(m, j)
    half, K, dt = 0.5 * p["gap"], p["flank_stiffness"], float(m.t[1] - m.t[0])
    bends = lambda all_: 1 - mass[k] / h**2 / all_  # noqa: E731 - its share of a step later, the load of a spring
    h, side = dt / 4, np.sign(load[0])
    u = before = side * half + load[0] / (K + spring[0])
    path = []
    for k in range(len(load)):
        for i in range(1, 5):
            begin, rise = load[max(k - 1, 0)], (load[k] - load[max(k - 1, 0)]) / 4
            push = begin + rise * (i - 1) + mass[k] / h**2 * (2 * u - before) + damping[k] / h * u
            stay = mass[k] / h**2 + damping[k] / h + spring[k]
            new = (push + rise * bends(stay)) / stay
            if abs(new) > half:
                c = 2 * p["flank_damping"] * np.sqrt(K * mass[k]) / h
                held = stay + K + c
                new = (push + rise * bends(held) + K * half * np.sign(new) + c * u) / held
            u, before = new, u
        path.append(u)
    path = np.array(path)
    held = np.concatenate([path[:1], path, path[-1:]])
    return path, (held[2:] - held[:-2]) / (2 * dt), (held[2:] - 2 * path + held[:-2]) / dt**2


# Those that look at more than speed and load: of parameters, motion, joint; torque of it (T, 1) or of all (T, n).
AT = lambda x, j: np.asarray(x)[:, j : j + 1]  # noqa: E731
FOUR = (  # Gauss and Legendre's points and weights
    (-0.8611363115940526, 0.3478548451374538), (-0.3399810435848563, 0.6521451548625461),
    (0.3399810435848563, 0.6521451548625461), (0.8611363115940526, 0.3478548451374538),
)  # fmt: skip


def shifted(p, m):
    """What a delay of all torques adds, by Gauss and Legendre's rule."""
    at = [m.t + 0.5 * (1.0 + u) * p["delay"] for u, _ in FOUR]
    slopes = [sum(0.5 * w * np.interp(x, m.t, rate) for x, (_, w) in zip(at, FOUR, strict=True))
              for rate in np.asarray(m.scaled_rate).T]  # fmt: skip
    return p["delay"] * np.stack(slopes, axis=1)


LAWS_OF_MOTION = {
    "thermal_friction_drift": lambda p, m, j: AT(m.qd, j) * p["viscous_cold"] * (
        1 - p["relative_drop"] * (1 - np.exp(-np.asarray(m.t)[:, None] / p["time_constant"]))),
    "position_dependent_friction": lambda p, m, j: np.sign(AT(m.qd, j)) * p["coulomb"] * (
        1 + p["depth"] * np.exp(-(((AT(m.q, j) - p["centre"]) / p["width"]) ** 2))),
    "presliding_hysteresis": lambda p, m, j: dahl(p, AT(m.q, j)),
    "torque_ripple": lambda p, m, j: p["amplitude"] * np.sin(2 * np.pi * p["cycles_per_rad"] * AT(m.q, j)),
    "actuator_lag": lambda p, m, j: p["time_constant"] * AT(m.scaled_rate, j),
    "time_delay": lambda p, m, j: shifted(p, m),
    "channel_skew": lambda p, m, j: shifted(p, m)[:, [j]],
    "torque_saturation": lambda p, m, j: AT(m.asked.torque, j) - np.clip(
        AT(m.asked.torque, j), -p["limit"], p["limit"]),
    "servo_deadband": lambda p, m, j: float(m.asked.kp[j]) * np.where(
        np.abs(AT(m.asked.error, j)) < p["width"], AT(m.asked.error, j), p["width"] * np.sign(AT(m.asked.error, j))),
    "back_emf": lambda p, m, j: np.where(
        AT(m.asked.torque, j) > 0,
        np.maximum(AT(m.asked.torque, j) - p["stall_torque"] * np.clip(1 - AT(m.qd, j) / p["no_load_speed"], 0, 2), 0),
        np.minimum(AT(m.asked.torque, j) + p["stall_torque"] * np.clip(1 + AT(m.qd, j) / p["no_load_speed"], 0, 2), 0)),
    "gravity_spring": lambda p, m, j: p["stiffness"] * (AT(m.q, j) - p["rest"]),
    "gravity_tilt": lambda p, m, j: p["tilt"] * float(m.rigid.gravity) * (m.rigid.by_gravity @ m.rigid.across[0]),
    "payload": lambda p, m, j: p["mass"] * np.asarray(m.rigid.held)[:, :, 0],
    "encoder_offset": lambda p, m, j: -p["offset"] * np.asarray(m.rigid.by_q)[:, :, j],
    "joint_elasticity": lambda p, m, j: moved(m, j, swing(p, m, j)),
    "backlash": lambda p, m, j: moved(m, j, flight(p, m, j)),
    "contact": lambda p, m, j: -np.stack([
        p["stiffness"] * max(p["position"] - n @ x, 0.0) * (J[:, :3] @ n)
        for n in [np.array([p["normal_x"], p["normal_y"], p["normal_z"]])]
        for x, J in zip(np.asarray(m.rigid.tool), np.asarray(m.rigid.tool_jacobian), strict=True)]),
    "external_wrench": lambda p, m, j: -np.stack([
        (1 / (1 + np.exp(-2 * (t - p["t0"]) / p["rise"])) - 1 / (1 + np.exp(-2 * (t - p["t1"]) / p["rise"])))
        * (J @ [p[f"{of}_{axis}"] for of in ("force", "moment") for axis in "xyz"])
        for t, J in zip(np.asarray(m.t), np.asarray(m.rigid.tool_jacobian), strict=True)]),
}  # fmt: skip


@every_effect
def test_columns_are_the_formula_of_the_contract(effect):
    columns = eqx.filter_jit(effect.law.columns)
    for site in range(len(effect.place.sites(robot()))):
        for seed in range(3):
            joints, _ = a_shape(effect, site)
            m, values = motion(seed), some_values(effect, seed)
            w, shape = effect.law.amplitudes(values | SIGN)
            torque = columns(m, joints, jnp.asarray(shape)) @ jnp.asarray(w)
            if effect.slug in LAWS_OF_MOTION:
                law = LAWS_OF_MOTION[effect.slug](values, m, int(joints[0]))
                np.testing.assert_allclose(torque, law, rtol=1e-10, atol=1e-10)
                continue
            along = (np.asarray(x)[:, joints] for x in (m.qd, m.qdd, m.load, m.total))
            np.testing.assert_allclose(torque, LAWS[effect.slug](values, *along), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("slug", ["time_delay", "channel_skew"])
def test_a_delays_finer_grid_is_the_delay_that_was_found(slug):
    shapes = CATALOGUE[slug].shapes
    assert shapes.finer and shapes.follows
    grid = np.linspace(-0.016, 0.016, 33)[:, None]
    finer = shapes.finer(grid, shapes.follows(np.array([-0.0111]), np.array([-0.0045])))
    np.testing.assert_allclose(finer, np.full((33, 1), -0.00555))


@pytest.mark.parametrize("delay", [0.003, 0.0185, -0.031])
def test_a_delay_that_is_on_the_grid_is_right_up_to_the_highest_frequency(delay):
    t, omega = np.arange(0.0, 2.0, 0.005), 2.0 * np.pi * 20.0
    rate = jnp.asarray(omega * np.cos(omega * t))[:, None]
    m = dataclasses.replace(motion(0), t=jnp.asarray(t), scaled_rate=rate)
    law = CATALOGUE["time_delay"].law
    w, shape = law.amplitudes({"delay": delay})
    made = np.asarray(law.columns(m, jnp.arange(1), jnp.asarray(shape)))[:, 0, 0] * w[0]
    inside = (t > 0.1) & (t < 1.9)  # rates are interpolated between samples: 3 % at 20 Hz
    np.testing.assert_allclose(made[inside], (np.sin(omega * (t + delay)) - np.sin(omega * t))[inside], atol=0.09)


@pytest.mark.parametrize("mass", [0.2, 3.0])
def test_a_free_link_is_flung_as_far_as_its_load_says_and_no_earlier(mass):
    t = np.arange(0.0, 1.0, 0.005)
    rate, leaves, gap, flank = 6.0 * mass * 0.02 / 0.3**3, 0.2, 0.02, 1e6
    zero = np.zeros(len(t))
    u = np.asarray(_flight(rate * (t - leaves), zero + mass, zero, zero, gap, flank, 0.5, 0.005))
    # From the flank at -gap/2 on which the load pressed it, at rest until the load turns over.
    free = (t > leaves) & (t < leaves + 0.27)
    path = -0.5 * gap + rate * (t - leaves) ** 3 / (6.0 * mass)
    speed = rate * (t - leaves) ** 2 / (2.0 * mass)
    late = (path - u)[free] / np.maximum(speed[free], 0.01)
    assert np.abs(late[-10:]).max() < 0.3 * 0.005 / STEPS
    np.testing.assert_allclose(u[t > 0.9], 0.5 * gap + rate * (t[t > 0.9] - leaves) / flank, atol=1e-4 * gap)


def test_the_more_a_flank_is_damped_the_less_a_link_bounces_off_it():
    t = np.arange(0.0, 1.0, 0.005)
    one = np.ones(len(t))
    back = [0.01 - np.asarray(_flight(5.0 * one * np.sign(t - 0.2), one, 0 * one, 0 * one, 0.02, 1e4, d, 0.005))[
        t > 0.3].min() for d in (0.05, 0.2, 0.8)]  # fmt: skip
    assert back[0] > 1.5 * back[1] > 1.5**2 * max(back[2], 0.0)


@pytest.mark.parametrize("noise", [1e-5, 1e-3])
def test_no_gap_below_ten_times_the_encoders_noise_is_looked_for(noise):
    """A gap of a few of them takes that noise out of the model's torque, and explains it."""
    gaps = _scan(SCALES._replace(q_noise=np.full(4, noise)), np.array([1]))[:, 0]
    assert gaps.min() >= 10.0 * noise
    assert gaps.max() > 10.0 * gaps.min()
