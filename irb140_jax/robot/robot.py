"""The robot as a pytree: every number is a leaf, so everything can be fitted, batched and differentiated."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float

from irb140_jax.errors import RobotError
from irb140_jax.robot.tree import Parents, is_depth_first, serial
from irb140_jax.tables import table_html
from irb140_jax.types import Inertials, Joints, Mat3, Vec3

_PER_JOINT = (
    "reference mass armature damping frictionloss stiffness springref gear lower upper velocity_limit effort_limit"
)
# jaxtyping does not look into the fields of a pytree; a wrong shape would broadcast instead of failing.
_SHAPES: dict[str, tuple[int | str, ...]] = {
    "rotation": ("n", 3, 3),
    "position": ("n", 3),
    "axis": ("n", 3),
    "com": ("n", 3),
    "inertia": ("n", 3, 3),
    "gravity": (3,),
    "base_rotation": (3, 3),
    "base_position": (3,),
    "tool_rotation": (3, 3),
    "tool_position": (3,),
    **{field: ("n",) for field in _PER_JOINT.split()},
}


class Robot(eqx.Module):
    """A chain or tree of n hinges and slides on a fixed base.

    Link i moves with joint i and sits on link `parent[i]`, in a chain the one before; below, "the link before" is that
    one, or the base where it is -1.  Its frame sits on the axis of joint i, and at q = reference it is placed in the
    frame of the link before by `rotation[i]`, `position[i]`.  The last link carries the tool.

    Attributes:
        rotation: Orientation of frame i in that of the link before at q = reference, shape (n, 3, 3).
        position: Origin of frame i in that of the link before at q = reference [m], shape (n, 3).
        axis: Unit vector of joint i in frame i, shape (n, 3).
        reference: Joint coordinate at which the arm is in the pose that `rotation`, `position` give [rad or m].
        mass: Link masses [kg], shape (n,).
        com: Centres of mass in the link frame [m], shape (n, 3).
        inertia: Inertia tensors about the centre of mass, link axes [kg m^2], shape (n, 3, 3).
        armature: Rotor inertia on the joint side [kg m^2 or kg].
        damping: Viscous friction of the model [N m s/rad or N s/m].
        frictionloss: Dry friction of the model [N m or N].
        stiffness: Joint spring of the model [N m/rad or N/m].
        springref: Rest position of that spring [rad or m].
        gear: Joint torque per unit of actuator control, 1 where a joint has no actuator.
        gravity: Gravity vector in base axes [m/s^2], shape (3,).
        base_rotation: Orientation of the base in the world, shape (3, 3).
        base_position: Position of the base in the world [m], shape (3,).
        tool_rotation: Orientation of the tool in the last link's frame, shape (3, 3).
        tool_position: Position of the tool in the last link's frame [m], shape (3,).
        lower, upper: Joint limits [rad or m]; +-inf where the model gives none.
        velocity_limit: Largest joint speed [rad/s or m/s]; inf where the model gives none.
        effort_limit: Largest joint torque [N m or N]; inf where the model gives none.
        joint_names: Names, from the base outward, one branch after the other.
        is_slide: True for prismatic joints.
        name: The model's name.
        notes: Plain sentences about what the reader had to supply.
        parent: Link that each link sits on, -1 for the base; those of a chain if not given.  Depth first: a link comes
            after its parent, and after it all that it carries before anything else.
    """

    rotation: Float[Array, "n 3 3"]
    position: Float[Array, "n 3"]
    axis: Float[Array, "n 3"]
    reference: Joints
    mass: Joints
    com: Float[Array, "n 3"]
    inertia: Float[Array, "n 3 3"]
    armature: Joints
    damping: Joints
    frictionloss: Joints
    stiffness: Joints
    springref: Joints
    gear: Joints
    gravity: Vec3
    base_rotation: Mat3
    base_position: Vec3
    tool_rotation: Mat3
    tool_position: Vec3
    lower: Joints
    upper: Joints
    velocity_limit: Joints
    effort_limit: Joints
    joint_names: tuple[str, ...] = eqx.field(static=True)
    is_slide: tuple[bool, ...] = eqx.field(static=True)
    name: str = eqx.field(static=True, default="robot")
    notes: tuple[str, ...] = eqx.field(static=True, default=())
    parent: Parents = eqx.field(static=True, default=())

    def __post_init__(self):
        self.parent = tuple(self.parent) or serial(len(self.joint_names))

    def __check_init__(self):
        n = self.n
        if not n or len(self.is_slide) != n or len(set(self.joint_names)) != n:
            raise RobotError(
                f"robot '{self.name}': joint_names {self.joint_names}, is_slide {self.is_slide}; give one of each for "
                "every joint, at least one joint, no name twice"
            )
        if len(self.parent) != n or not is_depth_first(self.parent):
            raise RobotError(
                f"robot '{self.name}': parent {self.parent}; give for every link the one it sits on, -1 for the base, "
                "links in depth-first order"
            )
        for field, shape in _SHAPES.items():
            expected = tuple(n if size == "n" else size for size in shape)
            came = jnp.shape(getattr(self, field))
            if came != expected:
                raise RobotError(f"robot '{self.name}': {field} has shape {came}; for {n} joints give {expected}")

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @property
    def torque_units(self) -> tuple[str, ...]:
        """Unit of each joint's torque: N m of a hinge, N of a slide."""
        return tuple("N" if slide else "N m" for slide in self.is_slide)

    @property
    def is_chain(self) -> bool:
        """Whether nothing branches: each link sits on the one before."""
        return self.parent == serial(self.n)

    def _repr_html_(self) -> str:
        """The joints as a table, for notebooks."""
        columns = (self.lower, self.upper, self.velocity_limit, self.effort_limit, self.mass)
        if any(not eqx.is_array(column) or isinstance(column, Tracer) or jnp.ndim(column) != 1 for column in columns):
            return table_html(("joint",), [(name,) for name in self.joint_names], f"{self.name}, batched or traced")
        kinds = ["slide" if slide else "hinge" for slide in self.is_slide]
        numbers = ([f"{float(x):.4g}" for x in column] for column in columns)
        heads = ("joint", "kind", "from", "to", "speed limit", "torque limit", "mass behind it [kg]")
        return table_html(heads, zip(self.joint_names, kinds, *numbers, strict=True), f"{self.name}, SI units")

    @property
    def phi(self) -> Inertials:
        """Inertial parameters of each link about its frame, [m, m c, Ixx, Ixy, Ixz, Iyy, Iyz, Izz], shape (n, 10)."""
        return _phi(self.mass, self.com, self.inertia)


