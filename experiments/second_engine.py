"""The engine in which laws may be wrong (docs/decisions/30), for `testbed.runner`, beside the first on the same cases.

    PYTHONPATH=experiments python -m testbed.runner work --label discrepancy --call second_engine:diagnose
    python -m testbed.compare work discrepancy
"""

from collections.abc import Sequence

from irb140_jax import mismatch
from irb140_jax.mismatch.diagnose import DiagnoseConfig, Result
from irb140_jax.recordings import Recording
from irb140_jax.robot import Robot


def diagnose(robot: Robot, recordings: Sequence[Recording]) -> Result:
    """A diagnosis by the second engine, with the options that the first one has by default."""
    return mismatch.diagnose(robot, recordings, DiagnoseConfig(discrepancy=True))
