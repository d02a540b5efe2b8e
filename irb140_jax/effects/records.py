"""The five records of an effect: its law, its place, what is expected of it, its shapes, and its use in simulations.

In all of them: T samples, n joints of the robot, m joints of a site, k amplitudes w, s shape parameters, p physical
parameters.  Joints are indices; units are SI, N m and rad for hinges, N and m for slides.
"""

import dataclasses
import enum
from collections.abc import Callable
from typing import Literal, NamedTuple

import jax
import numpy as np

from irb140_jax.effects.grids import Scales
from irb140_jax.effects.left_over import LeftOver
from irb140_jax.effects.motion import Asked, Motion
from irb140_jax.robot import Robot
from irb140_jax.robot.drive import ServoGains

Values = dict[str, float]


class Parameter(NamedTuple):
    """Name, unit and admissible range of a physical parameter; {tau} and {q} in the unit stand for N m, rad or N, m."""

    name: str
    unit: str
    low: float = -np.inf
    high: float = np.inf

    def unit_of(self, is_slide: bool) -> str:
        """The unit for a hinge or a slide."""
        return self.unit.format(tau="N" if is_slide else "N m", q="m" if is_slide else "rad")


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Law:
    """The torque along a motion, and what its amplitudes are in physical parameters.

    Attributes:
        equation, source: The law in plain text, and where it comes from, with a year.
        parameters: The physical parameters.
        columns: From motion, joints (m,) and shape (s,) to Phi, torque on each joint of the site per unit of each
            amplitude, (T, m, k); on all joints, (T, n, k), where it acts `everywhere` (see `Place`).
        to_physical: From w (k,) and shape (s,) to physical parameters (p,); None where they are the amplitudes.
        from_physical: The inverse, from {name: value} to all amplitudes (k,) and the shape (s,).
        variants: Subsets of the columns that make sense by themselves.
        own: The columns that make it what it is; the others, if any, belong to a special case or refine it.
        contains: Slugs of laws that are special cases of this one: they compete.
        falls: Whether its name is that of any friction that falls as the speed rises, whatever the form of the fall.
        empirical: Whether its form is one of several in use for the same thing, so that it is usually a little wrong.
        absorbs: Whether the law and a special case side by side are again the law, so that they never stand so.
        silent: Of a law of servos: from what one is asked for, its speed (T, 1) and shape (s,) to where that may be
            anything beside the torque given, (T, 1), and how much torque that is: a range.
        to_log: Of a law of the log: from any torques x (T, any), the time between samples [s], w (k,) and shape (s,)
            to what the log shows beside x, (T, any).
    """

    equation: str
    source: str
    parameters: tuple[Parameter, ...]
    columns: Callable[[Motion, jax.Array, jax.Array], jax.Array]
    to_physical: Callable[[jax.Array, jax.Array], jax.Array] | None = None
    from_physical: Callable[[Values], tuple[np.ndarray, np.ndarray]] | None = None
    variants: tuple[tuple[int, ...], ...] = ((0,),)
    own: tuple[int, ...] = (-1,)
    contains: tuple[str, ...] = ()
    falls: bool = False
    empirical: bool = False
    absorbs: bool = True
    silent: Callable[[Asked, np.ndarray, np.ndarray], tuple[np.ndarray, float]] | None = None
    to_log: Callable[[np.ndarray, float, np.ndarray, np.ndarray], np.ndarray] | None = None

    @property
    def width(self) -> int:
        """Number of columns k."""
        return max(max(v) for v in self.variants) + 1

    def physical(self, w: jax.Array, shape: jax.Array) -> jax.Array:
        """Physical parameters, in the order of `parameters`, from all amplitudes and the shape."""
        return w if self.to_physical is None else self.to_physical(w, shape)

    def amplitudes(self, values: Values) -> tuple[np.ndarray, np.ndarray]:
        """All amplitudes and the shape from physical parameters; the inverse of `physical`."""
        if self.from_physical is not None:
            return self.from_physical(values)
        return np.array([values[p.name] for p in self.parameters]), np.zeros(0)


