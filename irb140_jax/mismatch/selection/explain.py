"""The loop at the heart of a diagnosis: columns, noise, search, and again with finer shapes and the corrected load."""

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy import special

from irb140_jax.effects import Effect, Scales
from irb140_jax.effects.rotor_inertia import EFFECT as ROTOR
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.along import Loads, Prepared, all_prepared, scales_of, seen_by
from irb140_jax.mismatch.columns.candidates import Candidate, Library, library, of_kinds
from irb140_jax.mismatch.columns.torques import Named, Torques, better_known, library_of, torques_of
from irb140_jax.mismatch.inertials.prior import inertial_prior_factor
from irb140_jax.mismatch.regression.assemble import Data, assembled, judged, prior_scale, with_loose_inertials
from irb140_jax.mismatch.regression.joint_grams import grams_by_block, joint_grams
from irb140_jax.mismatch.regression.noise import Noise
from irb140_jax.mismatch.regression.nuisances import COMMON, Nuisances, nuisances
from irb140_jax.mismatch.regression.proposals import with_proposals
from irb140_jax.mismatch.regression.rows import (
    Stretch,
    bare_stretch,
    candidate_rows,
    with_candidates,
    with_library,
)
from irb140_jax.mismatch.regression.silent import silent_rows
from irb140_jax.mismatch.regression.sums import summed
from irb140_jax.mismatch.regression.tangent import Point, point
from irb140_jax.mismatch.selection.averages import Site, site_of
from irb140_jax.mismatch.selection.evidence import Hyper, Space
from irb140_jax.mismatch.selection.explanation import Explanation, fitted, usual_in_its_place
from irb140_jax.mismatch.selection.falling_friction import with_falling_friction
from irb140_jax.mismatch.selection.finer_shapes import is_coarse, nearest_shape, refined
from irb140_jax.mismatch.selection.hyperparameters import settled
from irb140_jax.mismatch.selection.late_channels import with_late_channels
from irb140_jax.mismatch.selection.screening import gains
from irb140_jax.mismatch.selection.selected import flexible_noise, named, noise_left, selected
from irb140_jax.mismatch.selection.space import space_of
from irb140_jax.mismatch.selection.torque_scale import beside_scale, scale_of
from irb140_jax.recordings.condition import Conditioned
from irb140_jax.recordings.drive import Drive, Times
from irb140_jax.recordings.low_pass import Band
from irb140_jax.recordings.payload import distinct
from irb140_jax.robot import Robot

MOST_ROUNDS = 8  # shapes may become finer and finer
OFTEN = 2  # times that an effect is dropped as soon as its shape is refined, after which it is not searched again


def explain(
    robot: Robot,
    recordings: Sequence[Conditioned],
    band: Band,
    effects: Sequence[Effect],
    uncertainty: float,
    sensors: np.ndarray,
    progress: Callable[[str], None] = lambda _: None,
    unproved: Callable[[Explanation], Sequence[Site]] = lambda _: (),
    later: Callable[[Times], Sequence[Conditioned]] | None = None,
) -> Explanation:
    """Search for what the model leaves out.

    Args:
        robot: The nominal model.
        recordings: Conditioned, at least one.
        band: Of the comparison.
        effects: The library.
        uncertainty: Relative standard deviation of the inertials.
        sensors: Standard deviation of what the sensors leave in the rows, shape (n,) [N m or N].
        progress: Told what is being done.
        unproved: Effects of an explanation that may not be named; the search goes on without them.
        later: The recordings with torque of drives that act at other times: of servos alone.
    """
    progress("rigid body along the recordings")
    along, factor = all_prepared(robot, recordings), inertial_prior_factor(robot, 1.0)
    scales = scales_of(along)
    first = with_proposals(library(robot, effects, scales), along, band, factor, uncertainty, scales)
    drive = recordings[0].servo and recordings[0].servo.drive
    given = _Given(first, scales, band, factor, uncertainty, sensors, progress, later, drive)
    return _settled(given, _Start(1, first, along, [None] * len(along)), unproved)


