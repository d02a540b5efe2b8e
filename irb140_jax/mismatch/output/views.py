"""Where recording and model part: over position and speed, in time, in frequency, link by link.  Data for people."""

from typing import Any

import numpy as np
from scipy import signal

from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.held_out import HeldOut
from irb140_jax.robot import Robot

BINS = 14  # a side of the heat maps
FEW = 4  # rows below which a bin stays empty
TRACE_POINTS = 900  # of a joint along a recording: more than a figure can show
FEWEST_POINTS = 150  # below which a motion of half a minute can't be recognised
MOST_NUMBERS = 30_000  # points of all joints and recordings together: some 1.5 MB in the report


def heat_map(q: np.ndarray, qd: np.ndarray, edges: tuple[np.ndarray, np.ndarray], r: np.ndarray) -> list[list]:
    """Mean residual by position (rows) and speed (columns); None where the motion never was."""
    count, _, _ = np.histogram2d(q, qd, bins=edges)
    total, _, _ = np.histogram2d(q, qd, bins=edges, weights=r)
    mean = total / np.maximum(count, 1)
    return [
        [None if c < FEW else float(m) for m, c in zip(ms, cs, strict=True)] for ms, cs in zip(mean, count, strict=True)
    ]


def maps(robot: Robot, ex: Explanation, proof: HeldOut) -> dict[str, Any]:
    """Residual of nominal and corrected model over position and speed of each joint."""
    out = {}
    for j, name in enumerate(robot.joint_names):
        use = [s.use[:, j] for s in ex.data.stretches]
        q = np.concatenate([s.q[u, j] for s, u in zip(ex.data.stretches, use, strict=True)])
        qd = np.concatenate([s.qd[u, j] for s, u in zip(ex.data.stretches, use, strict=True)])
        if len(q) < 50:
            continue
        top = np.max(np.abs(qd))
        edges = (np.linspace(q.min(), q.max() + 1e-12, BINS + 1), np.linspace(-top, top, BINS + 1))
        nominal, corrected = (
            np.concatenate([r[u, j] for r, u in zip(x, use, strict=True)]) for x in (proof.nominal, proof.corrected)
        )
        out[name] = {
            "q_edges": edges[0].tolist(), "qd_edges": edges[1].tolist(),
            "nominal": heat_map(q, qd, edges, nominal), "corrected": heat_map(q, qd, edges, corrected),
            "unit": "N" if robot.is_slide[j] else "N m",
        }  # fmt: skip
    return out


def motions(robot: Robot, ex: Explanation, proof: HeldOut, names: list[str]) -> list[dict[str, Any]]:
    """Position, speed, measured and modelled torque of every joint along every recording, on data the fit did not see.

    Thinned evenly, so that a report of many recordings and joints stays a file that opens at once.
    """
    points = int(np.clip(MOST_NUMBERS / (len(names) * robot.n), FEWEST_POINTS, TRACE_POINTS))
    out = []
    for r, (source, s) in enumerate(zip(names, ex.data.stretches, strict=True)):
        rows = slice(0, None, -(-len(s.t) // points))
        joints = {}
        for j, name in enumerate(robot.joint_names):
            measured = s.tau[rows, j]
            joints[name] = {
                "q": s.q[rows, j].tolist(), "qd": s.qd[rows, j].tolist(), "measured": measured.tolist(),
                **{k: (measured - getattr(proof, k)[r][rows, j]).tolist() for k in ("nominal", "refit", "corrected")},
            }  # fmt: skip
        out.append({"recording": source, "t": s.t[rows].tolist(), "joints": joints})
    return out


def spectra(robot: Robot, ex: Explanation, proof: HeldOut) -> dict[str, Any]:
    """Amplitude spectral density of the residuals of each joint [N m/sqrt(Hz)], averaged over the recordings."""
    out = {}
    length = min(256, *(len(s.t) for s in ex.data.stretches))
    for j, name in enumerate(robot.joint_names):
        out[name] = {}
        for kind in ("nominal", "refit", "corrected"):
            density = []
            for s, r in zip(ex.data.stretches, getattr(proof, kind), strict=True):
                rate = (len(s.t) - 1) / (s.t[-1] - s.t[0])
                f, p = signal.welch(np.where(s.use[:, j], r[:, j], 0.0), rate, nperseg=length)
                density.append(p)
            out[name]["f"] = f.tolist()
            out[name][kind] = np.sqrt(np.mean(density, axis=0)).tolist()
    return out
