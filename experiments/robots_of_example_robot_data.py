"""Which robots load, of all URDFs of a folder and of MJCF files (docs/robots-that-load.md).

    pip install --no-deps --target urdfs example-robot-data
    pip install --no-deps --target mjcf robosuite openarm-mujoco
    python experiments/robots_of_example_robot_data.py urdfs --mjcf mjcf

Packages go into folders of their own, without what they depend on: nothing but their model files is read.
"""

import dataclasses
import pathlib
from typing import Annotated

import tyro
from tyro.conf import Positional

from irb140_jax.errors import RobotError
from irb140_jax.robot import Robot, load_robot
from irb140_jax.robot.description import Description, description

PAGE = pathlib.Path(__file__).resolve().parents[1] / "docs" / "robots-that-load.md"
# The models of whole robots in `robosuite` and `openarm-mujoco`; their other files are parts and scenes.
MJCF = ("**/assets/robots/*/robot.xml", "**/openarm_bimanual.xml", "**/openarm_pedestal.xml")


@dataclasses.dataclass(frozen=True)
class Row:
    """What became of a file.

    Attributes:
        name: The file, short.
        joints: Movable joints in it.
        as_is: The robot that it makes by itself, or why it makes none.
        held: The same with `--fix-base`.
        limb: The same with the joints of its longest limb named.
    """

    name: str
    joints: int
    as_is: Robot | str
    held: Robot | str
    limb: Robot | str

    @property
    def usable(self) -> bool:
        """Whether it makes a robot in any of these ways."""
        return any(isinstance(x, Robot) for x in (self.as_is, self.held, self.limb))


def main(
    urdfs: Annotated[Positional[pathlib.Path], tyro.conf.arg(metavar="FOLDER")],
    mjcf: pathlib.Path | None = None,
    page: pathlib.Path = PAGE,
) -> None:
    """Load every robot and write the page.

    Args:
        urdfs: Folder with URDFs, at any depth.
        mjcf: Folder with MJCF models, or None.
        page: Where to write.
    """
    rows = [row(path) for path in sorted(urdfs.rglob("*.urdf"))]
    more = [row(path) for pattern in MJCF for path in sorted(mjcf.glob(pattern))] if mjcf else []
    page.write_text(written(rows, more), encoding="utf-8")
    for kind, found in (("URDFs", rows), ("MJCF models", more)):
        print(f"{kind}: {sum(r.usable for r in found)} of {len(found)} are usable")


def row(path: pathlib.Path) -> Row:
    """Load one file in every way."""
    name = f"{path.parent.name if path.suffix == '.xml' else path.parents[1].name}/{path.stem}"
    try:
        said = description(path)
    except RobotError as error:
        reason = _reason(error, path)
        return Row(name, 0, reason, reason, reason)
    as_is, held = _loaded(path), _loaded(path, fix_base=True)
    limb: Robot | str = "no joint"
    for joints in limbs(said):
        limb = _loaded(path, joints=joints, fix_base=True)
        if isinstance(limb, Robot):
            break
    return Row(name, said.model.njnt, as_is, held, limb)


def limbs(said: Description) -> list[list[str]]:
    """Joints on the way to each end of the tree, the longest way first; hinges and slides with names only."""
    model, ways = said.model, []
    inner = {int(model.body_parentid[b]) for b in range(1, model.nbody)}
    for end in sorted(set(range(1, model.nbody)) - inner):
        body, way = end, []
        while body:
            first = int(model.body_jntadr[body])
            way = [model.joint(first + k).name for k in range(int(model.body_jntnum[body]))
                   if int(model.jnt_type[first + k]) in (2, 3)] + way  # fmt: skip
            body = int(model.body_parentid[body])
        ways.append([name for name in way if name])
    # What ends in a tied finger is a limb all the same, up to the finger.
    shorter = [way[:k] for way in ways for k in range(1, len(way) + 1)]
    return sorted((list(way) for way in set(map(tuple, shorter))), key=len, reverse=True)


def _loaded(path: pathlib.Path, **asked) -> Robot | str:
    try:
        return load_robot(path, **asked)
    except RobotError as error:
        return _reason(error, path)


def _reason(error: RobotError, path: pathlib.Path) -> str:
    return str(error).removeprefix(f"{path}: ")


def written(rows: list[Row], more: list[Row]) -> str:
    """The page."""
    usable = sum(r.usable for r in rows)
    as_is = sum(isinstance(r.as_is, Robot) for r in rows)
    lines = [
        "# Robots that load",
        "",
        "Written by `experiments/robots_of_example_robot_data.py`, which says how to get the files. No file was "
        "edited, and no mesh is read.",
        "",
        f"Of {len(rows)} URDFs in the package `example-robot-data`, {as_is} load as they are, and {usable} with a "
        "floating base held or the joints of a limb named, as the columns of a recording name them.",
        "",
        *_table(rows),
    ]
    if more:
        lines += [
            "",
            f"Of {len(more)} MJCF models in the packages `robosuite` and `openarm-mujoco`, "
            f"{sum(r.usable for r in more)} are usable. MuJoCo Menagerie is not among them: its package downloads each "
            "robot from elsewhere, on first use.",
            "",
            *_table(more),
        ]
    refused = [r for r in (*rows, *more) if isinstance(r.as_is, str)]
    lines += ["", "What is refused as it is, and why:", "", *(f"- {r.name}: {r.as_is}." for r in refused)]
    return "\n".join(lines) + "\n"


def _table(rows: list[Row]) -> list[str]:
    head = ["robot", "joints in the file", "as it is", "base held", "longest limb named"]
    cells = [[r.name, str(r.joints), *map(_cell, (r.as_is, r.held, r.limb))] for r in rows]
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *cells)]


def _cell(x: Robot | str) -> str:
    return "refused" if isinstance(x, str) else f"{x.n}, {'a chain' if x.is_chain else 'branches'}"


if __name__ == "__main__":
    tyro.cli(main)
