"""Diagnose a real servo that swings a pendulum, and simulate its position loop with what was named.

    python experiments/real_bam_xl330.py [--out results]

Fitted on the runs with gains 100, 200 and 800, judged on those with gain 400, as published.  Torque alone decides what
is named.  The numbers are then refitted to the positions, in the closed loop in which they are judged: least squares on
torque is drawn towards whatever a friction law does not follow, such as sticking.  Positions in turn can prefer numbers
that contradict the torque; so the law that was named is refitted freely, and again within what the torque says of it.

Whether a simulated servo sticks at a turn or just gets by is a matter of a percent in its friction, so the error of one
simulation is jagged in the numbers and its lowest notch is luck.  What is minimised is the error that is to be expected
when the numbers scatter, as widely as the diagnosis is unsure of them.  What other widths would give is told beside it,
also on a gain left out of those seen.
"""

import dataclasses
import json
import pathlib
import tempfile
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import tyro
from jaxtyping import Array, Float
from scipy import optimize

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.errors import InputError
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import Recording, read_recording
from irb140_jax.recordings.machines.bam_xl330 import KT, LENGTH, MASS, R, servo_recording, servo_runs, write_servo
from irb140_jax.robot import load_robot

JUDGED = 400  # gain of the runs that no fit sees
GOAL = 0.0325  # rad, mean absolute error of position on those, published with load-dependent friction
GRAVITY = 9.81  # m/s^2
SUPPLY = 7.4  # V
ERROR_GAIN = 4096.0 / (2.0 * np.pi) / (256.0 * 885.0)  # duty per rad and unit of gain: counts of encoder and bridge
STEP = 1e-3  # s of the simulation: five of it are a step of the published one


@dataclasses.dataclass(frozen=True)
class Config:
    """Where to write, and how long to search from how many starts."""

    out: pathlib.Path = pathlib.Path("results")
    evaluations: int = 450
    starts: int = 5
    seed: int = 0
    scatters: tuple[float, ...] = (0.0, 0.1, 0.2, 0.4)
    """Standard deviations of the numbers, in the logarithm, that are told for comparison."""
    copies: int = 64
    """Servos with scattered numbers, over which an error is expected: half of them mirror images."""
    redrawn: tuple[int, ...] = (16, 64)
    """Numbers of copies that are told for comparison, each drawn anew `draws` times."""
    draws: int = 4


class Servo(eqx.Module):
    """Numbers of the simulated servo.

    Attributes:
        gain: Torque that the data sheet promises, over that which moves the pendulum.
        rotor: Inertia of the rotor on the output, in torque of the data sheet [kg m^2].
        viscous: Friction [N m s/rad].
        brake: Back electromotive force, over that of the data sheet.
        coulomb: Friction without load [N m].
        load: Friction as a share of the load.
    """

    gain: Float[Array, ""]
    rotor: Float[Array, ""]
    viscous: Float[Array, ""]
    brake: Float[Array, ""]
    coulomb: Float[Array, ""]
    load: Float[Array, ""]


class Run(eqx.Module):
    """What a simulation of one run is given, on its own grid of time, and where the servo really was.

    Attributes:
        kp: Gain of the position loop.
        goal: Position asked for [rad], shape (S,).
        on: Whether the motor is switched on, shape (S,).
        q: Position [rad], shape (S,).
    """

    kp: Float[Array, ""]
    goal: Float[Array, " S"]
    on: Float[Array, " S"]
    q: Float[Array, " S"]


# Where searches begin: the data sheet is right, a rotor and some friction there, half of it for each law.
START = {"gain": 1.2, "rotor": 2e-3, "viscous": 1e-2, "brake": 1.0, "coulomb": 2e-2, "load": 0.2}
APART = 0.5  # standard deviation of further starts, in the logarithm
COULOMB_AND_VISCOUS = ("gain", "rotor", "viscous", "brake", "coulomb")
NAMED = {"load": "load_coefficient", "coulomb": "coulomb"}  # numbers of the servo as the diagnosis calls them
DOUBTED = ("load_coefficient", "viscous", "inertia")
WITHIN = 3.0  # standard deviations of the diagnosis
LEAST = 1e-4  # of a number that may be nothing: searches go over logarithms
Bounds = dict[str, tuple[float, float]]


def simulated(servo: Servo, run: Run) -> Float[Array, " S"]:
    """Position of the servo in its loop, by semi-implicit Euler; dry friction stops it within a step if it can.

    duty = clip(kp gain (goal - q), +-1), V = duty supply, tau = kt/R V - brake kt^2/R qd while switched on, else none.
    The gear carries the motor's torque on one side and the weight on the other: its load is their mean, as published.
    """
    inertia = servo.gain * MASS * LENGTH**2 + servo.rotor

    def step(state, now):
        (q, qd), (goal, on) = state, now
        volts = SUPPLY * jnp.clip(run.kp * ERROR_GAIN * (goal - q), -1.0, 1.0)
        weight = servo.gain * MASS * LENGTH * GRAVITY * jnp.sin(q)
        motor = on * (KT / R * volts - servo.brake * KT**2 / R * qd)
        drive = motor - weight - servo.viscous * qd
        level = servo.coulomb + servo.load * 0.5 * jnp.abs(motor + weight)
        stopping = -(inertia * qd / STEP + drive)
        qd = qd + STEP / inertia * (drive + jnp.clip(stopping, -level, level))
        return (q + STEP * qd, qd), q

    return jax.lax.scan(step, (run.q[0], 0.0), (run.goal, run.on))[1]


