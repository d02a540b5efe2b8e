"""Mass matrix, Christoffel Coriolis matrix and gravity torque at once, in scalars, as the loop of a simulation asks.

The formulas are those of `composite` and `coriolis`, told in link axes about the link's own origin instead of base
axes: there a joint's axis is constant and mostly a coordinate axis, so that most products are known to vanish.  For
all that joint k carries, about the origin of frame k,

    h = sum m x,   I = sum m (x.x 1 - x x^T),   P = sum m xd,   D = sum m ((x . xd) 1 - xd x^T),

and moving to the frame of the link before, by x -> R x + p, keeps m and turns the others, after which

    h += m p,   I += 2 (p . h) 1 - p h^T - h p^T + m (p.p 1 - p p^T),   D += (p . P) 1 - P p^T.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple, TypeVar

import jax.numpy as jnp

from irb140_jax.dynamics.chain import Chain
from irb140_jax.dynamics.newton_euler import Placement, placements
from irb140_jax.dynamics.scalars import (
    ZERO,
    Matrix,
    Number,
    Vector,
    add,
    apply,
    cross,
    dot,
    minus,
    mul,
    plus,
    scale,
    sub,
    total,
    transpose,
)
from irb140_jax.dynamics.stage import always, staged
from irb140_jax.robot.tree import children, path

# Longest chain that is worked through in one go.
UNSTAGED = 3

Result = TypeVar("Result")
Rows = list[list[Number]]


class Terms(NamedTuple):
    """Terms of the equations of motion M qdd + C qd + g = tau; rows of scalars.

    Attributes:
        M: Mass matrix of the rigid bodies [kg m^2, kg m or kg], n rows of n.
        C: Coriolis matrix by Christoffel symbols [N m s/rad], n rows of n.
        g: Gravity torque [N m or N], n.
    """

    M: Rows
    C: Rows
    g: list[Number]


class _Carried(NamedTuple):
    """All that a joint carries, about its frame's origin (see the module's docstring)."""

    mass: Number
    first: Vector
    inertia: Matrix
    momentum: Vector
    moment: Matrix


class _Motion(NamedTuple):
    """Angular velocity, velocity of the frame's origin, and gravity, in link axes."""

    angular: Vector
    linear: Vector
    gravity: Vector


class _Joint(NamedTuple):
    """A joint's screw in its own frame, angular part w over linear part v, and the rates of both."""

    w: Vector
    v: Vector
    w_rate: Vector
    v_rate: Vector


def terms(arm: Chain, q: list[Number], qd: list[Number]) -> Terms:
    """M, C and g of the rigid bodies; armature, friction and springs are not in it.

    Args:
        arm: From `chain.chain`, n links.
        q: Joint positions [rad or m], n scalars.
        qd: Joint velocities [rad/s or m/s], n scalars.

    Returns:
        Rows of scalars.

    Source: equations 10, 13 and 15 of the study; Echeandia and Wensing, J. Mech. Robotics 13 (2021), for the order of
        work; derived in `coriolis` and in this module's docstring.
    """
    n, places = len(arm.links), placements(arm, q)
    # XLA recomputes what several results share, the more the longer the chain; short chains are faster without stages.
    stage = partial(staged, always(*(jnp.asarray(x) for x in q))) if n > UNSTAGED else _at_once
    stored = stage(lambda: [place[1:] for place in places])
    places = [Placement(link, *place) for link, place in zip(arm.links, stored, strict=True)]
    motions = stage(lambda: _motions(arm, places, qd))
    joints = [_joint(place, motion) for place, motion in zip(places, motions, strict=True)]
    result = Terms([[0.0] * n for _ in range(n)], [[0.0] * n for _ in range(n)], [0.0] * n)
    carried: dict[int, _Carried] = {}
    for k in reversed(range(n)):
        outer = {i: carried.pop(i) for i in children(arm.parent, k)}
        carried[k] = beyond = stage(partial(_beyond, places, motions, k, outer))
        weight = scale(beyond.mass, motions[k].gravity), cross(beyond.first, motions[k].gravity)
        result.g[k] = mul(-1.0, _project(joints[k], *weight))
        way = path(arm.parent, k)
        inertias, later, earlier = stage(partial(_column, places, joints, beyond, way))
        for at, j in enumerate(way):
            result.M[j][k] = result.M[k][j] = inertias[at]
            result.C[j][k], result.C[k][j] = later[at], earlier[at]
    return stage(lambda: result)


