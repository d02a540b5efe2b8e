"""Recordings of an arm in which MuJoCo hides physics: what a diagnosis is judged on.

A controller that knows the nominal model drives a true arm with wrong inertials and hidden effects.  The truth is
sealed by its hash before anyone sees the recordings, so that a diagnosis can be shown to have been blind.
"""

import dataclasses
import hashlib
import json
import pathlib
from collections.abc import Sequence

import mujoco
import numpy as np
from scipy import interpolate, signal

from irb140_jax.errors import InputError
from irb140_jax.recordings.concealed.catalogue import FIRST_NINE
from irb140_jax.recordings.concealed.choice import Concealment as Concealment
from irb140_jax.recordings.concealed.choice import chosen, meaningful_sites
from irb140_jax.recordings.concealed.closed_loop import Log, closed_loop
from irb140_jax.recordings.concealed.hidden import Hidden, Survey, survey_of
from irb140_jax.recordings.concealed.plant import arm_model, arm_spec, perturb_inertials, rigid_torque
from irb140_jax.recordings.concealed.random_robot import random_robot as random_robot
from irb140_jax.recordings.excite import Excitation, three_motions
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import irb140_path, robot_from_model


@dataclasses.dataclass(frozen=True)
class Noise:
    """What the sensors add to the log.

    Attributes:
        encoder: Standard deviation of joint positions [rad or m].
        resolution: Step of the encoders [rad or m]; 0: none.
        torque: Standard deviation of the torque, as a share of each joint's torque RMS.
        colour: Correlation of the torque's noise over a hundredth of a second.
        spikes: Share of the torque samples with a spike of up to 30 standard deviations.
        jitter: Standard deviation of the time between samples, as a share of it; the stamps tell the true times.
        lost: Share of the samples lost, in runs of one to eight.
    """

    encoder: float = 2e-5
    resolution: float = 0.0
    torque: float = 0.01
    colour: float = 0.0
    spikes: float = 0.0
    jitter: float = 0.0
    lost: float = 0.0


ROUGH = Noise(
    encoder=0.0, resolution=2.0 * np.pi / 2**17, torque=0.02, colour=0.8, spikes=0.001, jitter=0.1, lost=0.01
)  # a log as cheap controllers write it


@dataclasses.dataclass(frozen=True)
class Secret:
    """What only the judge may look at.

    Attributes:
        hidden: The effects.
        logs: What really happened, one a recording, at every step of the engine.
        rigid: The true arm without the hidden effects: wrong inertials only.
        true: The true arm, effects that MuJoCo has natively included.
        nominal: What the controller believed.
        survey: What the true arm does along the motions without the hidden effects.
    """

    hidden: tuple[Hidden, ...]
    logs: tuple[Log, ...]
    rigid: mujoco.MjModel
    true: mujoco.MjModel
    nominal: mujoco.MjModel
    survey: Survey


@dataclasses.dataclass(frozen=True)
class ConcealedCase:
    """Recordings with physics concealed in them.

    Attributes:
        recordings: What the diagnosis gets.
        robot_source: The nominal model: path of an MJCF file, or MJCF text.
        truth: What was hidden: effects, joints, parameters with units, shares; how much of each joint's torque is
            left out by the true rigid arm in the end (`left_out`); true masses.
        seal: SHA-256 of its effects and their parameters, fit to be published before the diagnosis (see `sealed`).
        secret: What a judge may look at besides.
    """

    recordings: tuple[Recording, ...]
    robot_source: str
    truth: dict
    seal: str
    secret: Secret