@eqx.filter_jit
def error(servo: Servo, runs: Run) -> Float[Array, " runs"]:
    """Mean absolute error of position of every run [rad]."""
    return jax.vmap(lambda run: jnp.mean(jnp.abs(simulated(servo, run) - run.q)))(runs)


@eqx.filter_jit
def expected_error(servos: Servo, runs: Run) -> Float[Array, ""]:
    """Mean of that over servos, numbers of shape (copies,), and runs [rad]."""
    return jnp.mean(jax.vmap(error, in_axes=(0, None))(servos, runs))


def stacked(recordings: Sequence[tuple[int, Recording]]) -> Run:
    """Runs on grids of equally many samples; goals hold until the next comes."""
    count = min(int((r.t[-1] - r.t[0]) / STEP) for _, r in recordings)
    rows = []
    for kp, r in recordings:
        grid = r.t[0] + STEP * np.arange(count)
        held = np.searchsorted(r.t, grid, side="right") - 1
        goal, on, q = r.extras["goal"][held], r.extras["enabled"][held], np.interp(grid, r.t, r.q[:, 0])
        rows.append(Run(jnp.asarray(float(kp)), *(jnp.asarray(x) for x in (goal, on, q))))
    return jax.tree.map(lambda *x: jnp.stack(x), *rows)