def _settled(
    given: "_Given", start: "_Start", unproved: Callable[[Explanation], Sequence[Site]], sites: Sequence[Site] = ()
) -> Explanation:
    """What the rounds come to from where they start, without some effects."""
    start = start.without(sites)
    while True:
        ex, last = _explained(given, start)
        if not last:
            start = _next(given, start, ex)
        elif barred := unproved(ex):
            start = start.without(barred)
        elif given.drive is None:
            return ex
        else:
            return dataclasses.replace(ex, without_sites=partial(_settled, given, start, unproved))
        del ex  # hundreds of megabytes, before the next


@dataclasses.dataclass(frozen=True)
class _Given:
    """What is the same in all rounds: arguments of `explain`, and what follows from them.

    Attributes:
        first: The library before its shapes were refined.
        scales: Sizes of the recordings.
        band, uncertainty, sensors, progress, later: See `explain`.
        factor: Square root of the inertial prior at relative standard deviation 1, shape (10 n, 10 n).
        drive: Of the servos as it was given, where there are any.
    """

    first: Library
    scales: Scales
    band: Band
    factor: np.ndarray
    uncertainty: float
    sensors: np.ndarray
    progress: Callable[[str], None]
    later: Callable[[Times], Sequence[Conditioned]] | None
    drive: Drive | None


@dataclasses.dataclass(frozen=True)
class _Start:
    """What a round starts from: what the round before found.

    Attributes:
        round: Its number, from 1.
        whole: Whether it searches the whole library, not only what is named so far.
        lib: The library with shapes as fine as they are so far.
        along: The recordings as effects see them.
        loads: Of the last explanation along each; of the nominal model where None.
        at: Where the regression is linearised; at the nominal model where None.
        chosen: The set with which the search starts: candidates of `lib`.
        noise: What the last explanation leaves.
        dropped: Effects that were named and then dropped when their shape was refined, each as often as that happened.
        unproved: Effects that may not be named.
        times: When drives act.
    """

    round: int
    lib: Library
    along: list[Prepared]
    loads: Sequence[Loads | None]
    whole: bool = True
    at: Point | None = None
    chosen: tuple[int, ...] = ()
    noise: Noise | None = None
    dropped: tuple[Site, ...] = ()
    unproved: tuple[Site, ...] = ()
    times: Times = Times()

    def without(self, sites: Sequence[Site]) -> "_Start":
        """The same round, in which some effects are not named."""
        every = with_loose_inertials(self.lib)
        left = tuple(i for i in self.chosen if site_of(every[i]) not in sites)
        return dataclasses.replace(self, chosen=left, unproved=(*self.unproved, *sites))

    def searched(self) -> tuple[Library, tuple[int, ...]]:
        """The library that this round searches, and the set with which it starts as candidates of that."""
        if self.whole:
            return self.lib, self.chosen
        every = with_loose_inertials(self.lib)
        kinds = {every[i].slug for i in self.chosen} | {c.slug for c in every if c.effect.prior.ordinary}
        lib = of_kinds(self.lib, kinds)
        return lib, tuple(nearest_shape(every[i], every[i].shape, lib) for i in self.chosen)


@dataclasses.dataclass(frozen=True)
class _Regression:
    """What a round has made of the recordings before it searches.

    Attributes:
        lib: The library that it searches.
        chosen: The set with which the search starts.
        each: Every recording with the loads that columns along it see; None stands for those of the nominal model.
        data: Rows, with no column of a candidate, and candidates.
        extra: Nuisance columns, one per recording.
        noise: What whitens the rows.
        space: What may be in a set.
        allowed: The same without what may not be named.
    """

    lib: Library
    chosen: tuple[int, ...]
    each: list[tuple[Prepared, Loads | None]]
    data: Data
    extra: list[Nuisances]
    noise: Noise
    space: Space
    allowed: Space


