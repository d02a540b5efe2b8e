"""Physics concealed in recordings of real machines: the machine is real, and only what is added to its log is known.

    python experiments/hidden_in_real_recordings.py                        # every machine and effect
    python experiments/hidden_in_real_recordings.py --machines staubli_tx40 --share 0.05
    python experiments/hidden_in_real_recordings.py --table                # print what is stored

A recording is diagnosed as it was logged; then the torque that one more effect would have needed along the same motion
is added to the torque (or the log is changed as its fault would change it), and it is diagnosed again.  What is named
more is right or false.  The added torque is NumPy's and MuJoCo's, along positions that SciPy smooths; the forms of the
laws are those of `testbed/`, not the library's.
"""

import dataclasses
import json
import pathlib
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
import real_double_pendulum
import study_provenance
import tyro
from real_bam_xl330 import JUDGED
from scipy import signal

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose
from irb140_jax.recordings import Recording, read_recording, write_recording
from irb140_jax.recordings.machines.bam_xl330 import servo_runs, write_servo
from irb140_jax.recordings.machines.dfki_double_pendulum import write_pendulum
from irb140_jax.recordings.machines.staubli_tx40 import write_tx40
from irb140_jax.robot import load_robot

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))  # testbed/ stands beside experiments/ and is installed by nobody

from testbed import scoring  # noqa: E402

CUT = {"staubli_tx40": 40.0, "dfki_double_pendulum": 20.0, "bam_xl330": 15.0}  # Hz, of the positions
STORED = "hidden_in_real_recordings.jsonl"
POWERED = 0.25  # of the torque of the recording in which a joint logs most
EVERY = 100.0  # Hz, at which MuJoCo is asked
KEPT = {"findings": ("effect", "joints", "parameters", "evidence", "alternatives"), "unexplained": ("joints", "where"),
        "not_testable": ("effect", "joints")}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Config:
    """What to hide where."""

    machines: tuple[str, ...] = tuple(CUT)
    effects: tuple[str, ...] = ()
    """All that are defined, where none is given."""
    share: float = 0.1
    """RMS of the added torque over that of the joint."""
    seed: int = 0
    out: pathlib.Path = ROOT / "results"
    table: bool = False


@dataclasses.dataclass
class Motion:
    """One recording along smoothed positions.

    Attributes:
        number: Which of the recordings it is.
        t: Time [s], shape (T,).
        q, qd, qdd: Motion, shape (T, n).
        tau: Logged torque, shape (T, n).
        tool, reach: Position of the last body's centre of mass [m] (T, 3), and its Jacobian (T, 3, n).
        gravity: Of two models, gravity along base axes and what it asks of the joints: a function of that vector.
    """

    number: int
    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    tau: np.ndarray
    tool: np.ndarray
    reach: np.ndarray
    gravity: Callable[[np.ndarray], np.ndarray]


@dataclasses.dataclass
class Hidden:
    """A change of the logs and the truth about it, in the words of `testbed.plants.Hidden`.

    Attributes:
        change: New positions and torques from a motion and the logged positions.
        slug, joints, parameters, accept, tolerate: See there.
    """

    change: Callable[[Motion, np.ndarray], tuple[np.ndarray, np.ndarray]]
    slug: str
    joints: tuple[int, ...]
    parameters: dict[str, float]
    accept: tuple[str, ...]
    tolerate: tuple[str, ...] = ()


def machines(config: Config, folder: pathlib.Path) -> Iterator[tuple[str, pathlib.Path, list[pathlib.Path]]]:
    """Name, model and recordings of each machine, as its own experiment fits them."""
    if "staubli_tx40" in config.machines:
        model, (train, _) = write_tx40(folder / "tx40")
        yield "staubli_tx40", model, [train]
    if "dfki_double_pendulum" in config.machines:
        models, runs = write_pendulum(folder / "pendulum", "C.1")
        test = real_double_pendulum.TEST["C.1"]
        yield "dfki_double_pendulum", models["correct"], [p for n, p in runs.items() if not n.endswith(test)]
    if "bam_xl330" in config.machines:
        files = [write_servo(folder / "servo", name) for name, (kp, _) in servo_runs().items() if kp != JUDGED]
        yield "bam_xl330", files[0][0], [path for _, path in files]


def driven(recordings: list[Recording]) -> list[Recording]:
    """Those in which every joint is driven: one that swings unpowered logs no torque, whatever more it would need."""
    sizes = np.array([np.std(r.tau, axis=0) for r in recordings])
    return [r for r, size in zip(recordings, sizes, strict=True) if np.all(size > POWERED * sizes.max(axis=0))]


