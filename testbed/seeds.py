"""Three draws of cases; a case is a pure function of its draw and its index."""

import hashlib

import numpy as np

DRAWS = ("work", "check", "final")


def generator(draw: str, index: int, stream: str = "", commit: str = "") -> np.random.Generator:
    """Random numbers of one case.

    Args:
        draw: "work" (look as often as you like), "check" (every look is counted) or "final" (once).
        index: Of the case.
        stream: A part of the case that shall not change when another part draws more numbers.
        commit: The hash that seeds "final", which nobody knows before the commit is made.

    Raises:
        ValueError: There is no such draw, or "final" came without a commit.
    """
    if draw not in DRAWS:
        raise ValueError(f"draw {draw!r}: allowed are {', '.join(DRAWS)}")
    if (draw == "final") != bool(commit):
        raise ValueError("a commit's hash seeds the draw 'final' and no other: give it there, and only there")
    digest = hashlib.sha256(f"{draw}/{commit}/{index}/{stream}".encode()).digest()
    return np.random.default_rng(np.frombuffer(digest, dtype=np.uint32))
