"""What second encoders behind the transmissions show, beside what torque alone has named there.

Positions `q` are the motors'.  Columns `q_link.<joint>` of a recording show by how much the link is elsewhere:

    q_link - q = -carried / K - gap / 2 sign(carried) + A sin(2 pi n q) + B cos(2 pi n q) + C q + D

carried is the torque that the transmission transmits; C is an error of the gear's ratio or of a scale, D one of a zero.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from irb140_jax.mismatch import settings
from irb140_jax.mismatch.corrected.model import CorrectedModel, torques_along
from irb140_jax.mismatch.records import digits
from irb140_jax.mismatch.regression.sufficient_data import Comparison
from irb140_jax.mismatch.result import Finding
from irb140_jax.recordings.condition import condition
from irb140_jax.recordings.recording import Recording

FAR = 0.5  # [rad or m] further from its motor is no link: a column in degrees, or of another joint
REVERSING = 0.2  # of the torque carried, RMS: within it the link may be between its flanks
COARSEST, FINEST = 4, 100  # cycles over a joint's range between which errors of the transmission are looked for
# What torque alone may have named there.
ALIKE = ("joint_elasticity", "backlash", "torque_ripple")


class Bend(NamedTuple):
    """What a link encoder shows of one joint: values and standard deviations.

    Attributes:
        compliance: Of the transmission [rad/(N m) or m/N].
        gap: Play [rad or m].
        error: Amplitude of the transmission's error [rad or m].
        cycles: How often that comes back [1/rad or 1/m].
    """

    compliance: tuple[float, float]
    gap: tuple[float, float]
    error: tuple[float, float]
    cycles: float


def link_encoder_notes(data: Comparison, model: CorrectedModel, found: Sequence[Finding]) -> list[str]:
    """A sentence for each joint with a second encoder: what that shows, and what torque alone says.

    Args:
        data: Recordings, those of a joint with a column `q_link.<joint>` in all of them.
        model: The corrected model, whose torque the transmissions carry.
        found: The findings.
    """
    out, names = [], data.robot.joint_names
    watched = [j for j, name in enumerate(names) if all(f"q_link.{name}" in r.extras for r in data.recordings)]
    if not watched:
        return out
    carried = [torques_along(model, r).loads.carried for r in data.smooth]
    apart = [_apart(r, names, watched) for r in data.recordings]
    largest = np.max([np.abs(x - np.median(x, axis=0)).max(axis=0) for x in apart], axis=0)
    for j in watched:
        if largest[j] > FAR:
            out.append(f"q_link.{names[j]} is up to {largest[j]:.3g} away from q.{names[j]} and is not used: check its "
                       "unit, and which joint it is of.")  # fmt: skip
            continue
        bend = _bend(data, apart, [x[:, j] for x in carried], j)
        out.append(_sentence(names[j], bend, data.robot.is_slide[j], [f for f in found if f.joints == (names[j],)]))
    return out


def _apart(recording: Recording, names: Sequence[str], watched: Sequence[int]) -> np.ndarray:
    """Link less motor position of watched joints, else zero, at every row, (T, n); what is missing is interpolated."""
    out = np.zeros_like(recording.q)
    for j in watched:
        link = recording.extras[f"q_link.{names[j]}"]
        there = np.isfinite(link)
        if there.sum() > 1:
            out[:, j] = np.interp(recording.t, recording.t[there], link[there]) - recording.q[:, j]
    return out


def _bend(data: Comparison, apart: Sequence[np.ndarray], carried: Sequence[np.ndarray], j: int) -> Bend:
    """Least squares over all recordings; standard deviations by leaving out a part of them at a time."""
    band, rows = data.band, []
    size = np.sqrt(np.mean(np.concatenate(carried) ** 2)) + 1e-300
    for r, smooth, bend, load in zip(data.recordings, data.smooth, apart, carried, strict=True):
        # Through the very filters that torque passes.
        seen = condition(replace(r, tau=bend, qdes=None, drive=None), band).tau[:, j]
        x = np.stack([-load, -0.5 * np.sign(load), smooth.q[:, j], np.ones(len(load)), seen], axis=1)
        x = np.concatenate([band.apply(x), smooth.q[band.kept(len(load)), j][:, None]], axis=1)
        pressed = np.abs(load[band.kept(len(load))]) > REVERSING * size
        use = smooth.usable[band.kept(len(load)), j] & pressed
        edges = np.linspace(0, len(x), settings.BLOCKS + 1).astype(int)
        rows += [x[a:b][use[a:b]] for a, b in zip(edges[:-1], edges[1:], strict=True)]
    everything = np.concatenate(rows)
    cycles = _cycles(everything)
    for wave in (True, False):
        values = partial(_fitted, cycles=cycles, wave=wave)
        without = np.array([values(np.concatenate(rows[:k] + rows[k + 1 :])) for k in range(len(rows))])
        spread = np.sqrt((len(rows) - 1) / len(rows) * np.sum((without - without.mean(axis=0)) ** 2, axis=0))
        compliance, gap, error = zip(values(everything).tolist(), spread.tolist(), strict=True)
        bend = Bend(compliance, gap, error, cycles)
        # Of hundreds of waves the best is beyond chance now and then, but not beyond a single position's noise.
        if _clear(bend.error, max(r.q_noise[j] for r in data.smooth)):
            break
        bend = bend._replace(error=(0.0, 0.0))  # it only blurs what else there is
    return bend


def _clear(x: tuple[float, float], least: float = 0.0) -> bool:
    return x[0] > max(settings.VISIBLE * x[1], least)


def _cycles(rows: np.ndarray) -> float:
    """How often per unit of position what all else leaves comes back: where a sine takes most of it."""
    X, y, q = rows[:, :4], rows[:, 4], rows[:, 5]
    size = np.sqrt(np.mean(X**2, axis=0)) + 1e-300
    left = y - X @ (np.linalg.lstsq(X / size, y, rcond=None)[0] / size)
    tried = np.arange(COARSEST, FINEST, 0.25) / max(float(np.ptp(q)), 1e-12)
    power = [np.abs(np.exp(2j * np.pi * n * q) @ left) for n in tried]
    return float(tried[np.argmax(power)])


def _fitted(rows: np.ndarray, cycles: float, wave: bool) -> np.ndarray:
    """Compliance, play and amplitude of the transmission's error."""
    angle = 2.0 * np.pi * cycles * rows[:, 5]
    X = np.concatenate([rows[:, :4], wave * np.stack([np.sin(angle), np.cos(angle)], axis=1)], axis=1)
    size = np.sqrt(np.mean(X**2, axis=0)) + 1e-300
    w = np.linalg.lstsq(X / size, rows[:, 4], rcond=None)[0] / size
    return np.array([w[0], w[1], np.hypot(w[4], w[5])])