def _at_once(work: Callable[[], Result]) -> Result:
    return work()


def _beyond(places: list[Placement], motions: list[_Motion], k: int, outer: dict[int, _Carried]) -> _Carried:
    """What joint k carries: its own link and what the joints that sit on it carry."""
    own = _own(places[k], motions[k])
    for i, carried in outer.items():
        own = _sum(own, _moved(places[i], carried))
    return own


def _column(
    places: list[Placement], joints: list[_Joint], beyond: _Carried, way: tuple[int, ...]
) -> tuple[list, list, list]:
    """M_jk, C_jk and C_kj of the joints j on the way from the base to joint k, its last.

    Momenta of joint k and their rates, handed down from frame to frame.
    """
    w, v, w_rate, v_rate = joints[way[-1]]
    m, h, inertia, P, D = beyond
    momenta = plus(scale(m, v), cross(w, h)), plus(cross(h, v), apply(inertia, w))
    rates = (
        plus(plus(scale(m, v_rate), cross(w_rate, h)), cross(w, P)),
        plus(plus(cross(h, v_rate), apply(inertia, w_rate)), apply(D, w)),
    )
    turned = plus(cross(P, v), apply(transpose(D), w))
    M, C, C_turned = [], [], []
    for at in reversed(range(len(way))):
        j = way[at]
        if j != way[-1]:
            place = places[way[at + 1]]
            momenta, rates, turned = _handed(place, momenta), _handed(place, rates), place.to_parent(turned)
        M.append(_project(joints[j], *momenta))
        C.append(_project(joints[j], *rates))
        drag = add(dot(momenta[0], joints[j].v_rate), dot(momenta[1], joints[j].w_rate))
        C_turned.append(add(drag, dot(turned, joints[j].w)))
    return M[::-1], C[::-1], C_turned[::-1]


def _motions(arm: Chain, places: list[Placement], qd: list[Number]) -> list[_Motion]:
    """Velocities and gravity from the base outward."""
    motions = [_Motion(ZERO, ZERO, arm.gravity)]  # of the base, then the links
    for before, place, rate in zip(arm.parent, places, qd, strict=True):
        motion = motions[before + 1]
        swing = plus(motion.linear, cross(motion.angular, place.position))
        angular, linear = place.to_link(motion.angular), place.to_link(swing)
        along = scale(rate, place.link.axis)
        if place.link.is_slide:
            linear = plus(linear, along)
        else:
            angular = plus(angular, along)
        motions.append(_Motion(angular, linear, place.to_link(motion.gravity)))
    return motions[1:]


def _joint(place: Placement, motion: _Motion) -> _Joint:
    axis = place.link.axis
    turned = cross(motion.angular, axis)
    if place.link.is_slide:
        return _Joint(ZERO, axis, ZERO, turned)
    return _Joint(axis, ZERO, turned, cross(motion.linear, axis))


def _own(place: Placement, motion: _Motion) -> _Carried:
    """The link by itself.  With A = sum m x x^T = tr(I)/2 1 - I, sum m xd x^T = u h^T + S(w) A."""
    link, w, u = place.link, motion.angular, motion.linear
    h, inertia = link.first, link.inertia
    half = mul(0.5, total(inertia[i][i] for i in range(3)))
    A = minus_matrix(diagonal(half), inertia)
    swing = transpose((cross(w, A[0]), cross(w, A[1]), cross(w, A[2])))  # A is symmetric: its rows are its columns
    D = minus_matrix(minus_matrix(diagonal(dot(u, h)), outer(u, h)), swing)
    return _Carried(link.mass, h, inertia, plus(scale(link.mass, u), cross(w, h)), D)


