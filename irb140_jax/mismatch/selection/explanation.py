"""A set of candidates beside the rigid body: what it is in the data, and how probable it and its members are."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy import special

from irb140_jax.effects import Scales
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate, Library
from irb140_jax.mismatch.inertials.bodies import of_bodies
from irb140_jax.mismatch.regression.assemble import Data
from irb140_jax.mismatch.regression.gaussian import Posterior
from irb140_jax.mismatch.regression.gram import LEVELS
from irb140_jax.mismatch.regression.noise import Noise
from irb140_jax.mismatch.regression.nuisances import COMMON, DRIVE, FIXED, Nuisances
from irb140_jax.mismatch.selection.averages import Sets, Site, in_its_place, probabilities, site_of
from irb140_jax.mismatch.selection.evidence import Hyper, Space
from irb140_jax.mismatch.selection.falling_friction import Fall
from irb140_jax.mismatch.selection.hyperparameters import settled
from irb140_jax.mismatch.selection.late_channels import Late
from irb140_jax.mismatch.selection.screening import gains, near, reshaped
from irb140_jax.recordings.drive import Drive, Times
from irb140_jax.recordings.low_pass import Band
from irb140_jax.recordings.payload import Payload, distinct


@dataclasses.dataclass(frozen=True)
class Explanation:
    """What explains the recordings, and everything needed to judge it.

    Attributes:
        lib: The library in its last state: refined shapes.
        scales: Sizes of the recordings.
        data: Low-passed rows.
        extra: Nuisance columns and the discrepancy's, one per recording.
        noise: What whitens the rows.
        space: Gram matrices of all candidates, and priors.
        by_block: The same of what is named alone, by block of the data, once the search is over.
        chosen: Indices of the candidates that are named.
        hyper: Sizes of the discrepancy and noise levels of each joint beside them.
        sets: Log posterior of every set that the search visited, with some scale of all logged torques in each.
        averaged: That of sets with the candidate `scale` and without any scale, over which probabilities are averages.
        scale: One scale of all logged torques; as a member of sets it comes after all candidates.
        scaled: Whether it is a finding, and as such in what predicts.
        factor: Square root of the inertial prior at relative standard deviation 1, shape (10 n, 10 n).
        falls: Members that are named because friction certainly falls with speed, whatever its form.
        unproved: What the search found and unseen or simulated motions speak against: not named.
        times: When drives act, by which torques of its rows were made.
        payloads: What the tool carried in each recording, by which its rows were made.
        rigid: The fit of the inertials alone, from all blocks of the data or all but some: it predicts where nothing is
            named.  None in logs of commands, where drives err beside it.
        open_rotors: Rotors that are not named and that the torque of servos leaves open, for a fit to the motion.
        rests_on: Effects that are in the explanation at which the regression is linearised: what slopes there say of
            sets without them is wrong.
        nominal: The explanation by slopes at the nominal model, without its rows, where there are such effects.
        late: Members that are named because their channel is certainly early or late.
        without_sites: The last round of the search again, without some effects: of logs of commands alone.
    """

    lib: Library
    scales: Scales
    data: Data
    extra: list[Nuisances]
    noise: Noise
    space: Space
    by_block: Space
    chosen: tuple[int, ...]
    hyper: Hyper
    sets: Sets
    averaged: Sets
    scale: Candidate
    factor: np.ndarray
    falls: Mapping[int, Fall] = dataclasses.field(default_factory=dict)
    scaled: bool = False
    unproved: tuple[Site, ...] = ()
    times: Times = Times()
    payloads: tuple[Payload | None, ...] = ()
    rigid: Callable[[np.ndarray | None], Posterior] | None = None
    open_rotors: tuple[int, ...] = ()
    rests_on: frozenset[Site] = frozenset()
    nominal: "Explanation | None" = None
    late: Mapping[Site, Late] = dataclasses.field(default_factory=dict)
    without_sites: Callable[[Sequence[Site]], "Explanation"] | None = None

    @property
    def members(self) -> list[Candidate]:
        """The chosen candidates."""
        return [self.data.candidates[c] for c in self.chosen]

    @property
    def averaged_over(self) -> Sequence[Candidate]:
        """What sets in `averaged` consist of."""
        return [*self.data.candidates, self.scale]

    @property
    def level(self) -> np.ndarray:
        """Standard deviation of the noise that is left at each joint, shape (n,) [N m or N]."""
        return np.sqrt(np.mean(self.noise.total**2, axis=0)) * [LEVELS[s[-1]] for s in self.hyper]

    def columns(self, chosen: tuple[int, ...] | None = None) -> np.ndarray:
        """Columns of the data that a set uses: inertials, then the amplitudes of its candidates."""
        chosen = self.chosen if chosen is None else chosen
        own = [self.data.nuisances + self.data.candidates[c].columns for c in chosen]
        return np.concatenate([np.arange(self.data.nuisances), *own])

    def others(self, index: int) -> tuple[int, ...]:
        """The chosen candidates but one."""
        return tuple(c for c in self.chosen if c != index)

    def not_only_on(self, joints: np.ndarray) -> "Explanation":
        """The explanation without effects that are on some joints alone, shape (n,); what happens once stays."""
        stays = lambda c: c.is_inertials or c.effect.shapes.during or not joints[list(c.joints)].all()  # noqa: E731
        kept = (i for i, c in zip(self.chosen, self.members, strict=True) if stays(c))
        return dataclasses.replace(self, chosen=tuple(kept))

    def log_posterior(self, chosen: Sequence[int], joints: Sequence[int] | None = None) -> float:
        """Log posterior of a set, sizes and levels fitted to it anew, at some joints or all.

        Without a member, others may have another shape.  In place of a law that is named for its falling curve stands
        ordinary friction, as in the search.
        """
        kept = [c for c in chosen if self._late(c) is None]
        members = tuple(sorted(self.falls[c].usual if c in self.falls else c for c in kept))
        value = -np.inf
        for other in dict.fromkeys((members, reshaped(self.space, members, self.hyper))):
            known = self.sets.get(frozenset(other))
            value = max(value, settled(self.space, other, self.hyper, joints)[0] if known is None else known)
        return value

    def gains(self, chosen: tuple[int, ...], which: Sequence[int]) -> np.ndarray:
        """Log posterior odds of adding each of some candidates to a set, -inf where inadmissible."""
        return gains(self.space, chosen, self.hyper, np.asarray(which, dtype=int))

    def near(self, chosen: tuple[int, ...], columns: np.ndarray) -> np.ndarray:
        """Gram matrix of some amplitudes' columns and y; inertials, nuisances and a set's amplitudes integrated out.

        Args:
            chosen: The set.
            columns: Columns of amplitudes, numbered from the first amplitude.
        """
        return near(self.space, chosen, self.hyper, columns + self.space.offset)

    def posterior(
        self, chosen: tuple[int, ...] | None = None, without: np.ndarray | None = None, *, instrument: bool = True,
        width: float | None = None,
    ) -> Posterior:  # fmt: skip
        """Inertials and amplitudes in prior units, with discrepancy and nuisance parameters integrated out.

        Args:
            chosen: Which candidates, by default those that are named.
            without: Which blocks of the data are left out, shape (blocks,).
            instrument: Whether the instrument may err within its stated widths.  For predictions it is taken to be
                right but for what is named, and for the drive of a servo.
            width: True over stated error of the inertials, by default the one that is most probable beside them.
        """
        chosen = self.chosen if chosen is None else chosen
        space = self.space if without is None else self.by_block.without(without)
        mean, cov = space.posterior(chosen, self.hyper, instrument=instrument, scaled=self.scaled, width=width)
        keep = np.r_[0 : self.space.inertials, self.space.offset : len(mean)]
        return Posterior(self.columns(chosen), mean[keep], cov[np.ix_(keep, keep)])

    def beyond_columns(
        self, post: Posterior, scale: float, torques: Sequence[np.ndarray], band: Band
    ) -> list[np.ndarray]:
        """What the torque of laws is beyond the sum of their columns [N m or N], (R, n) each: products of unknowns.

        Nothing where the round was linearised at what it found.

        Args:
            post: Inertials and amplitudes.
            scale: Logged over real torque of all joints alike, less one.
            torques: Of the laws with those numbers along each recording, (T, n) [N m or N].
            band: Of the comparison.
        """
        w, out = post.mean * self.data.scale[post.columns], []
        for s, extra, torque in zip(self.data.stretches, self.extra, torques, strict=True):
            linear = s.tau - s.y + s.torque(post.columns, w) + scale / settings.GAIN_COMMON * extra.common[..., 0]
            out.append(band.apply(torque) - linear)
        return out

    def torque_scale(self) -> tuple[float, float]:
        """Logged over real torque of all joints alike, less one: mean and standard deviation."""
        mean, cov = self.space.posterior(self.chosen, self.hyper)
        at = self.space.inertials
        return settings.GAIN_COMMON * float(mean[at]), settings.GAIN_COMMON * float(np.sqrt(cov[at, at]))

    def command_delay(self, stated: Drive) -> tuple[float, float]:
        """Delay of all commands beyond what was given, and its standard deviation [s]; none acts before it is given."""
        more, unsure = self._common(self.space.offset - 1, stated.common_delay_width)
        return max(self.times.delay + more, -float(np.min(stated.delay))), unsure

    def torque_lag(self, stated: Drive) -> float:
        """Lag of all torques behind what commands and positions say [s]; none comes before."""
        return max(self.times.lag + self._common(self.space.inertials + 1, stated.time_width)[0], 0.0)

    def own_nuisance(self, j: int, which: int, without: np.ndarray | None = None) -> tuple[float, float]:
        """One of a joint's own nuisance parameters and its standard deviation, both in prior standard deviations.

        Args:
            j: The joint.
            which: Of its own nuisances.
            without: Which blocks of the data are left out, shape (blocks,).
        """
        return self._of_joint(j, which, 1.0, 0.0, without)

    def kp_scale(self, j: int, drive: Drive, without: np.ndarray | None = None) -> tuple[float, float]:
        """Stated over real Kp of a servo, less one, and its standard deviation: what the masses of the model say of it.

        Args:
            j: The joint.
            drive: As it was given.
            without: Which blocks of the data are left out, shape (blocks,).
        """
        width = float(np.hypot(settings.GAIN_JOINT, np.nan_to_num(drive.kp_width[j])))
        return self._of_joint(j, FIXED.index("gain"), width, settings.GAIN_COMMON, without)

    def _of_joint(
        self, j: int, which: int, width: float, of_all: float, without: np.ndarray | None
    ) -> tuple[float, float]:
        """One of a joint's own nuisances times a width, beside the scale of all torques times another."""
        space = self.space if without is None else self.by_block.without(without)
        shared = np.zeros((1, len(space.set_columns(self.chosen))))
        shared[0, space.inertials] = of_all
        own = width * (np.arange(len(space.joints[j].groups)) == which)[None]
        mean, cov = space.functions(self.chosen, self.hyper, j, shared, own)
        return float(mean[0]), float(np.sqrt(cov[0, 0]))

    def phases(self, stated: Drive) -> tuple[np.ndarray, np.ndarray]:
        """By how much later commands of each recording are taken up than those of all, and standard deviations [s].

        Both of shape (recordings,), or empty where there is one recording.
        """
        mean, cov = self.space.posterior(self.chosen, self.hyper)
        mine = slice(self.space.offset - 1 - self._phases, self.space.offset - 1)
        count = len(mean[mine])
        made = np.array(self.times.phases or np.zeros(count))
        beside = stated.phase_width * (np.eye(count) - 1.0 / max(count, 1))
        return made + beside @ mean[mine], np.sqrt(np.diag(beside @ cov[mine, mine] @ beside.T))

    def payloads_found(self) -> tuple[Payload | None, ...]:
        """What the tool carried in each recording, where it was found to sit."""
        mean, _ = self.space.posterior(self.chosen, self.hyper)
        moved, out = settings.PAYLOAD_PLACED * mean[self.space.inertials + COMMON :], dict[Payload | None, Payload]()
        for k, p in enumerate(distinct(self.payloads)):
            x, y, z = np.add(p.off, moved[3 * k : 3 * k + 3]).tolist()
            out[p] = dataclasses.replace(p, off=(x, y, z))
        return tuple(out.get(p) for p in self.payloads)

    @property
    def _phases(self) -> int:
        """How many nuisances phases of recordings are."""
        return len(self.extra) if len(self.extra) > 1 else 0

    def _common(self, at: int, width: float) -> tuple[float, float]:
        """A time that all joints share, from that with which the rows were made, and its standard deviation [s]."""
        mean, cov = self.space.posterior(self.chosen, self.hyper)
        return width * float(mean[at]), width * float(np.sqrt(cov[at, at]))

    def prediction(self, without: np.ndarray | None = None) -> tuple[Posterior, float, list[np.ndarray]]:
        """What predicts: possible inertials and amplitudes, the torque scale less one, and each joint's own columns.

        The latter are the discrepancy and, of a servo, what its drive is off by.  Where nothing is named and the
        instrument accounts for an error, inertials fitted as precisely as the sensors are drawn away by it.

        Args:
            without: Which blocks of the data are left out, shape (blocks,).
        """
        space = self.space if without is None else self.by_block.without(without)
        columns = space.set_columns(self.chosen)
        mean, keep = np.zeros(len(columns)), np.r_[0 : space.inertials, space.offset : len(columns)]
        if self.rigid is None or self.scaled or not all(c.is_inertials for c in self.members):
            mean, cov = space.posterior(self.chosen, self.hyper, instrument=False, scaled=self.scaled)
            mean = self.of_bodies(mean, cov, self.chosen, space.offset)
            post = Posterior(self.columns(), mean[keep], cov[np.ix_(keep, keep)])
        else:
            post = self.rigid(without)
            mean[keep] = post.mean
        own = [space.own(j, s, columns, mean, instrument=False) for j, s in enumerate(self.hyper)]
        return post, settings.GAIN_COMMON * float(mean[space.inertials]), own

    def of_drives(self, own: list[np.ndarray]) -> np.ndarray:
        """What each drive is off by, from the own columns of a `prediction`, in standard deviations, (n, 2 or 0)."""
        return np.stack([v[g.groups == DRIVE] for g, v in zip(self.space.joints, own, strict=True)])

    def beside_instrument(self, without: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """Inertials and amplitudes, common nuisances, and each joint's own fixed ones: nothing of the discrepancy.

        Args:
            without: Which blocks of the data are left out, shape (blocks,).
        """
        space = self.by_block.without(without)
        mean, _ = space.posterior(self.chosen, self.hyper)
        columns, keep = space.set_columns(self.chosen), np.r_[0 : space.inertials, space.offset : len(mean)]
        own = [space.own(j, s, columns, mean, instrument=True) for j, s in enumerate(self.hyper)]
        fixed = [np.where(g.groups < 0, v, 0.0) for g, v in zip(space.joints, own, strict=True)]
        return mean[keep], mean[space.inertials : space.offset], fixed

    def of_bodies(self, mean: np.ndarray, cov: np.ndarray, chosen: tuple[int, ...], first: int) -> np.ndarray:
        """A posterior mean moved to the most probable inertials that bodies can have; all else moves along.

        Args:
            mean, cov: Of inertials first and a set's amplitudes last, in prior units.
            chosen: The set.
            first: Column of its first amplitude.
        """
        size = self.space.inertials
        into = np.zeros((size, len(mean)))
        into[:, :size] = np.diag(self.data.scale[:size])
        for c in (self.data.candidates[i] for i in chosen):
            own = first + np.arange(len(c.columns))
            if c.is_inertials:
                rows = (10 * np.array(c.joints)[:, None] + np.arange(10)).ravel()
                into[rows, own] = self.data.scale[self.data.nuisances + c.columns]
            first += len(own)
        return of_bodies(mean, cov, into, np.asarray(self.lib.robot.phi), self.factor)

    def log_odds(self, index: int) -> float:
        """Log posterior odds of a finding against the set without it; of friction also against ordinary friction.

        Where others are inadmissible without it, against the best set without it that the search visited; where slopes
        say nothing of sets without it, of the best sets that a search without those slopes visited.
        """
        if why := self.falls.get(index) or self._late(index):
            return why.log_odds
        every, c, rest = self.data.candidates, self.data.candidates[index], self.others(index)
        here = {i for i, o in enumerate(every) if site_of(o) == site_of(c)}
        best = lambda sets, there: max((x for s, x in sets.items() if bool(s & here) == there), default=-np.inf)  # noqa: E731
        if (judge := self.judged_by(index)) is not self:  # with the same candidates: both searched one library
            return best(judge.sets, True) - best(judge.sets, False)
        options = {rest, (*rest, *usual_in_its_place(every, self.chosen, index))}
        joints = list(self.space.reach(index))
        without = max(self.log_posterior(o, joints) for o in options)
        if not np.isfinite(without):
            without = best(self.sets, False)
        return self.log_posterior(self.chosen, joints) - without

    def probability(self, index: int) -> float:
        """Of a chosen candidate's effect at its joints, over all sets visited."""
        if why := self.falls.get(index) or self._late(index):
            others = why.rivals.values() if isinstance(why, Late) else ()
            return float(special.expit(why.log_odds)) * (1.0 - sum(others))
        return probabilities(self.averaged_over, self._sets(index)).get(site_of(self.averaged_over[index]), 0.0)

    def rivals(self, index: int) -> dict[Site, float]:
        """Share of the sets in which another effect stands in a chosen candidate's place, by that effect.

        Of friction that certainly falls with speed none: with a special case of it, the discrepancy holds the fall.
        """
        if index in self.falls:
            return {}
        if why := self._late(index):
            return dict(why.rivals)
        stated = (*self.chosen, len(self.data.candidates)) if self.scaled else self.chosen
        return in_its_place(self.averaged_over, self._sets(index), stated, index)[0]

    def _late(self, index: int) -> Late | None:
        """Why a chosen candidate is named, if it is because its channel is certainly early or late."""
        return self.late.get(site_of(self.averaged_over[index]))

    def _sets(self, index: int) -> Sets:
        """Log posterior of sets with a chosen candidate and without it."""
        return self.judged_by(index).averaged

    def judged_by(self, index: int) -> "Explanation":
        """The explanation whose slopes say something of sets without a chosen candidate."""
        return self.nominal if self.nominal and site_of(self.averaged_over[index]) in self.rests_on else self


def usual_in_its_place(candidates: Sequence[Candidate], chosen: Sequence[int], index: int) -> tuple[int, ...]:
    """Ordinary friction that a set lacks where it has friction that is not: what may be there in its place.

    Args:
        candidates: What may be in a set.
        chosen: The set.
        index: Which of it.
    """
    c, taken = candidates[index], {site_of(candidates[i]) for i in chosen}
    if not c.effect.place.is_friction or c.effect.prior.ordinary:
        return ()
    usual = [i for i, o in enumerate(candidates) if o.effect.prior.ordinary and o.joints == c.joints]
    return tuple(i for i in usual if site_of(candidates[i]) not in taken)


def parts(data: Data, chosen: tuple[int, ...]) -> list[slice]:
    """Where each member of a set has its amplitudes in a posterior of inertials and amplitudes, (len(chosen),)."""
    widths = [len(data.candidates[i].columns) for i in chosen]
    ends = data.nuisances + np.cumsum(widths, dtype=int)
    return [slice(int(end) - width, int(end)) for end, width in zip(ends, widths, strict=True)]


def fitted(
    data: Data, post: Posterior, chosen: tuple[int, ...], factor: np.ndarray
) -> tuple[np.ndarray, list[Candidate], list[np.ndarray]]:
    """Shift of the inertial parameters (10 n,), and the named effects with their amplitudes, from a posterior."""
    w = post.mean * data.scale[post.columns]
    dphi, members, amplitudes = factor @ w[: data.nuisances], [], []
    for i, part in zip(chosen, parts(data, chosen), strict=True):
        c = data.candidates[i]
        if c.is_inertials:
            rows = (10 * np.array(c.joints)[:, None] + np.arange(10)).ravel()
            dphi = dphi + factor[:, rows] @ w[part]
        else:
            members.append(c)
            amplitudes.append(w[part])
    return dphi, members, amplitudes
