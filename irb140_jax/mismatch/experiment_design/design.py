"""The motion that best decides what a diagnosis left open: pieces out of a random pool, exchanged and refined."""

import dataclasses
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from threadpoolctl import threadpool_limits

from irb140_jax.errors import InputError
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.experiment_design.questions import Questions
from irb140_jax.mismatch.experiment_design.undecided import Undecided
from irb140_jax.recordings.excite import Excitation, within
from irb140_jax.recordings.segments import KINDS, Segment, joined, segment_motion
from irb140_jax.robot import Robot

PIECE = 8.0  # [s] a piece of motion lasts: a ladder of four speeds, or some strides of everything else
POOL = 36  # pieces drawn at first
ROUNDS, NEAR = 2, 8  # rounds of refinement, and pieces drawn near the chosen ones in each
MOST_COMPARISONS = 10_000  # some milliseconds each; counted, not timed, so that the same seed gives the same motion
LONGEST = 600.0  # [s] that a motion may last; more pieces than are drawn would repeat themselves
LEAST_RATE, MOST_ROWS = 20.0, 10**6  # [1/s]; a million rows are a table of hundreds of megabytes


@dataclasses.dataclass(frozen=True)
class Proposal:
    """A motion to play and record.

    Attributes:
        motion: At the rate asked for; it starts and ends at rest.
        pieces: What it is made of.
        odds_now, odds: Log odds of each pair in doubt, by the recordings and expected with this motion beside them.
        exact: Log odds of each pair with this motion, if both laws held exactly.
        seen_now, seen: Standard deviations by which each effect that was hidden would stand out, likewise.
        tried, too_strong: Pieces of motion drawn, and how many of them need more torque than the motors give.
    """

    motion: Excitation
    pieces: tuple[Segment, ...]
    odds_now: tuple[float, ...]
    odds: tuple[float, ...]
    exact: tuple[float, ...]
    seen_now: tuple[float, ...]
    seen: tuple[float, ...]
    tried: int
    too_strong: int


def propose(
    robot: Robot, open_: Undecided, *, seed: int, duration: float = 40.0, rate: float = 250.0,
    progress: Callable[[str], None] = lambda _: None,
) -> Proposal:  # fmt: skip
    """Design the motion.

    Where nothing is open, it is one along which every effect would show.

    Args:
        robot: The nominal model.
        open_: What is open.
        seed: Of the search; the same seed gives the same motion.
        duration: About how long it may last [s].
        rate: Samples per second of the motion [1/s].
        progress: Told what is being done.

    Raises:
        InputError: Times that make no motion, or limits that allow none.
    """
    # Written so that what is no number is refused, too.
    if not (PIECE + 1.0 <= duration <= LONGEST and LEAST_RATE <= rate and duration * rate <= MOST_ROWS):
        raise InputError(
            f"excite: {duration:g} s at {rate:g} rows per second; allowed are {PIECE + 1:g} to {LONGEST:g} s, "
            f"{LEAST_RATE:g} rows per second or more, and {MOST_ROWS} rows in all"
        )
    count = round(duration / (PIECE + 1.0))
    # Many small solves: a second BLAS thread costs more in waking up than it does.
    with threadpool_limits(1, "blas"):
        return _proposed(robot, open_, seed, count, rate, progress)


