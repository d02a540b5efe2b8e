"""What every left-out effect is: torque along a motion, linear in amplitudes w, nonlinear in a few shape parameters s.

    tau_effect(t) = Phi(q, qd, qdd, load, t; s) w

One file of this folder holds one effect; `catalogue.py` finds it there.  From that file come the screen, the fit, the
report, the corrected model, the docs table and the contract tests.
"""

import abc
from typing import ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from irb140_jax.effects.grids import Scales, between_neighbours
from irb140_jax.effects.left_over import LeftOver
from irb140_jax.effects.motion import Motion
from irb140_jax.robot import Robot

# Times the torque that the shape of a simulated link accounts for: beyond, it stands in for something else, as a spring
# of a quarter of its bend does for what smoothing takes off accelerations.
ALIKE = 2.0


class Parameter(NamedTuple):
    """Name, unit and admissible range of a physical parameter; {tau} and {q} in the unit stand for N m, rad or N, m."""

    name: str
    unit: str
    low: float = -np.inf
    high: float = np.inf


class AbstractEffect(abc.ABC):
    """A kind of left-out physics.  Subclasses are final, hold no state, and are listed by the catalogue.

    Class attributes:
        slug: Name in the vocabulary; never changes meaning.
        title: A few words for a person.
        equation, source: The law and where it comes from.
        parameters: Physical parameters, in the order that `physical` returns them.
        contains: Slugs of effects that are special cases of this one: they compete.
        absorbs: Whether the law and a special case side by side are again the law, so that they never stand so.
        variants: Subsets of the columns that make sense by themselves.
        confused_with: Slug of a look-alike -> the motion which separates the two.
        needs: The motion that would show the effect.
        typical: Prior standard deviation of its torque, as a share of the joint's torque.
        ordinary: Nearly every machine has it: its prior probability at a joint is one half.
        friction: It rubs inside the transmission, so it is no part of the load that the transmission carries.
        dissipative: It can only take energy out of the arm, at every instant.
        mjcf: How MJCF expresses it, all of it or a part (see `in_model`), or None.
        not_in_mjcf: What of it MJCF can't express and why, one sentence without its full stop; "" where nothing is.
        leans_on_inertials: Its torque is made of the rigid body's own, so it is known no better than the inertials.
        transmission: It acts before or inside the transmission, no part of what the links need on the motors' path.
        logged: 0, or its place in how a log comes about from what motors feel: 1 scales it, 2 shifts in time what it is
            when scaled, of which there is one at a joint.
        once: It happens once, in one recording; nothing of it can be predicted from the others.
        everywhere: Its columns fill the rows of all joints, not only of those it is named after.
        scouts: Its grid of shapes is looked for in the residual (see `scout`).
        beside: Effects that are left free in a scan: without them it would find the shape that stands in for them.
        scanned: From how many shapes a scout picks the best: what chance has as many tries at.
        shape_follows: Its shape is none of its own but what its amplitude says (see `at_shape`).
        adds_up: The sum of its amplitudes is bounded from below like the first of them: friction rubs everywhere.
        tied: Its amplitudes are of one order of size: what the data can't see of one, the others bound.
        vector: Its amplitudes are components of one vector: what the data can't see of it may be larger than the rest.
        silent: A candidate of the search that is no left-out physics: it is never reported as a finding.
        own: The columns that make it what it is; the others, if any, belong to a special case or refine it.
        settled: Least amplitude of those once the grid of shapes is fine.
        history: Why its torque depends on more than the present state, as the rest of a sentence, or None.
        steps: Whether it can be simulated forward in time all the same (see `memory` and `step`).
    """

    slug: ClassVar[str]
    title: ClassVar[str]
    equation: ClassVar[str]
    source: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    contains: ClassVar[tuple[str, ...]] = ()
    absorbs: ClassVar[bool] = True
    variants: ClassVar[tuple[tuple[int, ...], ...]]
    confused_with: ClassVar[dict[str, str]] = {}
    needs: ClassVar[str]
    typical: ClassVar[float] = 0.3
    ordinary: ClassVar[bool] = False
    friction: ClassVar[bool] = False
    dissipative: ClassVar[bool] = False
    mjcf: ClassVar[str | None] = None
    not_in_mjcf: ClassVar[str] = "MJCF has no such torque"
    leans_on_inertials: ClassVar[bool] = False
    transmission: ClassVar[bool] = False
    logged: ClassVar[int] = 0
    once: ClassVar[bool] = False
    everywhere: ClassVar[bool] = False
    scouts: ClassVar[bool] = False
    beside: ClassVar[tuple[str, ...]] = ()
    scanned: ClassVar[int] = 1
    shape_follows: ClassVar[bool] = False
    adds_up: ClassVar[bool] = False
    tied: ClassVar[bool] = False
    vector: ClassVar[bool] = False
    silent: ClassVar[bool] = False
    own: ClassVar[tuple[int, ...]] = (-1,)
    settled: ClassVar[float] = -np.inf
    history: ClassVar[str | None] = None
    steps: ClassVar[bool] = False

    def sites(self, robot: Robot) -> np.ndarray:
        """Groups of joints at which the effect can act, shape (sites, joints per site); by default each joint alone."""
        return np.arange(robot.n)[:, None]

    def shapes(self, scales: Scales, joints: np.ndarray) -> np.ndarray:
        """Grid of shape parameters to search at this site, shape (grid points, shape parameters)."""
        del scales, joints
        return np.zeros((1, 0))

    def refines(self) -> bool:
        """Whether the shape is continuous, so that the best grid point should be refined."""
        return False

    def finer(self, grid: np.ndarray, best: np.ndarray) -> np.ndarray:
        """As many grid points as before, around the best one (by default one parameter; see `between_neighbours`)."""
        return between_neighbours(grid, best)

    def shape_of(self, w: np.ndarray, shape: np.ndarray) -> np.ndarray:
        """The shape that amplitudes w found at a shape call for; by default they say nothing about it."""
        return shape

    def during(self, shape: np.ndarray) -> tuple[int, float, float]:
        """Index of the recording in which what happens `once` happens, from when and until when [s]."""
        raise NotImplementedError(f"{self.slug} doesn't happen once")

    def peak(self, grid: np.ndarray, best: np.ndarray, odds: np.ndarray) -> np.ndarray:
        """Where between its points a grid is at its best, about which `finer` makes the next; by default the point.

        Args:
            grid: Shape (points, shape parameters).
            best: Its best point, shape (shape parameters,).
            odds: Log odds of each point beside the rest of the explanation, -inf where it is inadmissible, (points,).
        """
        del grid, odds
        return best

    def scan(self, scales: Scales, joints: np.ndarray) -> np.ndarray:
        """Many shapes to try one by one before the search, shape (points, shape parameters); none by default.

        The grid of the search is then the one `around` the best of them.
        """
        del scales, joints
        return np.zeros((0, 0))

    def around(self, best: np.ndarray) -> np.ndarray:
        """Grid around the best shape of a scan, as many points as `shapes` gives."""
        raise NotImplementedError(f"{self.slug} has no scan")

    def scout(self, left: LeftOver, scales: Scales, joints: np.ndarray) -> np.ndarray | None:
        """Grid of shapes suggested by what is left in the recordings, or None.

        Args:
            left: What is left at every joint, time and recording.
            scales: Sizes of the recordings.
            joints: The site.
        """
        del left, scales, joints
        return None

    def alike(self, left: LeftOver, w: np.ndarray, shape: np.ndarray) -> np.ndarray:
        """Physical parameters of others of its kind that no such recordings could tell from it, shape (any, p).

        As far off either way as one standard deviation of what is known of them without the recordings.

        Args:
            left: What is left at every joint, time and recording.
            w: Amplitudes of all columns.
            shape: Shape parameters.
        """
        del left, w, shape
        return np.zeros((0, len(self.parameters)))

    @abc.abstractmethod
    def columns(self, motion: Motion, joints: Int[Array, " m"], shape: Float[Array, " s"]) -> Float[Array, "T m k"]:
        """Torque on each joint of the site per unit of each amplitude, shape (T, joints of the site, amplitudes).

        All n joints instead of those of the site where the effect is `everywhere`.
        """

    @abc.abstractmethod
    def physical(self, w: Float[Array, " k"], shape: Float[Array, " s"]) -> Float[Array, " p"]:
        """Physical parameters, in the order of `parameters`, from amplitudes and shape."""

    @abc.abstractmethod
    def amplitudes(self, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Amplitudes (all columns) and shape from physical parameters; the inverse of `physical`."""

    def lowest(self, robot: Robot, joints: np.ndarray) -> np.ndarray:
        """Smallest admissible amplitude of each column: what the model already has may be taken away, no more."""
        del robot, joints
        return np.full(max(max(v) for v in self.variants) + 1, -np.inf)

    def highest(self, robot: Robot, joints: np.ndarray) -> np.ndarray:
        """Largest admissible amplitude of each column; beyond it another cause is to be looked for."""
        del robot, joints
        return np.full(max(max(v) for v in self.variants) + 1, np.inf)

    def at_shape(self, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest amplitude of each column with which a shape means anything; by default any."""
        del shape
        free = np.full(max(max(v) for v in self.variants) + 1, np.inf)
        return -free, free

    def likely(self, robot: Robot) -> np.ndarray:
        """Proportion in which its own columns act, shape (len(own),)."""
        del robot
        return np.ones(len(self.own))

    def blur(self, shape: np.ndarray) -> np.ndarray:
        """Standard deviation below which each physical parameter has no meaning at this shape, shape (p,)."""
        del shape
        return np.zeros(len(self.parameters))

    def memory(self, q: Float[Array, " m"], tau: Float[Array, " m"]) -> Float[Array, " s"]:
        """What it remembers after standing still at q, positions of the site, under the torque tau."""
        del q, tau
        return jnp.zeros(0)

    def step(
        self, memory: Float[Array, " s"], q: Float[Array, " m"], tau: Float[Array, " m"], w: Float[Array, " k"],
        shape: Float[Array, " s"], dt: Float[Array, ""],
    ) -> tuple[Float[Array, "m k"], Float[Array, " m"], Float[Array, " s"]]:
        """One step of a simulation, for effects whose torque depends on what was before.

        Args:
            memory: From `memory` or the step before.
            q: Positions of the site's joints [rad or m].
            tau: Torque that the drives of the site are asked for [N m or N].
            w: Amplitudes.
            shape: Shape parameters.
            dt: Length of the step [s].

        Returns:
            Columns at this instant, the torque that the drives really give, and the memory after the step.
        """
        raise NotImplementedError(f"{self.slug} can't be simulated forward in time")

    def passed_on(self, x: np.ndarray, dt: float, w: np.ndarray, shape: np.ndarray) -> np.ndarray:
        """What a law of the log makes of any torque x beside that torque itself, shape (T, any) like x.

        Only of an effect that is `logged`.

        Args:
            x: Torques before it, shape (T, any).
            dt: Between samples [s].
            w: Amplitudes of all columns, shape (k,).
            shape: Shape parameters, shape (s,).
        """
        raise NotImplementedError(f"{self.slug} is no law of the log")

    def in_model(self, robot: Robot, joints: tuple[int, ...], w: np.ndarray, shape: np.ndarray) -> Robot:
        """The robot with as much of this effect in its own numbers as those, and so MJCF, can hold.

        Args:
            robot: Arm with concrete numbers.
            joints: The site.
            w: Amplitudes of all columns, shape (k,).
            shape: Shape parameters, shape (s,).
        """
        del joints, w, shape
        return robot

    @abc.abstractmethod
    def where(self, names: str, values: dict[str, float], units: dict[str, str]) -> str:
        """One sentence: at which positions, speeds, loads, times or frequencies it acts."""

    def unit(self, parameter: Parameter, is_slide: bool) -> str:
        """The parameter's unit for a hinge or a slide."""
        return parameter.unit.format(tau="N" if is_slide else "N m", q="m" if is_slide else "rad")