def conceal(
    mjcf: str | pathlib.Path, concealments: Sequence[Concealment] = (), motions: Sequence[Excitation] | None = None, *,
    seed: int, noise: Noise | None = None, inertial_error: float = 0.05, rate: float = 500.0, with_speeds: bool = False,
    with_link_encoders: bool = False,
) -> ConcealedCase:
    """Hide effects in an arm and record it in closed loop.

    tau_logged = M qdd + C qd + g + sum of the effects + noise, by MuJoCo, with wrong inertials in M, C and g

    Args:
        mjcf: The nominal model, a path or MJCF text.
        concealments: The effects to hide; none for a clean case.
        motions: What to play; sampled at the step of the engine.  By default Fourier, point to point, and slow.
        seed: Everything random is drawn from it, each thing from a stream of its own.
        noise: Sensor noise, by default that of a good arm.
        inertial_error: Relative standard deviation of the true inertials about the nominal ones.
        rate: Samples per second of the recordings [1/s].
        with_speeds: Whether the recordings hold qd and qdd (true ones, without noise) as well.
        with_link_encoders: Whether they hold positions behind the transmissions, as noisy as the others.

    Returns:
        The case.

    Raises:
        InputError: Unknown effect, joint or parameter, or effects with which the loop is unstable.
    """
    spec = arm_spec(mjcf)
    robot = robot_from_model(spec.compile(), source=str(mjcf)[:80])
    motions = list(motions) if motions is not None else three_motions(robot, seed=seed)
    dt = float(motions[0].t[1] - motions[0].t[0])
    nominal, rigid = arm_model(spec, dt), _true_model(mjcf, (), robot.joint_names, dt, inertial_error, seed)
    survey = survey_of(rigid, motions, every=max(1, round(0.01 / dt)))
    hidden = tuple(chosen(c, survey, robot.joint_names, seed, k) for k, c in enumerate(concealments))
    true = _true_model(mjcf, hidden, robot.joint_names, dt, inertial_error, seed)
    logs = tuple(closed_loop(nominal, true, hidden, motion, recording=k) for k, motion in enumerate(motions))
    noise = noise or Noise()
    step = max(1, round(1.0 / (rate * dt)))
    rngs = [np.random.default_rng([seed, 30, k]) for k in range(len(logs))]
    recordings = tuple(
        _recording(log, name, robot.joint_names, survey, noise, step, with_speeds, rng)
        for log, name, rng in zip(logs, _names(motions), rngs, strict=True)
    )
    if with_link_encoders:
        each = zip(recordings, logs, rngs, strict=True)
        recordings = tuple(_with_link_encoders(r, log, noise, rng) for r, log, rng in each)
    left_out = left_out_share(rigid, logs, every=max(1, round(0.02 / dt)))
    truth = {
        "schema": 1, "seed": seed, "inertial_error": inertial_error,
        "effects": [
            {**h.told(robot.joint_names, robot.is_slide), "share": h.share(survey)} for h in hidden
        ],
        "left_out": dict(zip(robot.joint_names, left_out.tolist(), strict=True)),
        "link_masses": {
            nominal.body(int(b)).name or f"body {b}": {"nominal": float(nominal.body_mass[b]),
                                                       "true": float(rigid.body_mass[b])}
            for b in nominal.jnt_bodyid
        },
    }
    secret = Secret(hidden, logs, rigid, true, nominal, survey)
    return ConcealedCase(recordings, str(mjcf), truth, seal(truth), secret)


def record_again(
    case: ConcealedCase, motions: Sequence[Excitation], *, seed: int, noise: Noise | None = None, rate: float = 500.0
) -> tuple[Recording, ...]:
    """Record more motions of the same arm, with the same physics hidden in it and the same sensors.

    Args:
        case: The arm, from `conceal`.
        motions: What to play; sampled at the step of the engine.
        seed: Of the noise; that of the case would repeat its noise.
        noise: Sensor noise, by default that of a good arm.
        rate: Samples per second of the recordings [1/s].

    Raises:
        InputError: A motion is sampled at another step than the engine's.
    """
    secret, first = case.secret, len(case.recordings)
    dt, names = float(secret.true.opt.timestep), case.recordings[0].joint_names
    recordings = []
    for k, motion in enumerate(motions, start=first):
        if abs(float(motion.t[1] - motion.t[0]) - dt) > 1e-9:
            step = motion.t[1] - motion.t[0]
            raise InputError(f"motion {motion.name!r} is sampled every {step:g} s; sample it every {dt:g} s")
        log = closed_loop(secret.nominal, secret.true, secret.hidden, motion, recording=k)
        rng = np.random.default_rng([seed, 31, k])
        step = max(1, round(1.0 / (rate * dt)))
        made = _recording(log, f"{motion.name}_{k}", names, secret.survey, noise or Noise(), step, False, rng)
        recordings.append(made)
    return tuple(recordings)


