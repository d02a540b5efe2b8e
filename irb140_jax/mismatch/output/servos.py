"""What a diagnosis of servo logs says beside its findings: which errors of the drive look like a finding."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from irb140_jax.effects import At
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.corrected.model import CorrectedModel, torques_along
from irb140_jax.mismatch.motion import MotionFit
from irb140_jax.mismatch.records import digits
from irb140_jax.mismatch.regression.gaussian import log_odds_of_any
from irb140_jax.mismatch.regression.nuisances import COMMAND_DELAY, DRIVE_KD
from irb140_jax.mismatch.result import Estimate, Finding
from irb140_jax.mismatch.selection.explanation import Explanation, parts
from irb140_jax.recordings.condition import Commanded, Conditioned
from irb140_jax.recordings.drive import PAYLOAD, unknown_drive
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot


def without_negligible(ex: Explanation, servo: Commanded | None) -> Explanation:
    """The explanation without effects that are smaller at every joint than the error of a servo law."""
    if servo is None:
        return ex
    post = ex.posterior()
    w = post.mean * ex.data.scale[post.columns]
    logged = _rms([s.tau for s in ex.data.stretches], ex)
    kept = []
    for index, rows in zip(ex.chosen, parts(ex.data, ex.chosen), strict=True):
        c = ex.data.candidates[index]
        torque = [s.torque(ex.data.nuisances + c.columns, w[rows]) for s in ex.data.stretches]
        if c.slug == "inertials" or np.any(_rms(torque, ex) > servo.inexact * logged):
            kept.append(index)
    return dataclasses.replace(ex, chosen=tuple(kept))


def harmful_discrepancy(
    model: CorrectedModel, smooth: Sequence[Conditioned], without: Sequence[np.ndarray]
) -> np.ndarray:
    """Joints on which the model's torque is worse with its discrepancy than without, shape (n,).

    The fit may see another load than the model has: an error of the drive moves the inertials, and what bends with the
    load is then scaled wrongly.

    Args:
        model: The corrected model.
        smooth: The recordings that it was found in.
        without: Torque of the same model without discrepancy along them, low-passed, (R, n) each.
    """
    band, squares = model.band, np.zeros((2, model.robot.n))
    for r, plain in zip(smooth, without, strict=True):
        rows = band.kept(len(r.t))
        tau, both = band.apply(r.tau), (plain, band.apply(torques_along(model, r).corrected))
        squares += [np.sum(np.where(r.usable[rows], tau - x, 0.0) ** 2, axis=0) for x in both]
    return squares[1] > squares[0]


def harmful_notes(robot: Robot, harmful: np.ndarray) -> list[str]:
    """A note where a joint's discrepancy is left out, see `harmful_discrepancy`."""
    if not harmful.any():
        return []
    names = ", ".join(name for name, bad in zip(robot.joint_names, harmful, strict=True) if bad)
    return [
        f"On {names} `irb140 predict` adds no torque that no effect explains: with the loads of the corrected model it "
        "would make the error larger."
    ]


def _rms(torque: Sequence[np.ndarray], ex: Explanation) -> np.ndarray:
    """Root mean square over the rows in which each joint counts, shape (n,)."""
    use = [s.use for s in ex.data.stretches]
    rows = np.maximum(sum(u.sum(axis=0) for u in use), 1)
    return np.sqrt(sum(np.sum(np.where(u, x, 0.0) ** 2, axis=0) for x, u in zip(torque, use, strict=True)) / rows)


def of_servos(ex: Explanation, servo: Commanded | None, found: list[Finding]) -> list[Finding]:
    """Findings of servo logs, each with the errors of the drive's gains or clock that would look the same."""
    if servo is None:
        return found
    out, names = [], list(ex.lib.robot.joint_names)
    for f in found:
        said = ""
        if f.effect == "viscous_friction":
            j = names.index(f.joints[0])
            off = float(servo.drive.kd_width[j]) * ex.own_nuisance(j, DRIVE_KD)[0]
            both = (f.parameters["viscous"].value or 0.0) + float(servo.drive.kd[j]) + off
            said = (
                f" It can't be told from the drive's Kd, which is taken as {servo.drive.kd[j]:.3g}: only the sum of "
                f"both, {both:.3g}, is known; recordings with two different Kd, or of unpowered motion, would tell "
                "them apart."
            )
        elif f.effect == "actuator_lag":
            said = (
                " The fit can't tell its cause: the drive may apply commands late, its torque may lag, or the clocks "
                "may be out of step."
            )
        elif f.effect == "rotor_inertia":
            said = (
                " This number depends on how late the drive applies its commands, because a delay shifts the torque's "
                "phase."
            )
        out.append(dataclasses.replace(f, certain=f.certain + said, parameters=_by_real_kp(ex, servo, f)))
    return out


