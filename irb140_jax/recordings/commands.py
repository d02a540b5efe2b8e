"""Do the commands of a log belong to its positions?  Unit, sign and joint, judged without any model."""

import numpy as np

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.glance import at_a_glance
from irb140_jax.recordings.recording import Recording
from irb140_jax.robot import Robot

LATEST = 0.4  # s by which a joint may follow its command
FOLLOWS, NONE = 0.9, 0.5  # correlations that count as following and as not following
CLEARLY = 0.1  # by which another joint must follow better
DEGREES = 180.0 / np.pi


def check_commands(recording: Recording, robot: Robot) -> None:
    """Refuse commands in degrees, of the wrong sign or of another joint.

    Raises:
        RecordingError: One of them, beyond doubt.
    """
    assert recording.qdes is not None
    q, wanted = (at_a_glance(recording.t, x) for x in (recording.q, recording.qdes))
    names, n = recording.joint_names, robot.n
    step = float(recording.t[-1] - recording.t[0]) / len(q)
    alike = _correlations(q, wanted, int(LATEST / step))
    for j in range(n):
        said = f"{recording.source}: column qdes.{names[j]}"
        ratio = float(np.std(wanted[:, j]) / max(np.std(q[:, j]), 1e-12))
        if not robot.is_slide[j] and alike[j, j] > FOLLOWS and abs(np.log(ratio / DEGREES)) < np.log(1.5):
            raise RecordingError(f"{said} has {ratio:.3g} times the range of q.{names[j]}: this looks like degrees; "
                                 f"map it with --columns and [scale] \"qdes.{names[j]}\" = \"deg\"")
        if alike[j, j] < -FOLLOWS and np.corrcoef(q[:, j], wanted[:, j])[0, 1] < -NONE:
            raise RecordingError(f"{said} goes against q.{names[j]}: one of them is of the wrong sign; map it with "
                                 f"--columns and [sign] \"qdes.{names[j]}\" = -1")
        others = [k for k in range(n) if k != j and alike[j, k] > FOLLOWS and alike[k, j] > FOLLOWS]
        k = others[0] if others else j
        if others and max(abs(alike[j, j]), abs(alike[k, k])) < min(alike[j, k], alike[k, j]) - CLEARLY:
            raise RecordingError(f"{said} is followed by q.{names[k]}, and qdes.{names[k]} by q.{names[j]}: put the "
                                 "columns in order, or exchange them with --columns FILE.toml")


def _correlations(q: np.ndarray, wanted: np.ndarray, most: int) -> np.ndarray:
    """Correlation of every position with every command at the delay where it is strongest, shape (n, n)."""
    best = np.zeros((q.shape[1], wanted.shape[1]))
    for late in range(0, most + 1, max(1, most // 10)):
        a, b = q[late:], wanted[: len(wanted) - late]
        a, b = (x - x.mean(axis=0) for x in (a, b))
        size = np.outer(np.linalg.norm(a, axis=0), np.linalg.norm(b, axis=0))
        now = a.T @ b / np.maximum(size, 1e-12)
        best = np.where(np.abs(now) > np.abs(best), now, best)
    return best