def demo_case(seed: int, *, duration: float = 20.0, rate: float = 1000.0) -> ConcealedCase:
    """The IRB 140 with one of the first nine effects hidden in it, at 6 to 20 % of the joint's torque.

    Args:
        seed: Draws effect, joint, strength, shapes, inertials, motions and noise.
        duration: Length of each recording [s].
        rate: Steps of the engine per second [1/s].

    Returns:
        The case; inertials are 5 % wrong.
    """
    return _irb140_case(seed, duration, rate, clean=False)


def clean_case(seed: int, *, duration: float = 20.0, rate: float = 1000.0) -> ConcealedCase:
    """The IRB 140 with nothing hidden in it: wrong inertials and sensor noise only (see `demo_case`)."""
    return _irb140_case(seed, duration, rate, clean=True)


def left_out_share(rigid: mujoco.MjModel, logs: Sequence[Log], every: int = 1) -> np.ndarray:
    """RMS of what the logs hold beyond the true rigid arm, as a share of that arm's torque RMS, shape (n,)."""
    rigid_squares, squares = np.zeros(rigid.nv), np.zeros(rigid.nv)
    for log in logs:
        tau = rigid_torque(rigid, log.q[::every], log.qd[::every], log.qdd[::every])
        tau += rigid.dof_frictionloss * np.sign(log.qd[::every])
        rigid_squares += np.sum(tau**2, axis=0)
        squares += np.sum((log.tau[::every] - tau) ** 2, axis=0)
    return np.sqrt(squares / np.maximum(rigid_squares, 1e-300))


def sealed(truth: dict) -> str:
    """What a seal covers, as text: seed and effects with joints and parameters, to four digits.

    What was simulated or summed stays outside: its last digits are another processor's or library's own, and with
    them the seal would be, too.
    """
    parameters = lambda effect: {  # noqa: E731
        name: f"{given['value'] + 0.0:.4g} {given['unit']}".strip() for name, given in effect["parameters"].items()
    }
    effects = [{"effect": e["effect"], "joints": list(e["joints"]), "parameters": parameters(e)}
               for e in truth["effects"]]  # fmt: skip
    return json.dumps({"seed": truth["seed"], "effects": effects}, sort_keys=True, separators=(",", ":"))


def seal(truth: dict) -> str:
    """SHA-256 of what is sealed of the truth."""
    return hashlib.sha256(sealed(truth).encode()).hexdigest()


def _irb140_case(seed: int, duration: float, rate: float, *, clean: bool) -> ConcealedCase:
    path = irb140_path()
    spec = arm_spec(path)
    robot = robot_from_model(spec.compile(), source=str(path))
    motions = three_motions(robot, duration, rate, seed=seed)
    concealments = []
    if not clean:
        rng = np.random.default_rng([seed, 40])
        survey = survey_of(arm_model(spec, 1.0 / rate), motions, every=max(1, round(0.02 * rate)))
        effect = str(rng.choice(FIRST_NINE))
        sites = meaningful_sites(effect, survey)
        joints = sites[rng.integers(len(sites))]
        concealments = [
            Concealment(effect, tuple(robot.joint_names[j] for j in joints), share=float(rng.uniform(0.06, 0.2)))
        ]
    return conceal(path, concealments, motions, seed=seed)


