"""Vector algebra written out in scalars, leaving out what is known to be zero or one.

A scalar is a Python float (known when the function is traced) or an array: shape () for one sample, (T,) for a batch.
Batches last and 3-vectors as three arrays is what XLA vectorises best on a CPU; folding the known zeros and ones of a
robot's geometry halves the arithmetic.
"""

from collections.abc import Iterable

from jaxtyping import Array

Number = float | Array
Vector = tuple[Number, Number, Number]
Matrix = tuple[Vector, Vector, Vector]

ZERO: Vector = (0.0, 0.0, 0.0)


def is_known(x: Number, value: float) -> bool:
    """Whether x is known at trace time to equal this value."""
    return isinstance(x, float) and x == value


def mul(x: Number, y: Number) -> Number:
    """x y."""
    if is_known(x, 0.0) or is_known(y, 0.0):
        return 0.0
    if is_known(x, 1.0):
        return y
    if is_known(y, 1.0):
        return x
    if is_known(x, -1.0):
        return -y
    if is_known(y, -1.0):
        return -x
    return x * y


def add(x: Number, y: Number) -> Number:
    """x + y."""
    if is_known(x, 0.0):
        return y
    return x if is_known(y, 0.0) else x + y


def sub(x: Number, y: Number) -> Number:
    """x - y."""
    if is_known(y, 0.0):
        return x
    return -y if is_known(x, 0.0) else x - y


def total(terms: Iterable[Number]) -> Number:
    """Sum of the terms."""
    result: Number = 0.0
    for term in terms:
        result = add(result, term)
    return result


def dot(u: Vector, v: Vector) -> Number:
    """Scalar product."""
    return total(mul(x, y) for x, y in zip(u, v, strict=True))


def plus(u: Vector, v: Vector) -> Vector:
    """Sum of two vectors."""
    return (add(u[0], v[0]), add(u[1], v[1]), add(u[2], v[2]))


def minus(u: Vector, v: Vector) -> Vector:
    """Difference of two vectors."""
    return (sub(u[0], v[0]), sub(u[1], v[1]), sub(u[2], v[2]))


def scale(x: Number, v: Vector) -> Vector:
    """x v."""
    return (mul(x, v[0]), mul(x, v[1]), mul(x, v[2]))


def cross(u: Vector, v: Vector) -> Vector:
    """Vector product."""
    return (
        sub(mul(u[1], v[2]), mul(u[2], v[1])),
        sub(mul(u[2], v[0]), mul(u[0], v[2])),
        sub(mul(u[0], v[1]), mul(u[1], v[0])),
    )


def apply(A: Matrix, v: Vector) -> Vector:
    """A v."""
    return (dot(A[0], v), dot(A[1], v), dot(A[2], v))


def transpose(A: Matrix) -> Matrix:
    """A^T."""
    return ((A[0][0], A[1][0], A[2][0]), (A[0][1], A[1][1], A[2][1]), (A[0][2], A[1][2], A[2][2]))


def turn(axis: Vector, c: Number, s: Number, v: Vector) -> Vector:
    """v turned about the axis by the angle of which c, s are cosine and sine (Rodrigues' formula)."""
    for k in range(3):
        if is_known(axis[k], 1.0) or is_known(axis[k], -1.0):
            return _turn_about_coordinate(k, c, mul(axis[k], s), v)
    across = cross(axis, v)
    return plus(v, plus(scale(s, across), scale(sub(1.0, c), cross(axis, across))))


def _turn_about_coordinate(k: int, c: Number, s: Number, v: Vector) -> Vector:
    i, j = (k + 1) % 3, (k + 2) % 3
    result = list(v)
    result[i] = sub(mul(c, v[i]), mul(s, v[j]))
    result[j] = add(mul(s, v[i]), mul(c, v[j]))
    return (result[0], result[1], result[2])