def _sentence(name: str, bend: Bend, slide: bool, found: Sequence[Finding]) -> str:
    """What is clear of it, and what torque alone names."""
    q, tau = ("m", "N") if slide else ("rad", "N m")
    said = []
    if _clear(bend.compliance):
        # The torque that bends it is as uncertain as the torque constant.
        K, share = 1.0 / bend.compliance[0], np.hypot(bend.compliance[1] / bend.compliance[0], settings.GAIN_JOINT)
        said.append(f"a stiffness of {digits(K, 3)} +- {digits(K * float(share), 1)} {tau}/{q}")
    if _clear(bend.gap):
        said.append(f"play of {digits(bend.gap[0])} +- {digits(bend.gap[1], 1)} {q}")
    if _clear(bend.error):
        said.append(f"an error of the transmission of {digits(bend.error[0])} +- {digits(bend.error[1], 1)} {q} that "
                    f"comes back {digits(bend.cycles)} times per {q}")  # fmt: skip
    shows = ", ".join(said) or (
        f"no bending, no play above {digits(settings.VISIBLE * bend.gap[1], 1)} {q} and no error of the transmission")
    named = [
        f"{f.effect.replace('_', ' ')} ({', '.join(_number(f, parameter) for parameter in f.parameters)})"
        for f in found if f.effect in ALIKE
    ]  # fmt: skip
    return f"The second encoder of {name} shows {shows}; torque alone names {', '.join(named) or 'none of these'}."


def _number(finding: Finding, parameter: str) -> str:
    p = finding.parameters[parameter]
    return f"{parameter.replace('_', ' ')} {digits(p.value or 0.0)} +- {digits(p.std or 0.0, 1)} {p.unit}"
