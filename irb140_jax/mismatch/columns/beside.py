"""Which candidates can't stand beside each other."""

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from irb140_jax.mismatch.columns.candidates import Candidate


class Beside:
    """What can stand beside what, worked out once for each effect at each site: a search asks thousands of times.

    Args:
        candidates: All candidates.
    """

    def __init__(self, candidates: Sequence[Candidate]):
        sites = [(c.slug, c.joints) for c in candidates]
        first = {site: i for i, site in reversed(list(enumerate(sites)))}
        self._kinds = [candidates[i] for i in first.values()]
        number = {site: k for k, site in enumerate(first)}
        self._kind = np.array([number[site] for site in sites], dtype=int)
        self._last = max((c.joints[0] for c in candidates if c.is_inertials), default=-1)

    def conflicts(self, chosen: tuple[int, ...]) -> np.ndarray:
        """Candidates that can't stand beside a set, shape (candidates,).

        They are the effect itself, and what absorbs it or is absorbed.
        """
        kinds = self._kind[list(chosen)]
        return np.any(self._excludes[kinds], axis=0)[self._kind]

    @cached_property
    def _excludes(self) -> np.ndarray:
        """Whether one rules out another at its site, shape (kinds, kinds)."""
        return self._table(
            lambda a, b: a.joints == b.joints
            and (a.slug == b.slug or b.slug in _absorbed(a) or a.slug in _absorbed(b))
            or self.one_body(a, b)
        )

    def _table(self, holds: Callable[[Candidate, Candidate], bool]) -> np.ndarray:
        table = np.zeros((len(self._kinds), len(self._kinds)), dtype=bool)
        for i, a in enumerate(self._kinds):
            for k, b in enumerate(self._kinds):
                table[i, k] = holds(a, b)
        return table

    def one_body(self, a: Candidate, b: Candidate) -> bool:
        """Whether one is a payload and the other the inertials of the link that holds it, wrong: both are one body."""
        link, payload = (a, b) if a.is_inertials else (b, a)
        return link.is_inertials and link.joints == (self._last,) and payload.effect.prior.is_mass


def _absorbed(c: Candidate) -> set[str]:
    return set(c.effect.law.contains) if c.effect.law.absorbs else set()
