"""Motion error over the horizon: from recorded starts under recorded torque or commands, and where the robot went."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.motion.inputs import Inputs, time_steps
from irb140_jax.mismatch.motion.laws import beyond_numbers
from irb140_jax.mismatch.motion.models import (
    FILE,
    Simulated,
    compiled_robot,
    followers,
    leading,
    led,
    positions_of,
    simulated,
)
from irb140_jax.mismatch.motion.sentences import MODELS, sentences, subject
from irb140_jax.mismatch.motion.windows import LONGEST, Span, Window, windows
from irb140_jax.oracle.rollout import tool_positions
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.robot import Robot

SCHEMA = 1  # of motion.json
TIMES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0)  # [s] of the horizon at which errors are kept


def proof_in_motion(
    robot: Robot, of_fold: Callable[[int], CorrectedModel], unseen: Sequence[Span], recordings: Sequence[Conditioned],
    missing: Sequence[np.ndarray],
) -> dict[str, Any] | None:  # fmt: skip
    """What motion.json holds.

    Args:
        robot: The model as given.
        of_fold: The corrected model that has not seen a fold.
        unseen: What each fold leaves out.
        recordings: The conditioned recordings.
        missing: What corrected.xml can't hold along each, from `beyond_file`, but for `beyond_numbers` [N m or N].

    Returns:
        Errors of each model by joint and at the tool; None where nothing can be simulated.
    """
    grids = [r.t for r in recordings]
    short = windows(list(unseen), grids)
    runs = [w for w in windows(list(unseen), grids, LONGEST, 1) if recordings[w.recording].t[w.last] - recordings[
        w.recording].t[w.first] > 2.0 * TIMES[-1]]  # fmt: skip
    if not short:
        return None
    (step, parts), of_servos = time_steps(recordings), recordings[0].servo is not None
    nominal, ready = compiled_robot(robot, step / parts), {}
    for fold in dict.fromkeys(w.fold for w in (*short, *runs)):
        made = simulated(of_fold(fold), nominal, step / parts)
        if made is None or nominal.nv != robot.n:
            return None
        ready[fold] = made
    follow = followers([*ready.values()], recordings)
    if follow.all():
        return None
    if follow.any():
        ready = {fold: dataclasses.replace(m, compiled=led(m.compiled, follow)) for fold, m in ready.items()}
    titles = lambda laws: [*dict.fromkeys(n.effect.title for n in laws if n.effect.export.not_in_mjcf)]  # noqa: E731
    beside = titles(n for m in ready.values() for n in beyond_numbers(m.model))
    lacking = [x for x in titles(n for m in ready.values() for n in m.model.named) if x not in beside]
    names = (*MODELS, FILE) if lacking or beside else MODELS
    logged = [0.0 * r.tau if of_servos else r.tau for r in recordings]
    applied = lambda name, w: leading(  # noqa: E731
        ready[w.fold].torque(name, logged[w.recording], missing[w.recording]), recordings[w.recording], follow
    )
    at = _errors(ready, names, applied, Inputs(recordings, short, parts, step), np.array(TIMES))
    times = np.linspace(0.0, LONGEST, 41)[1:]
    over = _errors(ready, names, applied, Inputs(recordings, runs, parts, step), times) if runs else {}
    free, units = np.flatnonzero(~follow).tolist(), ["m" if slide else "rad" for slide in robot.is_slide]
    out = {
        "schema": SCHEMA,
        "driven_by": "commands" if of_servos else "torque",
        "horizon": list(TIMES),
        "windows": len(short),
        "runs": len(runs),
        "tool": _by_model({name: 1e3 * x[..., -1] for name, x in at.items()}, "mm"),
        "joints": {
            robot.joint_names[j]: _by_model({name: x[..., j] for name, x in at.items()}, units[j]) for j in free
        },
        "whole_run": _over_runs(over, {robot.joint_names[j]: (j, units[j]) for j in free}),
        "followed": [robot.joint_names[j] for j in np.flatnonzero(follow)],
        "as_torque": lacking,
        "as_law": beside,
    }  # fmt: skip
    return out | {"shown": subject(out)[0].removeprefix("the "), "sentences": sentences(out)}


def _errors(
    models: dict[int, Simulated], names: Sequence[str], applied: Callable[[str, Window], np.ndarray],
    given: Inputs, times: np.ndarray,
) -> dict[str, np.ndarray]:  # fmt: skip
    """By model, and as "moved" for a robot that stays where it is: errors of all joints and, last, at the tool,
    shape (windows, times, n + 1) [rad, m]; NaN beyond the end of a window."""
    cut, recordings = given.cut, given.recordings
    tool_of = models[cut[0].fold].compiled["nominal"]
    n = recordings[0].q.shape[1]
    of_windows, servos, control = [models[w.fold] for w in cut], given.drives, given.control()
    true, still, simulated_ = (np.full((len(cut), len(times), n), np.nan) for _ in range(3))
    out = {}
    for name in names:
        tau = given.between(lambda w, name=name: applied(name, w))
        own = positions_of(of_windows, name, servos, given.start, given.speed, tau, control, given.began)
        for k, w in enumerate(cut):
            r = recordings[w.recording]
            rows = np.round(times / (r.t[1] - r.t[0])).astype(int)
            there = rows <= w.last - w.first
            true[k, there], still[k] = r.q[w.first + rows[there]], r.q[w.first]
            simulated_[k, there] = own[k, given.parts * rows[there]]
        out[name] = _apart(tool_of, simulated_, true)
    out["moved"] = _apart(tool_of, np.where(np.isnan(true), np.nan, still), true)
    return out


def _apart(model, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Distance of positions, joint by joint and at the tool; what flew away counts as infinite."""
    tool = np.linalg.norm(tool_positions(model, one) - tool_positions(model, other), axis=-1, keepdims=True)
    both = np.concatenate([np.abs(one - other), tool], axis=-1)
    known = np.isfinite(other).all(axis=-1, keepdims=True)
    return np.where(known & ~np.isfinite(both), np.inf, both)


def _by_model(errors: dict[str, np.ndarray], unit: str) -> dict[str, Any]:
    """Median and 90 % over the windows, at each time."""
    out: dict[str, Any] = {"unit": unit}
    for name, x in errors.items():
        usual, most = (_quantile(x, share) for share in (0.5, 0.9))
        out[name] = {"median": usual, "p90": most}
    return out


def _quantile(x: np.ndarray, share: float) -> list[float | None]:
    """Of what there is in each column; None where there is nothing, or it is infinite."""
    columns = ([v for v in column if not np.isnan(v)] for column in x.T)
    values = [float(np.quantile(column, share, method="inverted_cdf")) if column else np.inf for column in columns]
    return [v if np.isfinite(v) else None for v in values]


def _over_runs(errors: dict[str, np.ndarray], joints: dict[str, tuple[int, str]]) -> dict[str, Any] | None:
    """Median over all times of the whole runs; `joints` gives the number and the unit of each."""
    if not errors:
        return None
    joined = {name: np.moveaxis(x, -1, 0) for name, x in errors.items()}
    middle = {name: [_quantile(column.reshape(-1, 1), 0.5)[0] for column in x] for name, x in joined.items()}
    tool = {"unit": "mm"} | {name: None if m[-1] is None else 1e3 * m[-1] for name, m in middle.items()}
    each = {joint: {"unit": unit} | {name: m[j] for name, m in middle.items()} for joint, (j, unit) in joints.items()}
    return {"seconds": LONGEST, "tool": tool, "joints": each}