def _regression(given: _Given, start: _Start) -> _Regression | None:
    """Columns along the recordings and sums over all rows; None where they have no bounds."""
    at, band, turn = start.at, given.band, start.round
    lib, chosen = start.searched()
    given.progress(f"columns of {len(lib.candidates)} candidate explanations along the recordings (round {turn})")
    # Friction is stated in the torque that is logged: in the column of a wrong torque constant, too, it would count
    # twice, and in the place of friction that column would stand for what the round before found of it.
    each = [(r, x and x._replace(total=x.load)) for r, x in zip(start.along, start.loads, strict=True)]
    rows = judged([bare_stretch(lib, r, i, band, given.factor, load, at) for i, (r, load) in enumerate(each)])
    known = [(r.nominal, r.nominal) if x is None else (x.load, x.total)
             for (r, _), x in zip(each, start.loads, strict=True)]  # fmt: skip
    extra = nuisances(lib.robot, start.along, known, band, given.scales, at)
    noise = start.noise or _first_noise(lib, rows, start.along, band, given.uncertainty, extra)
    columns = [partial(candidate_rows, lib, r, i, band, load, at) for i, (r, load) in enumerate(each)]
    sums = summed(lib, rows, columns, extra, noise)
    if at and not sums.finite:
        return None
    scale = prior_scale(lib, rows, given.uncertainty, sums.power)
    data = Data(rows, scale, with_loose_inertials(lib), len(given.factor))
    given.progress(f"searching sets of explanations (round {turn})")
    joints = joint_grams(sums, lib, data, extra, noise, given.sensors)
    del sums  # hundreds of megabytes, before the search
    first = of_kinds(given.first, lib.effects)
    delays = 0 if given.drive else lib.robot.n
    space = space_of(joints, data, extra[0].common.shape[-1], lib, first, delays=delays, settled=turn > 1)
    silent = silent_rows(data.candidates, [r.recording for r in start.along], joints, noise)
    space = dataclasses.replace(space, centre=_centre(space, given.drive, start), silent=silent)
    sites = [site_of(c) for c in data.candidates]
    barred = [start.dropped.count(site) >= OFTEN or site in start.unproved for site in sites]
    allowed = dataclasses.replace(space, log_prior=np.where(barred, -np.inf, space.log_prior))
    return _Regression(lib, chosen, each, data, extra, noise, space, allowed)


def _explained(given: _Given, start: _Start) -> tuple[Explanation, bool]:
    """One round, and whether it is the last: the whole library was searched, and named is only what is settled.

    A round makes columns, sums over all rows, searches, and makes the columns of what was found; the last one of what
    is named.
    """
    at, from_nominal_model = start.at, partial(_explained, given, dataclasses.replace(start, at=None))
    regression = _regression(given, start)
    if regression is None:
        # An explanation without bounds is nothing to start from.
        return from_nominal_model()
    data, space = regression.data, regression.space
    search = partial(selected, regression.allowed, regression.chosen, every_move=start.whole)
    best, hyper, visited = search()
    falling = partial(with_falling_friction, regression.allowed, data, regression.extra[0], given.scales)
    shifting = partial(with_late_channels, regression.allowed, held=at.rests_on if at else frozenset())
    found, found_hyper, late = shifting(best, hyper)
    # Slopes at an explanation say nothing of one without what it rests on: under leaning gravity that nothing is named
    # for, inertials can stand for the tilt.
    nominal: Explanation | None = None
    if at and not at.rests_on <= _sites(data, found):
        free, last = from_nominal_model()
        if not at.rests_on <= _sites(free.data, free.chosen):
            return free, last
        best, hyper, visited = search(held=at.rests_on)
        found, found_hyper, late = shifting(best, hyper)
        nominal = free
    found, found_hyper, falls = falling(found, found_hyper)
    settles = start.round == MOST_ROUNDS or _sites(data, found) <= _sites(data, regression.chosen)
    last = start.whole and start.round > 1 and settles
    sets = averaged = {s: value for s, (value, _) in visited.items()}
    scale, scaled = scale_of(space), False
    if last:
        averaged = beside_scale(space, visited) if given.drive is None else sets
        of_all = (*space.candidates, scale)
        sites = lambda s: {site_of(of_all[i]) for i in s}  # noqa: E731
        every, searched = named(of_all, averaged), at.rests_on - set(late) if at else frozenset()
        if at and nominal is None and (at.timing or not searched <= sites(every)):
            free, other = from_nominal_model()
            if not at.rests_on <= _sites(free.data, free.chosen):
                return free, other
            nominal = free
            averaged = {s: x for s, x in averaged.items() if searched <= sites(s)}
            every = named(of_all, averaged)
        stated = tuple(i for i in every if i < len(space.candidates))
        scaled = stated != every
        found, found_hyper, late = shifting(stated, hyper if stated == best else settled(space, stated, hyper)[1])
        found, found_hyper, falls = falling(found, found_hyper)
        late = {site: nominal.late.get(site, why) if nominal else why for site, why in late.items()}
    for joint in space.joints:
        joint.forget()
    left_open = _rotors_open(space, data, found, found_hyper) if last and given.drive is not None else ()
    members = [data.candidates[i] for i in (*found, *left_open, *_in_place(data, found))]
    held = [with_candidates(s, members, r, given.band, load, at)
            for s, (r, load) in zip(data.stretches, regression.each, strict=True)]  # fmt: skip
    ex = Explanation(
        lib=regression.lib, scales=given.scales, data=dataclasses.replace(data, stretches=held),
        extra=regression.extra, noise=regression.noise, space=space, by_block=space, chosen=found, hyper=found_hyper,
        sets=sets, averaged=averaged, scale=scale, factor=given.factor, falls=falls, scaled=scaled,
        unproved=start.unproved, times=start.times, payloads=tuple(r.recording.payload for r in start.along),
        open_rotors=left_open, rests_on=at.rests_on if at else frozenset(), late=late,
        nominal=_without_rows(nominal, given.sensors) if last and nominal else None,
    )  # fmt: skip
    return (_by_block(ex, given.sensors) if last else ex), last