def motion_of(model: mujoco.MjModel, log: Recording, number: int, cut: float) -> Motion:
    """The motion of a log, by SciPy, and what MuJoCo says along it."""
    rate = 1.0 / float(np.median(np.diff(log.t)))
    even = log.t[0] + np.arange(int((log.t[-1] - log.t[0]) * rate) + 1) / rate
    on_even = np.stack([np.interp(even, log.t, x) for x in log.q.T], axis=1)
    smooth = signal.sosfiltfilt(signal.butter(4, cut, fs=rate, output="sos"), on_even, axis=0)
    qd = np.gradient(smooth, 1.0 / rate, axis=0)
    qdd = np.gradient(qd, 1.0 / rate, axis=0)
    back = lambda x: np.stack([np.interp(log.t, even, c) for c in x.T], axis=1)  # noqa: E731
    q, qd, qdd = back(smooth), back(qd), back(qdd)
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, i) for i in range(model.njnt)]
    order = [names.index(name) for name in log.joint_names]
    at = np.unique(np.r_[0 : len(log.t) : max(round(rate / EVERY), 1), len(log.t) - 1])
    data, tool, reach = mujoco.MjData(model), np.zeros((len(at), 3)), np.zeros((len(at), 3, model.nv))
    for k, i in enumerate(at):
        data.qpos[order] = q[i]
        mujoco.mj_fwdPosition(model, data)
        tool[k] = data.xipos[-1]
        mujoco.mj_jac(model, data, reach[k], None, data.xipos[-1], model.nbody - 1)
    spread = lambda x: np.stack([np.interp(log.t, log.t[at], c) for c in x.reshape(len(at), -1).T], axis=1)  # noqa: E731

    def gravity(g: np.ndarray) -> np.ndarray:
        asked, before = np.zeros((len(at), model.nv)), model.opt.gravity.copy()
        model.opt.gravity[:], data.qvel[:] = g, 0.0
        for k, i in enumerate(at):
            data.qpos[order] = q[i]
            mujoco.mj_forward(model, data)
            asked[k] = data.qfrc_bias
        model.opt.gravity[:] = before
        return spread(asked)[:, order]

    jacobian = spread(reach).reshape(len(log.t), 3, model.nv)[:, :, order]
    return Motion(number, log.t, q, qd, qdd, log.tau, spread(tool), jacobian, gravity)


# --- What is hidden: each from the motions, a joint, the size of its torque [N m] and random numbers --------------