def refitted(
    free: Sequence[str], bounds: Bounds, seen: Run, config: Config, scatter: float, near: Sequence[Servo] = ()
) -> list[Servo]:
    """Servos that are expected to err least on the runs seen, one for every start of the search, the best first.

    Searches begin at the data sheet, about it, and as near as the bounds allow to other servos: an optimum that was
    found without bounds may have one within them that scattered starts miss.
    """
    middle, rng = np.log([START[name] for name in free]), np.random.default_rng(config.seed)
    starts = [middle, *(middle + APART * rng.normal(size=(config.starts - 1, len(free))))]
    starts += [np.log([max(float(getattr(servo, name)), LEAST) for name in free]) for servo in near]
    half = scatter * np.random.default_rng(config.seed + 1).normal(size=(config.copies // 2, len(free)))
    copies = np.vstack([half, -half]) if scatter else np.zeros((1, len(free)))
    found = [nearest_optimum(free, bounds, start, copies, seen, config.evaluations) for start in starts]
    return [servo for _, servo in sorted(found, key=lambda one: one[0])]


def nearest_optimum(
    free: Sequence[str], bounds: Bounds, start: np.ndarray, copies: np.ndarray, seen: Run, evaluations: int
) -> tuple[float, Servo]:
    """Where a simplex over the logarithms of the free numbers ends, and the error there; other numbers are zero.

    Errors are means over `copies`, shape (copies, numbers), of what is added to the logarithms.
    """
    low, high = np.log([bounds.get(name, (1e-9, 1e9)) for name in free]).T

    def servo(x: np.ndarray) -> Servo:
        fixed = {name: jnp.zeros(x.shape[:-1]) for name in START}
        return Servo(**fixed | dict(zip(free, jnp.exp(jnp.moveaxis(jnp.asarray(x), -1, 0)), strict=True)))

    start = np.clip(start, low, high)
    apart = np.where(start + 0.4 <= high, 0.4, -np.minimum(0.4, 0.5 * (high - low)))  # 40 %, away from the bounds
    simplex = np.vstack([start, start + np.diag(apart)])
    options = {"maxfev": evaluations, "initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-6}
    best = optimize.minimize(
        lambda x: float(expected_error(servo(x + copies), seen)), start, method="Nelder-Mead", options=options,
        bounds=optimize.Bounds(low, high),
    )  # fmt: skip
    return float(best.fun), servo(best.x)


def doubt(findings: list[dict]) -> float:
    """Relative standard deviation of what the diagnosis says of the servo's numbers, root mean square.

    Those count that are told from nothing.

    Raises:
        InputError: There are none.
    """
    told = [p for f in findings for name, p in f["parameters"].items() if name in DOUBTED]
    doubts = [p["std"] / p["value"] for p in told if p["value"] > 2.0 * p["std"]]
    if not doubts:
        raise InputError("nothing that was named tells a number of the servo; there is no doubt to refit it by")
    return float(np.sqrt(np.mean(np.square(doubts))))


def compared(free: Sequence[str], runs: dict[str, tuple[int, Recording]], config: Config) -> list[dict[str, float]]:
    """By scatter: error on a gain that the refit did not see, mean over the gains but the judged one; and on that."""
    gains, config = sorted({kp for kp, _ in runs.values()} - {JUDGED}), dataclasses.replace(config, starts=2)
    out = []
    for scatter in config.scatters:
        errors = {}
        for unseen in (*gains, JUDGED):
            fit = stacked([x for x in runs.values() if x[0] not in (unseen, JUDGED)])
            servo = refitted(free, {}, fit, config, scatter)[0]
            errors[unseen] = float(jnp.mean(error(servo, stacked([x for x in runs.values() if x[0] == unseen]))))
        judged = errors.pop(JUDGED)
        left_out = float(np.mean(list(errors.values())))
        out.append({"scatter": scatter, "error_on_a_gain_left_out": left_out, "error_judged": judged})
    return out


def redrawn(free: Sequence[str], seen: Run, judged: Run, config: Config, scatter: float) -> list[dict]:
    """By number of copies: errors judged of refits from the data sheet, each over copies of its own."""
    out = []
    for copies in config.redrawn:
        draws = [
            refitted(free, {}, seen, dataclasses.replace(config, copies=copies, starts=1, seed=seed), scatter)[0]
            for seed in range(1, 1 + config.draws)
        ]
        out.append({"copies": copies, "errors_judged": [float(jnp.mean(error(servo, judged))) for servo in draws]})
    return out


def diagnosed() -> dict:
    """The diagnosis of the runs seen."""
    with tempfile.TemporaryDirectory() as folder:
        files = [write_servo(pathlib.Path(folder), name) for name, (kp, _) in servo_runs().items() if kp != JUDGED]
        robot = load_robot(files[0][0])
        return diagnose(robot, [read_recording(path, robot) for _, path in files]).diagnosis.to_json()


def run(config: Config) -> dict:
    """Diagnose on the runs seen, then refit and judge Coulomb and viscous friction alone and with what was named."""
    runs = {name: (kp, servo_recording(name)) for name, (kp, _) in servo_runs().items()}
    diagnosis = diagnosed()
    named = [f["effect"] for f in diagnosis["findings"]]
    seen, judged = (stacked([x for x in runs.values() if (x[0] == JUDGED) == later]) for later in (False, True))
    laws: dict[str, tuple[tuple[str, ...], Bounds]] = {"Coulomb and viscous friction": (COULOMB_AND_VISCOUS, {})}
    if "load_dependent_friction" in named:
        free, finding = (*COULOMB_AND_VISCOUS, "load"), diagnosis["findings"][named.index("load_dependent_friction")]
        laws["with load-dependent friction, as named"] = (free, {})
        laws["the same, within what the torque says of it"] = (free, intervals(finding["parameters"]))
    scatter = doubt(diagnosis["findings"])
    simulation, found = {}, []
    for law, (free, bounds) in laws.items():
        found = refitted(free, bounds, seen, config, scatter, found if bounds else ())
        simulation[law] = [judgement(servo, free, seen, judged) for servo in found]
    return {
        **{key: diagnosis[key] for key in ("verdict", "summary", "findings", "unexplained", "fit")},
        "simulation": simulation, "goal": GOAL, "scatter": scatter,
        "other_scatters": compared(list(laws.values())[-1][0], runs, config),
        "other_draws": redrawn(list(laws.values())[-1][0], seen, judged, config, scatter),
    }  # fmt: skip


def intervals(parameters: dict) -> Bounds:
    """What a finding says of the servo's numbers."""
    found = {name: parameters[NAMED[name]] for name in NAMED}
    return {
        name: (max(p["value"] - WITHIN * p["std"], LEAST), max(p["value"] + WITHIN * p["std"], 2.0 * LEAST))
        for name, p in found.items()
    }  # fmt: skip


def judgement(servo: Servo, free: Sequence[str], seen: Run, judged: Run) -> dict:
    """Numbers and errors of one optimum."""
    trajectories = [trajectory for kp, trajectory in servo_runs().values() if kp == JUDGED]
    return {
        "numbers": {name: float(getattr(servo, name)) for name in free},
        "error_seen": float(jnp.mean(error(servo, seen))),
        "error_judged": float(jnp.mean(error(servo, judged))),
        "by_trajectory": dict(zip(trajectories, np.asarray(error(servo, judged)).tolist(), strict=True)),
    }


def main() -> None:
    config = tyro.cli(Config)
    set_up_compilation_cache()
    result = run(config)
    config.out.mkdir(parents=True, exist_ok=True)
    path = config.out / "real_bam_xl330.json"
    path.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(result["summary"])
    print(f"numbers scattered by {result['scatter']:.1%}, as the diagnosis is unsure of them")
    for law, optima in result["simulation"].items():
        for row in optima:
            print(f"{law}: {row['error_judged']:.4f} rad unseen, {row['error_seen']:.4f} seen, goal {GOAL}")
    print(path)


if __name__ == "__main__":
    main()