def _by_real_kp(ex: Explanation, servo: Commanded, f: Finding) -> dict[str, Estimate]:
    """Parameters of a finding, those that are torques of the stated gains as uncertain as these are.

    The search fits the scale of all torque that links need, with its doubt; friction and limits stand beside it.  Where
    masses and gains disagree, either may be wrong.
    """
    effect, names = ex.lib.effects[f.effect], list(ex.lib.robot.joint_names)
    if not (effect.place.is_friction or effect.place.at is At.ASKED):
        return f.parameters
    doubt = max(float(np.hypot(*ex.kp_scale(names.index(joint), servo.drive))) for joint in f.joints)
    of_torque = {p.name for p in effect.law.parameters if p.unit.startswith("{tau}")}
    return {
        k: dataclasses.replace(p, std=float(np.hypot(p.std, p.value * doubt)))
        if k in of_torque and p.value is not None and p.std is not None else p
        for k, p in f.parameters.items()
    }  # fmt: skip


def by_known_payload(
    ex: Explanation, servo: Commanded, given: Sequence[Recording], made: Sequence[Recording]
) -> list[Recording]:
    """Recordings as given, with the Kp that the known payload of some of them shows.

    As uncertain beforehand as it was: the same recordings are to tell its doubt, once.

    Args:
        ex: The explanation, in torque of the Kp that was stated or estimated.
        servo: What the servos of the recordings share.
        given: The recordings, with their drives as stated.
        made: The same with drives whose gains are complete.
    """
    n, out = ex.lib.robot.n, []
    more = np.array([ex.kp_scale(j, servo.drive)[0] for j in range(n)])
    for r, m in zip(given, made, strict=True):
        assert m.drive is not None
        stated = r.drive or unknown_drive(n)
        known = np.isfinite(m.drive.kp)
        said = tuple(PAYLOAD if one else word for one, word in zip(known, stated.said, strict=True))
        drive = dataclasses.replace(stated, kp=m.drive.kp / (1.0 + more), kp_width=m.drive.kp_width, said=said)
        out.append(dataclasses.replace(r, drive=drive))
    return out


def motion_notes(robot: Robot, fit: MotionFit | None) -> list[str]:
    """What a fit to the motion changed."""
    if fit is None:
        return []
    said = [
        "The parameters of what is named, and of the servos, are those with which a simulation from the commands "
        "follows the positions best, beside what the torque says of them: on motions that the fit did not see it is "
        f"nearer to the positions by {100 * fit.improvement:.0f} %. Standard deviations hold by how much torque and "
        "motion disagree."
    ]
    if stronger := _each(robot, fit.torque_gains, lambda x: f"{1.0 + x:.3g}"):
        said.append(
            f"By the motion the servos give, in parts of the torque that is stated, {stronger}; corrected.xml has it "
            "in their gains."
        )
    if rotors := _each(robot, fit.rotors, digits):
        said.append(
            f"A rotor inertia in kg m^2 (kg where the joint slides) of {rotors} makes the simulation follow the motion "
            "better, while the torque leaves open whether it is there: it is in the corrected model and not named."
        )
    return said


def _each(robot: Robot, numbers: Mapping[int, tuple[float, float]], words: Callable[[float], str]) -> str:
    """Numbers with their standard deviations, by joint."""
    return ", ".join(f"{words(x)} +- {digits(std, 1)} on {robot.joint_names[j]}" for j, (x, std) in numbers.items())