def law(j: int, f: Callable[[Motion], np.ndarray]) -> Callable[[Motion, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """More torque at one joint."""

    def change(m: Motion, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        tau = m.tau.copy()
        tau[:, j] += f(m)
        return q, tau

    return change


def over(motions: list[Motion], f: Callable[[Motion], np.ndarray]) -> np.ndarray:
    """Something of all motions."""
    return np.concatenate([f(m) for m in motions])


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def spring(motions, j, torque, rng):
    """A counterbalance whose slope grows a little over the range."""
    q = over(motions, lambda m: m.q[:, j])
    rest = rng.uniform(q.min(), q.max())
    shape = lambda m: np.sinh((m.q[:, j] - rest) / (2.0 * np.ptp(q)))  # noqa: E731
    size = torque / rms(over(motions, shape))
    return Hidden(law(j, lambda m: size * shape(m)), "gravity_spring", (j,), {}, ("gravity_spring",),
                  ("torque_offset",))  # fmt: skip


def ripple(motions, j, torque, rng):
    """Cogging with a tenth of its second harmonic."""
    cycles = 10.0 ** rng.uniform(0.5, 1.2) / np.ptp(over(motions, lambda m: m.q[:, j]))
    shape = lambda m: np.sin(2 * np.pi * cycles * m.q[:, j]) + 0.1 * np.sin(4 * np.pi * cycles * m.q[:, j] + 1)  # noqa: E731
    size = torque / rms(over(motions, shape))
    return Hidden(law(j, lambda m: size * shape(m)), "torque_ripple", (j,),
                  {"amplitude": size, "cycles_per_rad": cycles}, ("torque_ripple",))  # fmt: skip


def offset(motions, j, torque, rng):
    """A drive's offset."""
    return Hidden(law(j, lambda m: torque + 0 * m.t), "torque_offset", (j,), {"offset": torque},
                  ("torque_offset", "asymmetric_friction"))  # fmt: skip


def gain(motions, j, torque, rng):
    """A drive's torque constant that is stated too large: three times the share, for it needs no motion of its own."""
    more = 3.0 * torque / rms(over(motions, lambda m: m.tau[:, j]))
    return Hidden(law(j, lambda m: more * m.tau[:, j]), "torque_gain", (j,), {"gain": 1 / (1 + more)}, ("torque_gain",))


def delay(motions, j, torque, rng):
    """All torques logged 10 ms early."""

    def change(m, q):
        return q, np.stack([np.interp(m.t + 0.01, m.t, x) for x in m.tau.T], axis=1)

    everywhere = tuple(range(motions[0].q.shape[1]))
    return Hidden(change, "time_delay", everywhere, {"delay": 0.01}, ("time_delay",), ("channel_skew",))


def rotor(motions, j, torque, rng):
    """More inertia of a drive."""
    inertia = torque / rms(over(motions, lambda m: m.qdd[:, j]))
    return Hidden(law(j, lambda m: inertia * m.qdd[:, j]), "rotor_inertia", (j,), {"inertia": inertia},
                  ("rotor_inertia",))  # fmt: skip


def dry(motions, j, torque, rng):
    """More dry friction, rounded over half a per cent of the speed; friction that grows with load has a level, too."""
    slow = 0.005 * rms(over(motions, lambda m: m.qd[:, j]))
    return Hidden(law(j, lambda m: torque * m.qd[:, j] / np.hypot(m.qd[:, j], slow)), "coulomb_friction", (j,),
                  {"coulomb": torque}, ("coulomb_friction", "load_dependent_friction"))  # fmt: skip


def viscous(motions, j, torque, rng):
    """More viscous friction that bends a little."""
    size = rms(over(motions, lambda m: m.qd[:, j]))
    return Hidden(law(j, lambda m: torque * 4.0 * np.arcsinh(m.qd[:, j] / (4.0 * size))), "viscous_friction", (j,),
                  {"viscous": torque / size}, ("viscous_friction",))  # fmt: skip


def bump(motions, j, torque, rng):
    """A place where dry friction is higher."""
    q = over(motions, lambda m: m.q[:, j])
    centre, width = np.quantile(q, rng.uniform(0.3, 0.7)), 0.1 * np.ptp(q)
    slow = 0.005 * rms(over(motions, lambda m: m.qd[:, j]))
    shape = lambda m: m.qd[:, j] / np.hypot(m.qd[:, j], slow) / (1.0 + ((m.q[:, j] - centre) / width) ** 2)  # noqa: E731
    size = torque / rms(over(motions, shape))
    return Hidden(law(j, lambda m: size * shape(m)), "position_dependent_friction", (j,), {},
                  ("position_dependent_friction",), ("coulomb_friction",))  # fmt: skip


def loaded(motions, j, torque, rng):
    """Dry friction in proportion to the load, rounded."""
    slow = 0.005 * rms(over(motions, lambda m: m.qd[:, j]))
    shape = lambda m: np.abs(m.tau[:, j]) * m.qd[:, j] / np.hypot(m.qd[:, j], slow)  # noqa: E731
    size = torque / rms(over(motions, shape))
    return Hidden(law(j, lambda m: size * shape(m)), "load_dependent_friction", (j,), {},
                  ("load_dependent_friction",), ("coulomb_friction",))  # fmt: skip


def coupling(motions, j, torque, rng):
    """Friction on the difference of the speeds of two neighbours."""
    n = motions[0].q.shape[1]
    k = j - 1 if j == n - 1 else j + 1
    slope = torque / rms(over(motions, lambda m: m.qd[:, j] - m.qd[:, k]))

    def change(m, q):
        tau, rub = m.tau.copy(), slope * (m.qd[:, j] - m.qd[:, k])
        tau[:, j] += rub
        tau[:, k] -= rub
        return q, tau

    return Hidden(change, "transmission_coupling", tuple(sorted((j, k))), {}, ("transmission_coupling",),
                  ("viscous_friction",))  # fmt: skip


def zero(motions, j, torque, rng):
    """A zero that is off by 3 degrees."""

    def change(m, q):
        q = q.copy()
        q[:, j] += 0.05
        return q, m.tau

    return Hidden(change, "encoder_offset", (j,), {"offset": 0.05}, ("encoder_offset",), ("gravity_tilt",))


def tilt(motions, j, torque, rng):
    """A base that leans by 3 degrees; masses as the model has them."""
    about = rng.uniform(0.0, 2.0 * np.pi)
    g = 9.81 * np.array([np.sin(0.05) * np.cos(about), np.sin(0.05) * np.sin(about), -np.cos(0.05)])
    change = lambda m, q: (q, m.tau + m.gravity(g) - m.gravity(np.array([0, 0, -9.81])))  # noqa: E731
    everywhere = tuple(range(motions[0].q.shape[1]))
    return Hidden(change, "gravity_tilt", everywhere, {"tilt": 0.05}, ("gravity_tilt",), ("encoder_offset",))


def payload(motions, j, torque, rng):
    """A point mass at the last link's centre of mass."""

    def asked(m):
        rate = 1.0 / float(np.median(np.diff(m.t)))
        x = signal.sosfiltfilt(signal.butter(2, 15.0, fs=rate, output="sos"), m.tool, axis=0)
        a = np.gradient(np.gradient(x, m.t, axis=0), m.t, axis=0)
        return np.einsum("tin,ti->tn", m.reach, a - np.array([0, 0, -9.81]))

    felt, tau = (np.sqrt(np.mean(over(motions, f) ** 2, axis=0)) for f in (asked, lambda m: m.tau))
    mass = torque / tau[j] * float(np.min(tau / np.maximum(felt, 1e-9)))
    change = lambda m, q: (q, m.tau + mass * asked(m))  # noqa: E731
    everywhere = tuple(range(motions[0].q.shape[1]))
    return Hidden(change, "payload", everywhere, {"mass": mass}, ("payload",))


def push(motions, j, torque, rng):
    """A push on the last link for a fifth of a recording, at most a second, that comes and goes as a raised cosine."""
    m = motions[int(rng.integers(len(motions)))]
    for_s = min(1.0, 0.2 * float(np.ptp(m.t)))
    begin = m.t[0] + rng.uniform(0.3, 0.6) * float(np.ptp(m.t))
    way = rng.normal(size=3)
    felt, tau = (np.sqrt(np.mean(x**2, axis=0)) for x in (np.einsum("i,tin->tn", way, m.reach), m.tau))
    force = 5.0 * torque / tau[j] * way / float(np.max(felt / tau))

    def change(motion, q):
        if motion.number != m.number:
            return q, motion.tau
        edge = np.clip(np.minimum(motion.t - begin, begin + for_s - motion.t) / (0.1 * for_s), 0.0, 1.0)
        grown = 0.5 - 0.5 * np.cos(np.pi * edge)
        return q, motion.tau - grown[:, None] * np.einsum("i,tin->tn", force, motion.reach)

    everywhere = tuple(range(motions[0].q.shape[1]))
    return Hidden(change, "external_wrench", everywhere, {}, ("external_wrench",), ("contact",))


EFFECTS = {f.__name__: f for f in (spring, ripple, offset, gain, delay, rotor, dry, viscous, bump, loaded, coupling,
                                   zero, tilt, payload, push)}  # fmt: skip
ADDS_UP = ("coulomb_friction", "viscous_friction", "rotor_inertia", "torque_offset")  # to what the machine has of it


def run(config: Config) -> None:
    """Diagnose every machine as it is and with each effect, and keep what came out."""
    wanted = [(k, f) for k, f in EFFECTS.items() if not config.effects or k in config.effects]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for machine, file, logs in machines(config, folder):
            robot, model = load_robot(file), mujoco.MjModel.from_xml_path(str(file))
            recordings = driven([read_recording(p, robot) for p in logs])
            motions = [motion_of(model, r, i, CUT[machine]) for i, r in enumerate(recordings)]
            bare = diagnosed(robot, recordings, folder)
            keep(config, {"machine": machine, "hidden": "nothing"} | bare)
            for k, (effect, make) in enumerate(wanted):
                rng = np.random.default_rng([config.seed, list(EFFECTS).index(effect)])
                j = int(rng.integers(robot.n))
                if effect == "coupling" and robot.n == 1:
                    continue
                torque = config.share * rms(over(motions, lambda m: m.tau[:, j]))  # noqa: B023
                hidden = make(motions, j, torque, rng)
                changed = [hidden.change(m, r.q) for m, r in zip(motions, recordings, strict=True)]
                logs = [dataclasses.replace(r, q=q, qd=None, qdd=None, tau=tau)
                        for r, (q, tau) in zip(recordings, changed, strict=True)]  # fmt: skip
                joints = [robot.joint_names[i] for i in hidden.joints]
                truth = {"slug": hidden.slug, "joints": joints, "parameters": hidden.parameters,
                         "accept": hidden.accept, "tolerate": hidden.tolerate}  # fmt: skip
                line = {"machine": machine, "hidden": effect, "share": config.share, "truth": truth}
                line |= diagnosed(robot, logs, folder)
                keep(config, line)
                print(f"{k + 1}/{len(wanted)} {row(line, bare)}", flush=True)


def diagnosed(robot: Any, recordings: list[Recording], folder: pathlib.Path) -> dict[str, Any]:
    """The parts of a diagnosis that are judged, of recordings that go through files as a user's do."""
    files = [write_recording(r, folder / f"{i}.npz") for i, r in enumerate(recordings)]
    began = time.perf_counter()
    result = diagnose(robot, [read_recording(p, robot) for p in files]).diagnosis.to_json()
    kept = {part: [{k: x[k] for k in keys} for x in result[part]] for part, keys in KEPT.items()}
    return {"seconds": round(time.perf_counter() - began, 1), "diagnosis": kept}


def keep(config: Config, line: dict[str, Any]) -> None:
    """Store a result in the place of its former one."""
    path = config.out / STORED
    same = lambda x: (x["machine"], x["hidden"], x.get("share"))  # noqa: E731
    rest = [x for x in stored(config) if same(x) != same(line)]
    line["engine"] = study_provenance.commit()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("".join(json.dumps(x) + "\n" for x in [*rest, line]), encoding="utf-8")


def stored(config: Config) -> list[dict[str, Any]]:
    """All that is stored."""
    path = config.out / STORED
    return [json.loads(x) for x in path.read_text(encoding="utf-8").splitlines()] if path.is_file() else []


def judged(line: dict[str, Any], bare: dict[str, Any]) -> dict[str, Any]:
    """How a hidden effect came out, beside the diagnosis of the recording as it was logged.

    Returns:
        how: As of `testbed.scoring.stated_classes`; more, lost: Names beside it that the bare recording did not have,
        or that are gone; sure: those more that are stated above 0.99; value: of each parameter that is known, what was
        added, what is said to be there more, and its standard deviation.
    """
    truth = line["truth"]
    hidden = truth | {"kind": line["hidden"], "role": "special"}
    case = {"truth": {"hidden": [hidden], "dead": []}, "diagnosis": line["diagnosis"]}
    at = lambda d: {(f["effect"], tuple(f["joints"])): f for f in d["diagnosis"]["findings"]}  # noqa: E731
    now, before = at(line), at(bare)
    wrong = {k for k, f in now.items() if not scoring.matches(f, hidden)}
    allowed = lambda f: scoring.matches(f, hidden, ("accept", "tolerate"))  # noqa: E731
    values = {}
    mine = [k for k in now if k[0] == truth["slug"] and (set(k[1]) == set(truth["joints"]) or len(truth["joints"]) > 1)]
    for key in mine:
        for name, true in truth["parameters"].items():
            said = now[key]["parameters"].get(name)
            had = before[key]["parameters"][name] if key in before and truth["slug"] in ADDS_UP else None
            if said and said["std"]:
                value = said["value"] - (had["value"] if had else 0.0)
                values[name] = (true, value, float(np.hypot(said["std"], had["std"] if had else 0.0)))
    more = sorted(wrong - set(before))
    return {
        "how": scoring.stated_classes(case)[0]["how"], "value": values, "more": more,
        "sure": [k for k in more if now[k]["evidence"]["probability"] > 0.99],
        "lost": sorted(k for k, f in before.items() if k not in now and not allowed(f)),
    }  # fmt: skip


def row(line: dict[str, Any], bare: dict[str, Any]) -> str:
    """A line of the table."""
    j = judged(line, bare)
    name = lambda k: f"{k[0]} on {', '.join(k[1]) if len(k[1]) < 3 else 'all'}"  # noqa: E731
    values = "; ".join(f"{k} {s:.3g} ± {std:.2g} ({true:.3g})" for k, (true, s, std) in j["value"].items())
    where = ", ".join(line["truth"]["joints"]) if len(line["truth"]["joints"]) < 3 else "all joints"
    more, lost = ("; ".join(map(name, j[k])) or "none" for k in ("more", "lost"))
    cells = (f"`{line['machine']}`", f"{100 * line['share']:.0f} %", f"{line['hidden']} on {where}", j["how"],
             values or "—", more, lost)  # fmt: skip
    return f"| {' | '.join(cells)} |"


def table(config: Config) -> str:
    """What is stored, as a table."""
    lines = stored(config)
    bare = {x["machine"]: x for x in lines if x["hidden"] == "nothing"}
    head = ["| machine | share | hidden | it is | parameters (true) | named beside it | no longer named |",
            "|" + "---|" * 7]  # fmt: skip
    return "\n".join([*head, *(row(x, bare[x["machine"]]) for x in lines if x["hidden"] != "nothing")])


def main() -> None:
    """Run, or print what is stored."""
    config = tyro.cli(Config)
    if not config.table:
        set_up_compilation_cache()
        run(config)
    print(table(config))


if __name__ == "__main__":
    main()