@jax.jit  # a dozen operations that would each be compiled by itself
def _phi(mass: Array, com: Array, inertia: Array) -> Inertials:
    c2 = jnp.sum(com**2, axis=-1)[:, None, None]
    outer = com[:, :, None] * com[:, None, :]
    about_origin = inertia + mass[:, None, None] * (c2 * jnp.eye(3) - outer)
    rows, cols = jnp.triu_indices(3)
    return jnp.concatenate([mass[:, None], mass[:, None] * com, about_origin[:, rows, cols]], axis=1)


def with_phi(robot: Robot, phi: Inertials) -> Robot:
    """The same robot with other inertial parameters (see `Robot.phi`), shape (n, 10).

    A link of zero mass gets its centre of mass at the frame's origin.
    """
    where = lambda r: (r.mass, r.com, r.inertia)  # noqa: E731
    return eqx.tree_at(where, robot, _from_phi(phi))


@jax.jit  # as `_phi`
def _from_phi(phi: Inertials) -> tuple[Array, Array, Array]:
    mass = phi[:, 0]
    com = phi[:, 1:4] / jnp.where(mass == 0.0, 1.0, mass)[:, None]
    rows, cols = jnp.triu_indices(3)
    upper = jnp.zeros((phi.shape[0], 3, 3)).at[:, rows, cols].set(phi[:, 4:])
    about_origin = upper + jnp.swapaxes(jnp.triu(upper, 1), 1, 2)
    c2 = jnp.sum(com**2, axis=-1)[:, None, None]
    inertia = about_origin - mass[:, None, None] * (c2 * jnp.eye(3) - com[:, :, None] * com[:, None, :])
    return mass, com, inertia


@jax.jit  # as `_phi`
def about_origin(point: Vec3) -> Float[Array, "10 10"]:
    """Matrix from inertial parameters about a point of a link, axes of its frame, to those about the frame's origin.

    Args:
        point: Position in the link's frame [m], shape (3,).
    """

    def moved(phi: Float[Array, "10"]) -> Float[Array, "10"]:
        mass, h = phi[0], phi[1:4]
        both = jnp.outer(point, h) + jnp.outer(h, point) + mass * jnp.outer(point, point)
        steiner = jnp.trace(both) * jnp.eye(3) - both
        return jnp.concatenate([mass[None], h + mass * point, phi[4:] + steiner[jnp.triu_indices(3)]])

    return jax.jacfwd(moved)(jnp.zeros(10))