class At(enum.Enum):
    """Where on the way from the motor to the log an effect acts."""

    LINKS = "on the links: they need its torque, and the transmission carries it"
    DRIVE = "before or inside the transmission: it is no part of what the links need on the motors' path"
    FRICTION = "it rubs inside the transmission: it is no part of the load that the transmission carries"
    LOG_SCALE = "in the log: it scales the torque"
    LOG_TIMING = "in the log: it shifts in time what is scaled; there is one at a joint"
    ASKED = "in what a servo was asked for: the motor never gave it"

    @property
    def in_log(self) -> bool:
        """Whether only the log shows it."""
        return self in (At.LOG_SCALE, At.LOG_TIMING, At.ASKED)

    @property
    def of_any_torque(self) -> bool:
        """Whether it is what the log makes of any torque."""
        return self in (At.LOG_SCALE, At.LOG_TIMING)


def each_joint(robot: Robot) -> np.ndarray:
    """Each joint a site of its own, shape (n, 1)."""
    return np.arange(robot.n)[:, None]


def all_joints(robot: Robot) -> np.ndarray:
    """All joints one site, shape (1, n)."""
    return np.arange(robot.n)[None, :]


@dataclasses.dataclass(frozen=True, eq=False)
class Place:
    """Where an effect acts.

    Attributes:
        at: Where on the way from the motor to the log.
        sites: Groups of joints at which it can act, (sites, m).
        everywhere: Its columns fill the rows of all joints, not only of those it is named after.
    """

    at: At = At.LINKS
    sites: Callable[[Robot], np.ndarray] = each_joint
    everywhere: bool = False

    def is_in(self, *, servo: bool) -> bool:
        """Whether there can be such an effect in logs of commands, or in logs of torque.

        Torque made of commands has no scale and no clock of its own.
        """
        return not (self.at.of_any_torque if servo else self.of_servos)

    @property
    def of_servos(self) -> bool:
        """Whether it is a law of position servos."""
        return self.at is At.ASKED

    @property
    def is_friction(self) -> bool:
        """Whether it rubs inside the transmission."""
        return self.at is At.FRICTION


