"""Random trees of joints, as MJCF."""

import numpy as np


def tree_xml(
    parents: tuple[int, ...], seed: int, kinds: str = "", extra: str = "", inside: dict[int, str] | None = None
) -> str:
    """MJCF of a tree on a fixed, tilted base: any axes, inertials and reference positions, drives, springs.

    Args:
        parents: Body that each body sits on, -1 for the base.
        seed: Same seed, same tree.
        kinds: H or S for each joint; by default every third one slides.
        extra: XML beside the world.
        inside: XML to put into bodies, by their number.
    """
    rng = np.random.default_rng(seed)
    numbers = lambda x: " ".join(repr(float(v)) for v in np.atleast_1d(x))  # noqa: E731
    kinds = kinds or "".join("S" if i % 3 == 2 else "H" for i in range(len(parents)))

    def body(i: int) -> str:
        A = rng.normal(size=(3, 3))
        second = A @ A.T * 0.02 + np.eye(3) * 0.02
        inertia = np.trace(second) * np.eye(3) - second
        full = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        head = (
            f'<body name="body{i}" pos="{numbers(rng.normal(size=3) * 0.3)}" quat="{numbers(rng.normal(size=4))}">'
            f'<inertial pos="{numbers(rng.normal(size=3) * 0.1)}" mass="{rng.uniform(1, 4)}" '
            f'fullinertia="{numbers(full)}"/>'
            f'<joint name="j{i}" type="{"slide" if kinds[i] == "S" else "hinge"}" axis="{numbers(rng.normal(size=3))}" '
            f'pos="{numbers(rng.normal(size=3) * 0.1)}" ref="{numbers(rng.normal())}" damping="{rng.uniform(0, 2)}" '
            f'armature="{rng.uniform(0, 1)}" stiffness="{rng.uniform(0, 5)}" springref="{numbers(rng.normal())}"/>'
        )
        return head + carried(i) + (inside or {}).get(i, "") + "</body>"

    def carried(i: int) -> str:
        return "".join(body(k) for k, before in enumerate(parents) if before == i)

    base = f'pos="0.1 -0.2 0.3" quat="{numbers(rng.normal(size=4))}"'
    return (
        f'<mujoco><compiler angle="radian"/>{extra}<worldbody><body name="base" {base}>{carried(-1)}</body></worldbody>'
        "</mujoco>"
    )


def random_parents(rng: np.random.Generator, n: int) -> tuple[int, ...]:
    """A random tree in depth-first order: each body on the last one or on any that is on the way to it."""
    parents, way = [], [-1]
    for i in range(n):
        way = way[: rng.integers(1, len(way) + 1)] if rng.random() < 0.5 else way
        parents.append(int(way[-1]))
        way.append(i)
    return tuple(parents)