def _moved(place: Placement, x: _Carried) -> _Carried:
    """The same bodies, told in the frame before."""
    p, h, P = place.position, place.to_parent(x.first), place.to_parent(x.momentum)
    inertia, D = turned_matrix(place, x.inertia), turned_matrix(place, x.moment)
    mp = scale(x.mass, p)
    reach = plus(h, plus(h, mp))
    spread = minus_matrix(minus_matrix(diagonal(dot(p, reach)), outer(p, plus(h, mp))), outer(h, p))
    D = plus_matrix(D, minus_matrix(diagonal(dot(p, P)), outer(P, p)))
    return _Carried(x.mass, plus(h, mp), plus_matrix(inertia, spread), P, D)


def _sum(x: _Carried, y: _Carried) -> _Carried:
    return _Carried(
        add(x.mass, y.mass), plus(x.first, y.first), plus_matrix(x.inertia, y.inertia),
        plus(x.momentum, y.momentum), plus_matrix(x.moment, y.moment),
    )  # fmt: skip


def _handed(place: Placement, pair: tuple[Vector, Vector]) -> tuple[Vector, Vector]:
    """A force-like and a moment-like vector, told in the frame before."""
    linear, angular = place.to_parent(pair[0]), place.to_parent(pair[1])
    return linear, plus(angular, cross(place.position, linear))


def _project(joint: _Joint, linear: Vector, angular: Vector) -> Number:
    return add(dot(joint.v, linear), dot(joint.w, angular))


def diagonal(x: Number) -> Matrix:
    """x times the unit matrix."""
    return ((x, 0.0, 0.0), (0.0, x, 0.0), (0.0, 0.0, x))


def outer(u: Vector, v: Vector) -> Matrix:
    """u v^T."""
    return (scale(u[0], v), scale(u[1], v), scale(u[2], v))


def plus_matrix(A: Matrix, B: Matrix) -> Matrix:
    """A + B."""
    return (plus(A[0], B[0]), plus(A[1], B[1]), plus(A[2], B[2]))


def minus_matrix(A: Matrix, B: Matrix) -> Matrix:
    """A - B."""
    return (minus(A[0], B[0]), minus(A[1], B[1]), minus(A[2], B[2]))


def turned_matrix(place: Placement, A: Matrix) -> Matrix:
    """R A R^T, from link axes to parent axes."""
    columns = tuple(place.to_parent(column) for column in transpose(A))
    rows = transpose((columns[0], columns[1], columns[2]))
    return (place.to_parent(rows[0]), place.to_parent(rows[1]), place.to_parent(rows[2]))


def solved(M: Rows, b: list[Number]) -> list[Number]:
    """x of M x = b for a symmetric positive definite M, by M = L D L^T written out.

    Args:
        M: n rows of n scalars.
        b: n scalars.
    """
    n = len(b)
    L: Rows = [[0.0] * n for _ in range(n)]
    d: list[Number] = [0.0] * n
    inverse: list[Number] = []
    for j in range(n):
        d[j] = sub(M[j][j], total(mul(mul(L[j][k], L[j][k]), d[k]) for k in range(j)))
        inverse.append(1.0 / d[j])
        for i in range(j + 1, n):
            rest = sub(M[i][j], total(mul(mul(L[i][k], L[j][k]), d[k]) for k in range(j)))
            L[i][j] = mul(rest, inverse[j])
    y: list[Number] = []
    for i in range(n):
        y.append(sub(b[i], total(mul(L[i][k], y[k]) for k in range(i))))
    x: list[Number] = [0.0] * n
    for i in reversed(range(n)):
        x[i] = sub(mul(y[i], inverse[i]), total(mul(L[k][i], x[k]) for k in range(i + 1, n)))
    return x