def _true_model(
    mjcf: str | pathlib.Path, hidden: Sequence[Hidden], names: Sequence[str], dt: float, error: float, seed: int
) -> mujoco.MjModel:
    """The arm with wrong inertials and with whatever of the hidden effects MuJoCo has natively."""
    spec = arm_spec(mjcf)
    for effect in hidden:
        effect.edit(spec, names)
    model = arm_model(spec, dt)
    perturb_inertials(model, error, np.random.default_rng([seed, 20]))
    dofs = np.array([model.joint(name).dofadr[0] for name in names])
    for effect in hidden:
        effect.install(model, dofs)
    return model


def _names(motions: Sequence[Excitation]) -> list[str]:
    """A name for each recording: its kind of motion, numbered where a kind is played more than once."""
    kinds = [motion.name for motion in motions]
    return [kind if kinds.count(kind) == 1 else f"{kind}_{kinds[:k].count(kind) + 1}" for k, kind in enumerate(kinds)]


def _recording(
    log: Log, name: str, names: Sequence[str], survey: Survey, noise: Noise, step: int, with_speeds: bool,
    rng: np.random.Generator,
) -> Recording:
    """What the sensors make of a log."""
    t = log.t[::step]
    q, qd, qdd, tau = (x[::step] for x in (log.q, log.qd, log.qdd, log.tau))
    if noise.jitter > 0.0:
        t = t + noise.jitter * (t[1] - t[0]) * np.clip(rng.normal(size=len(t)), -3.0, 3.0)
        t = np.clip(t, log.t[0], log.t[-1])
        q, qd, qdd, tau = (interpolate.make_interp_spline(log.t, x, k=3)(t) for x in (log.q, log.qd, log.qdd, log.tau))
    q = q + noise.encoder * rng.normal(size=q.shape)
    if noise.resolution > 0.0:
        q = noise.resolution * np.round(q / noise.resolution)
    rms = np.array([survey.rms(j) for j in range(len(names))])
    tau = tau + noise.torque * rms * _torque_noise(noise, tau.shape, float(np.diff(t).mean()), rng)
    keep = _kept(noise.lost, len(t), rng)
    return Recording(
        t=t[keep], q=q[keep], tau=tau[keep], qd=qd[keep] if with_speeds else None,
        qdd=qdd[keep] if with_speeds else None, extras={}, joint_names=tuple(names), source=name, notes=(),
    )


def _with_link_encoders(recording: Recording, log: Log, noise: Noise, rng: np.random.Generator) -> Recording:
    """The recording with `q_link.<joint>` columns."""
    t, names = recording.t, recording.joint_names
    q = np.stack([np.interp(t, log.t, x) for x in log.q_link.T], axis=1)
    q = q + noise.encoder * rng.normal(size=q.shape)
    return dataclasses.replace(recording, extras={f"q_link.{name}": q[:, j] for j, name in enumerate(names)})


def _torque_noise(noise: Noise, shape: tuple[int, int], dt: float, rng: np.random.Generator) -> np.ndarray:
    """Noise of unit variance with its colour, and spikes, shape (samples, n)."""
    white = rng.normal(size=shape)
    if noise.colour > 0.0:
        a = noise.colour ** (dt / 0.01)
        white = np.asarray(signal.lfilter([np.sqrt(1.0 - a**2)], [1.0, -a], white, axis=0))
    if noise.spikes > 0.0:
        hit = rng.random(shape) < noise.spikes
        white = white + hit * rng.uniform(10.0, 30.0, size=shape) * rng.choice([-1.0, 1.0], size=shape)
    return white


def _kept(lost: float, samples: int, rng: np.random.Generator) -> np.ndarray:
    """Which samples the logger did not lose, shape (samples,); the first and the last are kept."""
    keep = np.ones(samples, dtype=bool)
    if lost > 0.0:
        for start in np.flatnonzero(rng.random(samples) < lost / 4.5):
            keep[start : start + rng.integers(1, 9)] = False
        keep[[0, -1]] = True
    return keep
