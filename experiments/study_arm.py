"""The arm a table is made for: which robot, which of its links are identified, and what a set of estimates makes of it.

The study takes the first three links of the IRB 140; any other arm, and any number of its links, may take their place.
"""

import dataclasses
import pathlib
import re
from functools import cached_property

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.sharding import Mesh
from jaxtyping import Array, Float

from irb140_jax import identify
from irb140_jax.errors import InputError
from irb140_jax.robot import Robot, irb140, load_robot, subset

ROOT = pathlib.Path(__file__).resolve().parents[1]
RESULTS, DOCS = ROOT / "results", ROOT / "docs"
JOINTS_OF_THE_STUDY = 3


@dataclasses.dataclass(frozen=True)
class ArmChoice:
    """Which arm.

    Attributes:
        robot: Model file, MJCF or URDF; default the IRB 140.
        joints: Its first joints and links that take part; default three of the IRB 140, all of another arm.
    """

    robot: pathlib.Path | None = None
    joints: int | None = None

    def arm(self) -> "StudyArm":
        """The arm, read from its file."""
        whole = irb140() if self.robot is None else load_robot(self.robot)
        count = self.joints or (min(JOINTS_OF_THE_STUDY, whole.n) if self.robot is None else whole.n)
        if not 1 <= count <= whole.n:
            raise InputError(f"{count} joints of robot '{whole.name}': give 1 to {whole.n}")
        zero = jnp.zeros(whole.n)
        fields = lambda r: (r.damping, r.frictionloss, r.stiffness)  # noqa: E731
        return StudyArm(eqx.tree_at(fields, whole, (zero, zero, zero)), tuple(range(count)), self.robot is None)


@dataclasses.dataclass(frozen=True, eq=False)
class StudyArm:
    """A rigid arm and the links whose parameters are sought; masses are known, as in the study.

    Attributes:
        whole: The robot, without friction or springs, of which the study knows none.
        links: Whose centres of mass and inertias are unknown.
        shipped: Whether it is the IRB 140.
    """

    whole: Robot
    links: tuple[int, ...]
    shipped: bool

    @property
    def is_studys(self) -> bool:
        """Whether it is what the study identified: its published figures then stand beside ours."""
        return self.shipped and len(self.links) == JOINTS_OF_THE_STUDY

    @property
    def name(self) -> str:
        """For titles."""
        part = "" if len(self.links) == self.whole.n else f", first {len(self.links)} joints"
        return f"{self.whole.name}{part}"

    @property
    def slug(self) -> str:
        """For folders."""
        return f"{re.sub(r'[^A-Za-z0-9]+', '_', self.whole.name).strip('_').lower()}_{len(self.links)}_joints"

    @cached_property
    def unknowns(self) -> identify.Unknowns:
        """What is sought of these links; what is zero is not."""
        return identify.unknowns(self.whole, self.links)

    @property
    def x(self) -> Float[Array, " d"]:
        """True parameters, see `identify.link_parameters`."""
        return self.unknowns.reference

    @cached_property
    def mass(self) -> Float[Array, " k"]:
        """Masses of the links [kg]."""
        return self.whole.mass[jnp.array(self.links)]

    def reduced(self, x: Float[Array, " d"] | None = None) -> Robot:
        """These joints with these parameters, or the true ones; what lies beyond counts to the last link."""
        robot = self.whole if x is None else identify.with_link_parameters(self.whole, self.links, x)
        return subset(robot, self.links)


@dataclasses.dataclass(frozen=True)
class StudyConfig(ArmChoice):
    """What every part of the study is told.

    Attributes:
        out: Folder of the results; default results/, and a folder in it for another arm or a smoke run.
        figures: Folder of the figures; default in docs/figures for the IRB 140, else within the results.
        smoke: Everything as small as can be, to see that all works.
        devices: Among which tables 3 and 4 share their seeds; docs/scaling.md says how a CPU has several.
    """

    out: pathlib.Path | None = None
    figures: pathlib.Path | None = None
    smoke: bool = False
    devices: int = 1

    @property
    def mesh(self) -> Mesh | None:
        """These devices; None for the one that is taken anyway."""
        there = len(jax.devices())
        if not 1 <= self.devices <= there:
            raise InputError(
                f"--devices {self.devices}: this process has {there}; give 1 to {there}, or start it with "
                f"XLA_FLAGS=--xla_force_host_platform_device_count={self.devices}"
            )
        return jax.make_mesh((self.devices,), ("lanes",)) if self.devices > 1 else None

    def folder(self, arm: StudyArm) -> pathlib.Path:
        """Where results go; it is made."""
        usual = RESULTS if arm.is_studys else RESULTS / arm.slug
        path = self.out or (RESULTS / "smoke" if self.smoke else usual)
        path.mkdir(parents=True, exist_ok=True)
        return path

    def figure_folder(self, arm: StudyArm) -> pathlib.Path:
        """Where figures go; it is made."""
        in_docs = DOCS / "figures" / ("" if arm.is_studys else f"{len(arm.links)}_joints")
        path = self.figures or (in_docs if self._is_for_docs(arm) else self.folder(arm) / "figures")
        path.mkdir(parents=True, exist_ok=True)
        return path

    def page_path(self, arm: StudyArm) -> pathlib.Path:
        """Where the page goes that shows them all."""
        if self._is_for_docs(arm):
            return DOCS / ("study.md" if arm.is_studys else f"study-{len(arm.links)}-joints.md")
        return self.folder(arm) / "study.md"

    def _is_for_docs(self, arm: StudyArm) -> bool:
        return arm.shipped and not self.smoke and self.out is None

    def said(self) -> dict[str, str | int | float | bool | None]:
        """The choices that a result depends on, to be stored beside it."""
        of_no_matter = ("out", "figures", "devices")
        told = {name: value for name, value in vars(self).items() if name not in of_no_matter}
        # The file's name, not where somebody keeps it.
        return {name: value.name if isinstance(value, pathlib.Path) else value for name, value in told.items()}
