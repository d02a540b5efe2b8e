"""Tables 1 and 2 of the study: Denavit-Hartenberg parameters and mass properties of the arm, and checks of both.

    python experiments/tables_1_2_arm.py [--robot arm.xml] [--joints n]

The study's cells are not known.  Its Table 2 follows a recipe that others followed, too: 98 kg spread evenly over the
maker's CAD.  Beside ours stand another group's figures for the IRB 140, and the maker's own simulator's torque at rest.
"""

import dataclasses
import json

import jax.numpy as jnp
import numpy as np
import tyro
from study_arm import StudyArm, StudyConfig
from study_provenance import made

from irb140_jax import dynamics, kinematics
from irb140_jax.robot import first_joints, irb140

QUANTITIES = ("m", "cx", "cy", "cz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
UNITS = ("kg", *["m"] * 3, *["kg m²"] * 6)
# Carter (2009, M.S. thesis, Penn State), as kept in Corke's toolbox; links 3 to 6 are lumped.  In its own frames:
# kg; m; kg m^2 as Ixx, Iyy, Izz and the integrals of xy, xz, yz, which are the tensor's elements with the other sign.
CARTER_MASS = (34.65536, 15.99459, 20.86205)
CARTER_COM = ((0.02787, 0.04312, -0.08903), (0.19829, 0.00973, 0.09243), (-0.00456, -0.07996, -0.00586))
CARTER_MOMENTS = (
    (0.51205, 0.46407, 0.46275, 0.00136, 0.05131, 0.07034),
    (0.09482, 0.32860, 0.27746, -0.00386, 0.03793, -0.00109),
    (0.50006, 0.07515, 0.51542, -0.00186, 0.00093, -0.01520),
)
# Columns: axes of those frames in ours, which are parallel to the base at zero.  Frames 2 and 3 of modified
# Denavit-Hartenberg have x along the upper arm, at the standard zero pose of that file.
CARTER_AXES = (
    np.eye(3),
    np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
)
# RobotStudio's virtual controller at rest, no tool: joint positions [deg] and torques [N m].
REST_POSITION = (71.69, 20.41, -71.98, 60.20, 42.35, 13.33)
REST_TORQUE = (0.01, -47.82, -14.90, 0.12, -0.06, 0.00)
# The same simulator's tool centre point [mm] at these positions [deg].
TCP_POSITION, TCP = (52.8, -2.0, 10.0, 13.0, 56.0, 28.0), (269.92581, 375.66383, 601.84100)


@dataclasses.dataclass(frozen=True)
class Config(StudyConfig):
    """Which arm, and where to write."""


def run(arm: StudyArm) -> dict:
    """Both tables; for the IRB 140 what others say of it."""
    n = len(arm.links)
    table = kinematics.dh_of(arm.whole).table
    slide = [bool(s) for s in arm.whole.is_slide]
    columns = [np.degrees(table.offset), 1e3 * np.asarray(table.d), 1e3 * np.asarray(table.a), np.degrees(table.alpha)]
    told = {
        "arm": arm.name, "joints": list(arm.whole.joint_names), "slide": slide,
        "dh": np.stack(columns, axis=1).round(9).tolist(),
        "links": _links(arm.whole, n), "lumped": _links(arm.reduced(), n)[-1] if n < arm.whole.n else None,
    }  # fmt: skip
    return told | (_checks() if arm.is_studys else {})


def _links(robot, count: int) -> list[list[float]]:
    """Mass, centre of mass and inertia about it of the first links."""
    rows, cols = np.triu_indices(3)
    return [
        [float(robot.mass[i]), *np.asarray(robot.com[i]).tolist(), *np.asarray(robot.inertia[i])[rows, cols].tolist()]
        for i in range(count)
    ]


def _checks() -> dict:
    """The IRB 140 by others."""
    robot = irb140()
    zero = jnp.zeros(6)
    torque = np.asarray(dynamics.inverse_dynamics(robot, jnp.radians(jnp.array(REST_POSITION)), zero, zero))
    point = np.asarray(kinematics.irb140_end_point(jnp.radians(jnp.array(TCP_POSITION))))
    return {
        "carter": [_carter(i) for i in range(3)], "carter_ours": _links(first_joints(robot, 3), 3),
        "rest": {"position": REST_POSITION, "maker": REST_TORQUE, "ours": torque.tolist()},
        "tcp_error": float(np.linalg.norm(1e3 * point - np.array(TCP))),
    }  # fmt: skip


def _carter(i: int) -> list[float]:
    """A link of Carter's in our frames and signs."""
    R, (xx, yy, zz, xy, xz, yz) = CARTER_AXES[i], CARTER_MOMENTS[i]
    inertia = R @ np.array([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]]) @ R.T
    rows, cols = np.triu_indices(3)
    return [CARTER_MASS[i], *(R @ np.array(CARTER_COM[i])).tolist(), *inertia[rows, cols].tolist()]


def table1(result: dict) -> str:
    """Table 1 in Markdown."""
    lines = ["| joint | theta, deg | d, mm | a, mm | alpha, deg |", "|---" * 5 + "|"]
    rows = zip(result["joints"], result["slide"], result["dh"], strict=True)
    for i, (joint, slide, (theta, d, a, alpha)) in enumerate(rows, start=1):
        q = "" if slide else f"q{i} {theta:+.4g}" if theta else f"q{i}"
        shift = f"q{i} {d:+.5g}" if slide else f"{d:.5g}"
        lines.append(f"| {joint} | {q if q else f'{theta:.4g}'} | {shift} | {a:.5g} | {alpha:.4g} |")
    return "\n".join(lines)


def table2(result: dict) -> str:
    """Table 2 in Markdown; for the study's arm with the other group's figures."""
    columns = {f"link {i + 1}": link for i, link in enumerate(result["links"])}
    if result["lumped"]:
        columns[f"link {len(columns)} with all beyond"] = result["lumped"]
    if "carter" in result:
        columns |= {f"Carter 2009, link {i + 1}": link for i, link in enumerate(result["carter"])}
    lines = ["| quantity | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for k, (quantity, unit) in enumerate(zip(QUANTITIES, UNITS, strict=True)):
        lines.append(f"| {quantity}, {unit} | " + " | ".join(f"{link[k]:.5g}" for link in columns.values()) + " |")
    return "\n".join(lines)


def main(config: Config) -> None:
    """Write tables_1_2.json and .md."""
    arm = config.arm()
    result = {"made": made(config.said()), "config": config.said()} | run(arm)
    folder = config.folder(arm)
    (folder / "tables_1_2.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    text = f"# {arm.name}\n\n## Table 1\n\n{table1(result)}\n\n## Table 2\n\n{table2(result)}\n"
    (folder / "tables_1_2.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(tyro.cli(Config))