def _proposed(
    robot: Robot, open_: Undecided, seed: int, count: int, rate: float, progress: Callable[[str], None]
) -> Proposal:
    bounded = within(robot, open_.scales.low, open_.scales.high, settings.SPEED_UP * open_.scales.speed)
    search = _Search(bounded, Questions(robot, open_), np.random.default_rng([seed, 60]))
    for k in range(4):
        progress(f"drawing pieces of motion ({k + 1} of 4)")
        search.draw(range(k * POOL // 4, (k + 1) * POOL // 4))
    if not search.segments:
        raise InputError("excite: every motion within the joint limits needs more torque than the model's motors give")
    progress("choosing the pieces that tell most")
    chosen = search.exchanged(search.grown(count))
    for turn in range(ROUNDS):
        progress(f"refining the motion ({turn + 1} of {ROUNDS})")
        search.draw_near(chosen, NEAR)
        chosen = search.exchanged(chosen)
    pieces = tuple(search.segments[k] for k in chosen)
    motion = joined(bounded, [segment_motion(bounded, s, PIECE, rate) for s in pieces], rate)
    questions, nothing = search.questions, 0.0 * search.grams[0]
    coarse = joined(bounded, [segment_motion(bounded, s, PIECE, open_.band.rate) for s in pieces], open_.band.rate)
    whole = questions.gram(coarse)
    assert whole is not None, "no limit was asked for"
    odds = lambda G: tuple(max(questions.margin(G, p), 0.0) for p in open_.pairs)  # noqa: E731
    exact = tuple(questions.margin(whole, p, exact=True) for p in open_.pairs)
    seen = lambda G: tuple(map(float, questions.visible(G, open_.hidden)))  # noqa: E731
    return Proposal(
        motion, pieces, odds(nothing), odds(whole), exact, seen(nothing), seen(whole), search.tried, search.too_strong
    )


class _Search:
    """A pool of pieces with their Gram matrices; choosing among them touches no motion again."""

    def __init__(self, robot: Robot, questions: Questions, rng: np.random.Generator):
        self.robot, self.questions, self._rng = robot, questions, rng
        self.segments: list[Segment] = []
        self.grams: list[np.ndarray] = []
        self.tried = self.too_strong = 0
        self._spent = 0  # comparisons of two explanations
        o = questions.open
        in_doubt, hidden = (p.joints for p in o.pairs), (o.columns[c].joints for c in o.hidden)
        self._joints = sorted({j for joints in (*in_doubt, *hidden) for j in joints})

    def draw(self, numbers: Iterable[int]) -> None:
        """Add random pieces of every kind in turn, of all joints or one of those in question."""
        for k in numbers:
            joint = int(self._rng.choice(self._joints)) if self._joints and self._rng.random() < 0.5 else None
            kind = KINDS[k % len(KINDS)]
            speed = 0.08 if kind == "slow" else float(self._rng.uniform(0.3, 1.0))
            frequency = float(self._rng.uniform(0.1, 0.5) if kind != "micro" else self._rng.uniform(0.3, 2.0))
            self._add(Segment(kind, joint, speed, frequency, int(self._rng.integers(2**31))))

    def draw_near(self, chosen: Sequence[int], count: int) -> None:
        """Add pieces like the chosen ones: faster or slower, of another frequency, or drawn anew."""
        for _ in range(count):
            s = self.segments[int(self._rng.choice(chosen))]
            factor, other = np.exp(self._rng.normal(scale=0.3, size=2))
            seed = s.seed if self._rng.random() < 0.5 else int(self._rng.integers(2**31))
            speed = float(np.clip(s.speed * factor, 0.02, 1.0))
            self._add(dataclasses.replace(s, speed=speed, frequency=float(s.frequency * other), seed=seed))

    def _add(self, segment: Segment) -> None:
        motion = segment_motion(self.robot, segment, PIECE, self.questions.open.band.rate)
        gram = self.questions.gram(motion, settings.EFFORT_SHARE)
        self.tried += 1
        self.too_strong += gram is None
        if gram is not None:
            self.segments.append(segment)
            self.grams.append(gram)

    def worth(self, chosen: Sequence[int]) -> float:
        """What a motion of these pieces would decide; each doubling of odds counts less than the one before."""
        self._spent += max(len(self.questions.open.pairs), 1)
        o, G = self.questions.open, sum((self.grams[k] for k in chosen), 0.0 * self.grams[0])
        if not o.pairs and not o.hidden:
            z = self.questions.visible(G, range(len(o.columns)))
            return float(np.mean(np.log(z + 0.1))) if len(z) else 0.0
        decided = sum(np.arcsinh(self.questions.margin(G, p)) for p in o.pairs)
        shown = np.sum(np.minimum(self.questions.visible(G, o.hidden) / settings.VISIBLE, 1.0))
        return float(decided + settings.HIDDEN_WEIGHT * shown)

    def grown(self, count: int) -> list[int]:
        """The best piece, then the best beside it, and so on."""
        chosen: list[int] = []
        for _ in range(min(count, len(self.grams))):
            rest = [k for k in range(len(self.grams)) if k not in chosen]
            rest = rest if self._spent < MOST_COMPARISONS else rest[:1]
            chosen.append(max(rest, key=lambda k: self.worth([*chosen, k])))
        return chosen

    def exchanged(self, chosen: list[int]) -> list[int]:
        """Each piece in turn for the best other one, where that is better."""
        best = self.worth(chosen)
        for i in range(len(chosen)):
            for k in range(len(self.grams)):
                trial = [*chosen[:i], k, *chosen[i + 1 :]]
                if self._spent < MOST_COMPARISONS and k not in chosen and (value := self.worth(trial)) > best:
                    chosen, best = trial, value
        return chosen
