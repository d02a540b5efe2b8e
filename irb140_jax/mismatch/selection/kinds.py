"""The prior of effects over sites: what a model leaves out at one joint it often leaves out at others."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy import special

from irb140_jax.mismatch.columns.candidates import Candidate


@dataclasses.dataclass(frozen=True)
class Kinds:
    """How probable it is that effects of one kind are at some of a robot's sites.

    What a model leaves out at one joint it often leaves out at others: the share of sites that have it is a robot's
    own, with a Beta(2 sites, N + 1) distribution over robots (Beta and Bernoulli).  The odds are sites / N for any one
    site where no other has it, and about 1 / 2N for the next.

    Attributes:
        of: Kind of each candidate, below 0 where sites are independent, shape (candidates,).
        number: Sites N of each kind, shape (kinds,).
        sites: About how many sites have it, on average over robots.
    """

    of: np.ndarray
    number: np.ndarray
    sites: float

    def log_prior(self, chosen: Sequence[int]) -> float:
        """Log odds of a set's sites against none."""
        there = self._there(chosen)
        return float(np.sum(self._log(there) - self._log(np.zeros_like(there))))

    def one_more(self, chosen: Sequence[int]) -> np.ndarray:
        """Log odds of each candidate's site beside a set, zero where sites are independent, shape (candidates,)."""
        there = self._there(chosen)
        odds = self._log(np.minimum(there + 1, self.number)) - self._log(there)
        return np.where(self.of >= 0, np.append(odds, 0.0)[self.of], 0.0)

    def _there(self, chosen: Sequence[int]) -> np.ndarray:
        of = self.of[list(chosen)]
        return np.bincount(of[of >= 0], minlength=len(self.number))

    def _log(self, there: np.ndarray) -> np.ndarray:
        return special.betaln(2.0 * self.sites + there, 2.0 * self.number + 1.0 - there)


def kinds_of(candidates: Sequence[Candidate], expected: float) -> Kinds:
    """Kinds of effects, each at about so many sites; ordinary friction is anywhere by itself."""
    sites: dict[str, set[tuple[int, ...]]] = {}
    for c in candidates:
        if not c.effect.prior.ordinary:
            sites.setdefault(c.slug, set()).add(c.joints)
    number = {slug: k for k, slug in enumerate(sites)}
    return Kinds(
        np.array([number.get(c.slug, -1) for c in candidates]), np.array([len(s) for s in sites.values()]), expected
    )