def _rotors_open(space: Space, data: Data, found: tuple[int, ...], hyper: Hyper) -> tuple[int, ...]:
    """Rotors that are not named, of which the torque leaves open whether they are there, among the candidates."""
    named = {data.candidates[i].joints for i in found if data.candidates[i].effect is ROTOR}
    rotors = [i for i, c in enumerate(data.candidates) if c.effect is ROTOR and c.joints not in named]
    probable = special.expit(gains(space, found, hyper, np.array(rotors, dtype=int))) > settings.LISTED_PROBABILITY
    return tuple(i for i, possible in zip(rotors, probable, strict=True) if possible)


def _in_place(data: Data, chosen: Sequence[int]) -> list[int]:
    """Ordinary friction that may stand in the place of what a set has."""
    each = [usual_in_its_place(data.candidates, chosen, i) for i in chosen]
    return sorted({i for usual in each for i in usual})


def _sites(data: Data, chosen: Sequence[int]) -> set[Site]:
    return {site_of(data.candidates[i]) for i in chosen}


def _next(given: _Given, start: _Start, ex: Explanation) -> _Start:
    """What the next round starts from.

    What was named is settled before the whole library is searched again: while shapes are coarse, or the explanation is
    off its linearisation, rounds look at nothing else.
    """
    robot, found = ex.lib.robot, fitted(ex.data, ex.posterior(), ex.chosen, given.factor)
    physics = _physics(found)
    better = better_known(robot, np.asarray(robot.phi) + found[0].reshape(-1, 10), physics)
    times, known = start.times, start.along
    if given.later is not None and given.drive is not None:
        phases, _ = ex.phases(given.drive)
        times = Times(ex.command_delay(given.drive)[0], ex.torque_lag(given.drive), tuple(phases.tolist()))
        known = [dataclasses.replace(a, recording=r) for a, r in zip(known, given.later(times), strict=True)]
    if any(ex.payloads):
        moved = zip(known, ex.payloads_found(), strict=True)
        known = all_prepared(robot, [dataclasses.replace(a.recording, payload=p) for a, p in moved])
    along = [seen_by(better, r) for r in known]
    torques = [torques_of(robot, physics, r, found[0], found[0], i) for i, r in enumerate(along)]
    noise = noise_left(ex.data, ex.extra, ex.space, ex.chosen, ex.hyper)
    coarse = is_coarse(ex, noise)
    # A coarse grid has no law that is right: with a discrepancy all its points are equally good.
    exact = _without_discrepancy(ex) if start.round == 1 or coarse else ex
    lib, chosen = refined(exact, start.lib, {(p.effect.slug, p.joints): p.shape for p in physics})
    at, loads, turn = point(robot, found[0], physics), [t.loads for t in torques], start.round + 1
    whole = turn == MOST_ROUNDS or not (start.whole or coarse or _off(ex, torques, given.band))
    every = with_loose_inertials(start.lib)
    shaped = {site_of(every[i]) for i in start.chosen if not start.whole and every[i].effect.shapes.finer}
    lost = shaped - _sites(ex.data, ex.chosen)
    dropped = (*start.dropped, *lost)
    return _Start(turn, lib, along, loads, whole, at, chosen, noise, dropped, start.unproved, times)


