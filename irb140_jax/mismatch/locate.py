"""Where recording and model part: over position and speed, in time, in frequency, link by link.  Data for people."""

from typing import Any

import numpy as np
from scipy import signal

from irb140_jax.mismatch.explanation import Explanation
from irb140_jax.mismatch.prove import HeldOut
from irb140_jax.robot import Robot

BINS = 14  # a side of the heat maps
FEW = 4  # rows below which a bin stays empty
TRACE_POINTS = 900  # more than a figure can show


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


def traces(robot: Robot, ex: Explanation, proof: HeldOut, names: list[str]) -> dict[str, Any]:
    """Measured and modelled torque of each joint on data the fit did not see, from the liveliest recording."""
    out = {}
    for j, name in enumerate(robot.joint_names):
        r = int(np.argmax([np.mean(s.qd[:, j] ** 2) for s in ex.data.stretches]))
        s = ex.data.stretches[r]
        rows = slice(0, None, max(1, len(s.t) // TRACE_POINTS))
        measured = s.tau[rows, j]
        out[name] = {
            "recording": names[r], "t": s.t[rows].tolist(), "measured": measured.tolist(),
            **{k: (measured - getattr(proof, k)[r][rows, j]).tolist() for k in ("nominal", "refit", "corrected")},
        }  # fmt: skip
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
