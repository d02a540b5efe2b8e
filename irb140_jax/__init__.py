"""Differentiable dynamics of serial arms, and a diagnosis of the physics a model left out."""

import importlib
import os
import sys
from typing import TYPE_CHECKING

# Every formula here is meant in double precision; this is the one place that says so.  Through the environment where
# JAX has yet to be imported, so that `irb140 --help` need not pay for importing it.
if "jax" in sys.modules:
    sys.modules["jax"].config.update("jax_enable_x64", True)
else:
    os.environ["JAX_ENABLE_X64"] = "1"

if TYPE_CHECKING:
    from irb140_jax import control as control
    from irb140_jax import dynamics as dynamics
    from irb140_jax import effects as effects
    from irb140_jax import identify as identify
    from irb140_jax import kinematics as kinematics
    from irb140_jax import learned as learned
    from irb140_jax import mismatch as mismatch
    from irb140_jax import oracle as oracle
    from irb140_jax import recordings as recordings
    from irb140_jax import report as report
    from irb140_jax import robot as robot
    from irb140_jax import simulate as simulate
    from irb140_jax import swarm as swarm
    from irb140_jax.library import Diagnosis as Diagnosis
    from irb140_jax.library import diagnose as diagnose
    from irb140_jax.library import read_recording as read_recording
    from irb140_jax.mismatch import CorrectedMujoco as CorrectedMujoco
    from irb140_jax.mismatch import load_corrected as load_corrected
    from irb140_jax.recordings import Recording as Recording
    from irb140_jax.recordings.excite import fourier_motion as fourier_motion
    from irb140_jax.robot import Robot as Robot
    from irb140_jax.robot import irb140 as irb140
    from irb140_jax.robot import load_robot as load_robot
    from irb140_jax.trajectory import Trajectory as Trajectory

    __version__: str

_SUBPACKAGES = (
    "control", "dynamics", "effects", "identify", "kinematics", "learned", "mismatch", "oracle", "recordings", "report",
    "robot", "simulate", "swarm",
)
_REEXPORTED = {
    "CorrectedMujoco": "mismatch", "Diagnosis": "library", "Recording": "recordings", "Robot": "robot",
    "diagnose": "library", "fourier_motion": "recordings.excite", "irb140": "robot", "load_corrected": "mismatch",
    "load_robot": "robot", "read_recording": "library", "Trajectory": "trajectory",
}
__all__ = [*_SUBPACKAGES, *_REEXPORTED]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str):
    """Import a public name when it is first used."""
    if name in _SUBPACKAGES:
        return importlib.import_module(f"irb140_jax.{name}")
    if name in _REEXPORTED:
        return getattr(importlib.import_module(f"irb140_jax.{_REEXPORTED[name]}"), name)
    if name == "__version__":
        from importlib import metadata

        return metadata.version("irb140_jax")
    raise AttributeError(f"module 'irb140_jax' has no attribute {name!r}; it has {', '.join(__all__)}")


def __dir__() -> list[str]:
    """Every public name, so that TAB finds what is imported only when it is used."""
    return sorted([*__all__, "__version__"])
