"""Which joint moves which link, told by `Robot.parent`: links in depth-first order, each after the one it sits on."""

from functools import cache

import numpy as np

Parents = tuple[int, ...]


def serial(n: int) -> Parents:
    """Parents of a chain: each link sits on the one before."""
    return tuple(range(-1, n - 1))


def is_depth_first(parent: Parents) -> bool:
    """Whether every link comes right after its parent or after all that its parent's earlier children carry."""
    way = [-1]
    for i, before in enumerate(parent):
        while way and way[-1] != before:
            way.pop()
        if not way:
            return False
        way.append(i)
    return True


@cache
def path(parent: Parents, link: int) -> tuple[int, ...]:
    """Joints that move this link, from the base outward, its own last; none for the base, -1."""
    return () if link < 0 else (*path(parent, parent[link]), link)


@cache
def carried(parent: Parents, joint: int) -> range:
    """Links that this joint moves: its own and all beyond; in depth-first order they stand in a row."""
    last = max(i for i in range(len(parent)) if joint in path(parent, i))
    return range(joint, last + 1)


def children(parent: Parents, link: int) -> list[int]:
    """Links that sit on this one; -1 is the base."""
    return [i for i, before in enumerate(parent) if before == link]


def moves(parent: Parents) -> np.ndarray:
    """Whether joint j moves link i, at [i, j], shape (n, n); of a chain the lower triangle."""
    n = len(parent)
    mask = np.zeros((n, n), dtype=bool)
    for i in range(n):
        mask[i, list(path(parent, i))] = True
    return mask