def _centre(space: Space, drive: Drive | None, start: _Start) -> np.ndarray:
    """Prior means of the common nuisances, see `Space`: rows are made with what was found so far."""
    found, widths = np.zeros((2, space.offset - space.inertials))
    moved = np.ravel([p.off for p in distinct([a.recording.payload for a in start.along])])
    at = slice(COMMON, COMMON + len(moved))
    found[at], widths[at] = moved, settings.PAYLOAD_PLACED
    if drive is not None and start.round > 1:
        times, last = start.times, len(start.times.phases) + 1
        found[1], widths[1] = times.lag, drive.time_width
        found[-last:] = *times.phases, times.delay
        widths[-last:] = *(drive.phase_width for _ in times.phases), drive.common_delay_width
    return -np.divide(found, widths, out=np.zeros(len(found)), where=widths > 0.0)


def _first_noise(
    lib: Library, rows: Sequence[Stretch], along: Sequence[Prepared], band: Band, uncertainty: float,
    extra: Sequence[Nuisances],
) -> Noise:  # fmt: skip
    """Noise before anything is explained: what ordinary friction and a free discrepancy leave."""
    usual = library_of(lib.robot, [c for c in lib.candidates if c.effect.prior.ordinary])
    held = [with_library(s, usual, r, band) for s, r in zip(rows, along, strict=True)]
    return flexible_noise(assembled(usual, held, uncertainty), extra)


def _by_block(ex: Explanation, sensors: np.ndarray) -> Explanation:
    """The explanation with Gram matrices by block of the data, to leave some out.

    Of what it names or leaves open, and of what may stand in the place of that.
    """
    columns = ex.columns((*ex.chosen, *ex.open_rotors, *_in_place(ex.data, ex.chosen)))
    joints = grams_by_block(ex.data, ex.extra, ex.noise, sensors, columns, settings.BLOCKS)
    return dataclasses.replace(ex, by_block=dataclasses.replace(ex.space, joints=joints))


def _without_rows(ex: Explanation, sensors: np.ndarray) -> Explanation:
    """What is left of an explanation that others are judged by: its rows and all Gram matrices would be as many again.
    """
    ex = ex if ex.by_block is not ex.space else _by_block(ex, sensors)
    return dataclasses.replace(ex, space=ex.by_block, data=dataclasses.replace(ex.data, stretches=[]), extra=[])


def _physics(found: tuple[np.ndarray, list[Candidate], list[np.ndarray]]) -> list[Named]:
    """The effects of an explanation (see `fitted`) with their numbers, and the shapes that follow from those."""
    _, members, amplitudes = found
    both = [(c, w, c.effect.shapes.follows) for c, w in zip(members, amplitudes, strict=True)]
    return [Named(c.effect, c.joints, c.variant, w, f(w, c.shape) if f else c.shape) for c, w, f in both]


def _off(ex: Explanation, torques: Sequence[Torques], band: Band) -> bool:
    """Whether an explanation is another than its linearisation by more than noise at some joint: it has to be repeated.

    Args:
        ex: The explanation, linear in what is unknown.
        torques: What its numbers give along the recordings, products of unknowns included.
        band: Of the comparison.
    """
    use = np.concatenate([s.use for s in ex.data.stretches])
    beyond = np.concatenate(ex.beyond_columns(ex.posterior(), 0.0, [t.corrected for t in torques], band))
    square = np.sum(np.where(use, beyond, 0.0) ** 2, axis=0) / np.maximum(use.sum(axis=0), 1)
    return bool(np.any(np.sqrt(square) > ex.level))


def _without_discrepancy(ex: Explanation) -> Explanation:
    """The explanation as if its laws were exact."""
    return dataclasses.replace(ex, hyper=tuple((*(0 for _ in s[:-1]), s[-1]) for s in ex.hyper))
