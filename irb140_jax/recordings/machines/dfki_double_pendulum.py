"""A torque-controlled double pendulum (two AK80-6 motors, 6:1): published runs of two designs, and two models of each.

Joint 1 is zero hanging down, joint 2 relative to it, both turn about x.  The published inertias are about the joints;
the published URDF puts them at the centres of mass, which counts m r^2 twice.  `pendulum_model` has them right,
`pendulum_model_with_mistake` is the URDF as published.

Source: github.com/dfki-ric-underactuated-lab/double_pendulum (BSD-3-Clause); Wiebe et al., IEEE RAM 2024,
doi 10.1109/MRA.2023.3341257; see `sources`.
"""

import pathlib
import re
from collections.abc import Mapping

import pandas as pd

from irb140_jax.errors import RecordingError
from irb140_jax.recordings.machines.folder import published_file
from irb140_jax.recordings.machines.sources import SOURCES
from irb140_jax.recordings.recording import Recording, write_recording

MACHINE = "dfki_double_pendulum"
JOINTS = ("Joint1", "Joint2")
# Model without friction and rotor inertia, by design, and the runs kept for testing.
MODELS = {"C.1": "model_1.1", "A.0": "model_2.1"}
TEST_RUNS = {"C.1": ("20230629-143601", "20230629-143747", "20230629-144115", "20230629-154548"),
             "A.0": ("trajectory_02", "trajectory_05", "trajectory_11", "trajectory_13")}


def pendulum_runs(design: str) -> tuple[str, ...]:
    """Names of the published runs of a design, "C.1" or "A.0".

    Raises:
        RecordingError: There is no such design.
    """
    if design not in MODELS:
        raise RecordingError(f"the double pendulum has no design '{design}'; allowed is {', '.join(MODELS)}")
    names = (pathlib.PurePosixPath(name) for name in SOURCES[MACHINE].files)
    return tuple(name.stem for name in names if name.parent.name == f"design_{design}" and name.suffix == ".csv")


def pendulum_recording(design: str, run: str, folder: pathlib.Path | None = None) -> Recording:
    """One run: measured positions [rad], velocities [rad/s] and torque from motor current on the joint side [N m].

    The commanded torque stays as the extra columns tau_con.<joint>.

    Args:
        design: "C.1" or "A.0".
        run: One of `pendulum_runs(design)`.
        folder: Where the published files are; by default `recordings_folder`.
    """
    if run not in pendulum_runs(design):
        raise RecordingError(f"design {design} has no run '{run}'; allowed is {', '.join(pendulum_runs(design))}")
    frame = pd.read_csv(published_file(MACHINE, f"design_{design}/{run}.csv", folder))
    pair = lambda name: frame[[f"{name}1", f"{name}2"]].to_numpy(float)  # noqa: E731
    return Recording(
        t=frame["time"].to_numpy(float), q=pair("pos_meas"), qd=pair("vel_meas"), tau=pair("tau_meas"),
        extras={f"tau_con.{joint}": pair("tau_con")[:, i] for i, joint in enumerate(JOINTS)},
        joint_names=JOINTS, source=run,
    )


def pendulum_model(design: str, folder: pathlib.Path | None = None) -> str:
    """MJCF of the published rigid links, inertias moved from the joints to the centres of mass: I_com = I - m r^2."""
    p = _parameters(design, folder)
    com = [p[f"I{i}"] - p[f"m{i}"] * p[f"r{i}"] ** 2 for i in (1, 2)]
    # The pendulum is plane: only the inertia about x matters, so the tensor is that of a ball.
    inertial = [f'<inertial pos="0 0 {-p[f"r{i}"]}" mass="{p[f"m{i}"]}" diaginertia="{c} {c} {c}"/>'
                for i, c in zip((1, 2), com, strict=True)]
    return f"""<mujoco model="double_pendulum_{design}">
  <compiler angle="radian" autolimits="true"/>
  <option gravity="0 0 {-p["g"]}"/>
  <worldbody>
    <body name="link_1">
      <joint name="Joint1" axis="1 0 0"/>
      {inertial[0]}
      <geom type="capsule" fromto="0 0 0 0 0 {-p["l1"]}" size="0.015" contype="0" conaffinity="0"/>
      <body name="link_2" pos="0.05 0 {-p["l1"]}">
        <joint name="Joint2" axis="1 0 0"/>
        {inertial[1]}
        <geom type="capsule" fromto="0 0 0 0 0 {-p["l2"]}" size="0.012" contype="0" conaffinity="0"/>
        <site name="tip" pos="0 0 {-p["l2"]}"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def pendulum_model_with_mistake(design: str, folder: pathlib.Path | None = None) -> str:
    """The URDF as published, pivot inertias at the centres of mass, with the `world` link it lacks, without meshes."""
    path = published_file(MACHINE, f"design_{design}/{MODELS[design]}_pendubot.urdf", folder)
    text = path.read_text(encoding="utf-8")
    text = re.sub(r"<(visual|collision)>.*?</\1>", "", text, flags=re.DOTALL)
    return re.sub(r"(<robot [^>]*>)", r'\1\n  <link name="world"/>', text, count=1)


def write_pendulum(
    out: pathlib.Path, design: str, folder: pathlib.Path | None = None, *, suffix: str = ".csv"
) -> tuple[Mapping[str, pathlib.Path], Mapping[str, pathlib.Path]]:
    """Write both models and all runs of a design as contract files.

    Returns:
        Models by "correct" and "mistake", recordings by the name of the run.
    """
    texts = {"correct": (f"pendulum_{design}.xml", pendulum_model(design, folder)),
             "mistake": (f"pendulum_{design}_mistake.urdf", pendulum_model_with_mistake(design, folder))}
    out.mkdir(parents=True, exist_ok=True)
    for name, text in texts.values():
        (out / name).write_text(text, encoding="utf-8")
    runs = {run: write_recording(pendulum_recording(design, run, folder), out / f"{run}{suffix}")
            for run in pendulum_runs(design)}
    return {key: out / name for key, (name, _) in texts.items()}, runs


def _parameters(design: str, folder: pathlib.Path | None) -> dict[str, float]:
    """The published parameters: lines of `name: number`."""
    pendulum_runs(design)
    path = published_file(MACHINE, f"design_{design}/{MODELS[design]}_parameters.yml", folder)
    lines = path.read_text(encoding="utf-8").splitlines()
    return {name: float(value) for name, value in (line.split(":") for line in lines if ":" in line)}