def gain_notes(ex: Explanation, servo: Commanded) -> list[str]:
    """What the masses of the model, or a known payload, say of the gains."""
    shown = [j for j, said in enumerate(servo.drive.said) if said == PAYLOAD]
    if shown:
        each = []
        for j in shown:
            more, unsure = ex.kp_scale(j, servo.drive)
            kp, unit = servo.drive.kp[j] / (1.0 + more), "N/m" if ex.lib.robot.is_slide[j] else "N m/rad"
            each.append(f"{digits(kp, 4)} +- {digits(kp * unsure, 1)} {unit} on {ex.lib.robot.joint_names[j]}")
        return [f"By what the known payload adds to the torque, Kp is {', '.join(each)}."]
    known = [j for j, said in enumerate(servo.drive.said) if said in ("model", "map")]
    if not known:
        return []
    each = [(ex.lib.robot.joint_names[j], *ex.kp_scale(j, servo.drive)) for j in known]
    said = ", ".join(f"{name} {100 / (1 + more):.0f} +- {100 * unsure:.0f} %" for name, more, unsure in each)
    return [
        f"By the masses of the model Kp is really, in parts of what is stated: {said}; masses that the model lacks "
        "would look the same. Friction and limits are found in torque of the stated gains; the standard deviations of "
        "their parameters hold the difference."
    ]


def command_notes(ex: Explanation, servo: Commanded) -> list[str]:
    """How late all servos apply their commands, where that is not stated, and notes where recordings or servos differ.

    The odds are the ratio of prior and posterior density where it is zero (Savage and Dickey) times the prior odds of
    any rare effect.
    """
    more, unsure = ex.command_delay(servo.drive)
    late, lag = float(np.min(servo.drive.delay)) + more, ex.torque_lag(servo.drive)
    out = [] if max(late, lag) < unsure or not servo.drive.common_delay_width else [
        f"Commands of all joints are taken to act {digits(1e3 * late)} +- {digits(1e3 * unsure, 1)} ms after their "
        f"row, and torque to lag {digits(1e3 * lag)} ms more: so the recordings suit the model best. Where the time is "
        "lost can't be told from the fit: whether commands are held from row to row or taken up late, the drive's "
        "torque lags, or the clocks are out of step. State [command_delay] in the map if it is known."
    ]  # fmt: skip
    phases, spreads = ex.phases(servo.drive)
    apart = [log_odds_of_any(p, s, servo.drive.phase_width) for p, s in zip(phases, spreads, strict=True) if s > 0.0]
    if max(apart, default=-np.inf) + np.log(settings.RARE) > 0.0:
        out.append(
            "The recordings begin at different moments of the controller's cycle: commands of one recording act "
            f"{digits(1e3 * abs(min(phases)))} ms before the mean of all recordings, of another "
            f"{digits(1e3 * max(phases))} ms after it. The fit takes this into account."
        )
    for j in range(ex.lib.robot.n):
        own, spread = ex.own_nuisance(j, COMMAND_DELAY)
        odds = log_odds_of_any(own, spread, 1.0) + np.log(settings.RARE)
        if odds > 0.0 and abs(servo.drive.time_width * own) > settings.NOTABLE_DELAY:
            late, width = 1e3 * servo.drive.time_width * own, 1e3 * servo.drive.time_width * spread
            way = "late" if own > 0 else "early"
            out.append(
                f"Commands of {ex.lib.robot.joint_names[j]} act {digits(abs(late))} +- {digits(width, 1)} ms {way}; "
                "the fit takes this into account. It can't tell whether the drive applies its commands late, its "
                "torque lags, or the clocks are out of step."
            )
    return out


def servo_sentence(recordings: Sequence[Recording]) -> str:
    """A sentence for the summary; empty where torque was logged."""
    drives = [r.drive for r in recordings if r.is_servo_log and r.drive is not None]
    if not drives:
        return ""
    guessed = [name for name, said in zip(recordings[0].joint_names, drives[0].said, strict=True) if said == "estimate"]
    unit = f" On {', '.join(guessed)} Kp is estimated, so torques are in units of that Kp." if guessed else ""
    return (
        f" No torque was logged; it was computed by the law of the servos, Kp (qdes - q) - Kd qd.{unit} Effects found "
        "in such logs are less certain than their probabilities say: on real servos several of them were wrong "
        "(docs/real-machines.md)."
    )