# What the model has of an effect may be taken away, no more: the lowest amplitude is minus this value of the joint.
OfModel = Literal["frictionloss", "damping", "armature", "stiffness"]


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Prior:
    """What is to be expected of an effect before any recording.

    Attributes:
        ordinary: Nearly every machine has it: its probability at a joint is one half.
        typical: Standard deviation of its torque, as a share of the joint's torque.
        lowest: Smallest admissible amplitude of each column, a number or a value that the model has of the site's
            joint; none where there are no bounds.
        highest: Largest admissible amplitude of each column; beyond it another cause is to be looked for.
        at_shape: From a shape (s,) to the smallest and the largest amplitude (k,) with which that shape means anything;
            others belong to other shapes of the grid.
        adds_up: The sum of its amplitudes is bounded from below like the first of them: friction rubs everywhere.
        tied: Its amplitudes are of one order of size, which is not known: what the data can't see of one, the others
            bound.  The first is a mass, not below zero, where that is its bound.
        vector: Its amplitudes are components of one vector: what the data can't see of it may be larger than the rest.
        proportion: In which its own columns act; none where all are alike.
        dissipative: It can only take energy out of the arm, at every instant.
        of_rigid_body: Its torque is made of the rigid body's own, so it is known no better than the inertials.
    """

    ordinary: bool = False
    typical: float = 0.3
    lowest: tuple[float | OfModel, ...] = ()
    highest: tuple[float, ...] = ()
    at_shape: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]] | None = None
    adds_up: bool = False
    tied: bool = False
    vector: bool = False
    proportion: tuple[float, ...] = ()
    dissipative: bool = False
    of_rigid_body: bool = False

    @property
    def is_mass(self) -> bool:
        """Whether the first of amplitudes of one unknown size is a mass."""
        return self.tied and self.lowest[:1] == (0.0,)

    def bounds(self, robot: Robot, joints: np.ndarray, width: int) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest admissible amplitude of each of so many columns at a site."""
        of_model = lambda low: -float(getattr(robot, low)[joints[0]]) if isinstance(low, str) else low  # noqa: E731
        low = [of_model(x) for x in self.lowest] or np.full(width, -np.inf)
        return np.array(low), np.array(self.highest or np.full(width, np.inf))


def no_shape(scales: Scales, joints: np.ndarray) -> np.ndarray:
    """The grid of an effect without shape parameters, (1, 0)."""
    del scales, joints
    return np.zeros((1, 0))


def at_best(grid: np.ndarray, best: np.ndarray, odds: np.ndarray) -> np.ndarray:
    """The best point of the grid itself."""
    del grid, odds
    return best


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Shapes:
    """Which shapes an effect may have, and how the right one is found.

    Attributes:
        grid: From the sizes of the recordings and the site to the shapes that are searched, (points, s), as many at
            every site.
        finer: From a grid and the best shape (s,) to as many points around it; None where shapes are discrete.
        peak: From a grid, its best point (s,) and the log odds (points,) of each beside the rest of the explanation,
            -inf where it is inadmissible, to where between the points the grid is at its best, (s,).
        scan: From sizes and site to many shapes that are tried one by one before the search, (any, s).
        around: From the best shape of the scan to the grid of the search, as many points as `grid` gives.
        beside: Slugs of effects that are left free in a scan: without them it would find what stands in for them.
        proposal: From what is left in the recordings, sizes and site to a grid of shapes that it suggests, or None.
        scanned: From how many shapes a scan or a proposal picks the best: what chance has as many tries at.
        alike: From what is left, w (k,) and shape to physical parameters (any, p) of others that no such recordings
            could tell from it, as far off either way as one standard deviation of what is known of them beforehand.
        blur: From a shape to the standard deviation (p,) below which a physical parameter has no meaning.
        follows: From w (k,) and a shape to the shape that these amplitudes call for; None where it has its own.
        settled: Least amplitude of its own columns once the grid is fine.
        during: Of what happens once, from a shape to the index of its recording, its begin and its end [s]; nothing of
            it can be predicted from other recordings.
    """

    grid: Callable[[Scales, np.ndarray], np.ndarray] = no_shape
    finer: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None
    peak: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray] = at_best
    scan: Callable[[Scales, np.ndarray], np.ndarray] | None = None
    around: Callable[[np.ndarray], np.ndarray] | None = None
    beside: tuple[str, ...] = ()
    proposal: Callable[[LeftOver, Scales, np.ndarray], np.ndarray | None] | None = None
    scanned: int = 1
    alike: Callable[[LeftOver, np.ndarray, np.ndarray], np.ndarray] | None = None
    blur: Callable[[np.ndarray], np.ndarray] | None = None
    follows: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None
    settled: float = -np.inf
    during: Callable[[np.ndarray], tuple[int, float, float]] | None = None

    @property
    def once(self) -> bool:
        """Whether what it describes happens once, in one recording."""
        return self.during is not None


NO_SHAPE = Shapes()


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Export:
    """What a corrected model and a simulation can do with an effect.

    Attributes:
        mjcf: How MJCF expresses it, all of it or a part, or None.
        not_in_mjcf: What of it MJCF can't express and why, one sentence without its full stop; "" where nothing is.
        in_model: From a robot, the site, all amplitudes (k,) and the shape (s,) to the robot with as much of the effect
            in its own numbers as those, and so MJCF, can hold.
        in_servo: The same of gains and limits of the position servos that corrected.xml has where commands are logged.
        history: Why its torque depends on more than the present state, as the rest of a sentence, or None.
        memory: What it remembers after standing still at positions (m,) under the torque (m,) of the drives.
        step: One step of a simulation, for effects with a history: from the memory, positions (m,), the torque that
            the drives are asked for (m,), w (k,), shape (s,) and the length of the step [s] to columns (m, k), the
            torque that the drives really give (m,), and the memory after the step; None where there is none.
    """

    mjcf: str | None = None
    not_in_mjcf: str = ""
    in_model: Callable[[Robot, tuple[int, ...], np.ndarray, np.ndarray], Robot] | None = None
    in_servo: Callable[[ServoGains, tuple[int, ...], np.ndarray, np.ndarray], ServoGains] | None = None
    history: str | None = None
    memory: Callable[[jax.Array, jax.Array], jax.Array] | None = None
    step: Callable[..., tuple[jax.Array, jax.Array, jax.Array]] | None = None


NOT_IN_MJCF = Export(not_in_mjcf="MJCF has no such torque")
