"""What a diagnosis leaves open, kept in a form in which the motion that would decide it can be designed."""

import dataclasses
import json
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from irb140_jax.effects import Effect, Scales
from irb140_jax.effects.catalogue import known
from irb140_jax.mismatch import settings
from irb140_jax.mismatch.columns.candidates import Candidate
from irb140_jax.mismatch.regression.gaussian import eliminated
from irb140_jax.mismatch.regression.gram import LEVELS
from irb140_jax.mismatch.result import Finding
from irb140_jax.mismatch.selection.explanation import Explanation
from irb140_jax.mismatch.validation.testable import Reference, Seen
from irb140_jax.recordings.low_pass import Band

FILE, SCHEMA = "undecided.npz", 2
Sets = tuple[tuple[int, ...], ...]


@dataclasses.dataclass(frozen=True)
class Column:
    """An effect at a site with a shape, of the few that matter to what is open.

    Attributes:
        effect: The effect.
        joints: Indices of its joints.
        shape: Shape parameters.
        variant: Columns it uses.
    """

    effect: Effect
    joints: tuple[int, ...]
    shape: tuple[float, ...]
    variant: tuple[int, ...]

    @property
    def slug(self) -> str:
        """The effect's name in the vocabulary."""
        return self.effect.slug


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two explanations of the same finding that the data can't tell apart.

    Attributes:
        joints: Of the finding.
        named, rival: Slugs.
        probability: Of the rival.
        rest: Effects that both explanations have beside, as indices of columns.
        named_sets, rival_sets: The sets of effects of either, one for every shape that may be meant.
    """

    joints: tuple[int, ...]
    named: str
    rival: str
    probability: float
    rest: tuple[int, ...]
    named_sets: Sets
    rival_sets: Sets


@dataclasses.dataclass(frozen=True)
class Undecided:
    """What the recordings say of all explanations in question, without the recordings.

    Attributes:
        columns: The effects in question.
        chosen: Those of the diagnosis.
        loose: Links whose inertials are wrong beyond their stated uncertainty.
        pairs: What can't be told apart.
        hidden: Effects that the motion could not have shown.
        gram: Whitened Gram matrix over [inertials | loose links | amplitudes | y] in prior units.
        scale: Prior standard deviation of every amplitude.
        reference: Strength of every amplitude at which an effect should be seen, in prior units.
        uncertainty: Relative standard deviation of the inertials.
        ar, level: Noise of each joint: whitening filter, shape (n, lags + 1), and innovation [N m or N], shape (n,).
        band: Of the comparison.
        scales: Sizes of the recordings.
    """

    columns: tuple[Column, ...]
    chosen: tuple[int, ...]
    loose: tuple[int, ...]
    pairs: tuple[Pair, ...]
    hidden: tuple[int, ...]
    gram: np.ndarray
    scale: np.ndarray
    reference: np.ndarray
    uncertainty: float
    ar: np.ndarray
    level: np.ndarray
    band: Band
    scales: Scales

    @property
    def effects(self) -> dict[str, Effect]:
        """The effects in question by slug."""
        return {c.slug: c.effect for c in self.columns}


def undecided(
    ex: Explanation, findings: Sequence[Finding], seen: Seen, matters: Reference, band: Band, uncertainty: float
) -> Undecided:
    """What is open after a diagnosis.

    Args:
        ex: The explanation.
        findings: Of the diagnosis.
        seen: How well every other effect could be seen, from `visibility`.
        matters: Strengths at which that is judged, from `testable.reference`.
        band: Of the comparison.
        uncertainty: Relative standard deviation of the inertials.
    """
    names = ex.lib.robot.joint_names
    table = _Table(ex)
    physics = tuple(c for c in ex.chosen if not ex.data.candidates[c].is_inertials)
    loose = tuple(c for c in ex.chosen if ex.data.candidates[c].is_inertials)
    pairs = []
    for f in findings:
        site = tuple(names.index(j) for j in f.joints)
        at = next(c for c in physics if _key(ex.data.candidates[c]) == (f.effect, site))
        for a in f.alternatives:
            rival = _rival(ex, at, a.effect)
            if rival:
                pairs.append((site, f.effect, a.effect, a.probability, at, rival))
    beside = lambda at: table.of(c for c in physics if c != at)  # noqa: E731
    made = tuple(
        Pair(site, named, slug, p, beside(at), table.sets(ex, (at,)), table.sets(ex, rival))
        for site, named, slug, p, at, rival in pairs
    )
    chosen = table.of(physics)
    hidden = table.of(i for z, i in seen.values() if z < settings.VISIBLE)
    table.of(i for _, i in seen.values())
    links = tuple(j for c in loose for j in ex.data.candidates[c].joints)
    gram, scale, strength = table.gram(ex, loose, matters)
    # A joint that never moved told nothing of its noise.
    still = np.array([g.rows.sum() == 0 for g in ex.space.joints])
    times = [LEVELS[s[-1]] for s in ex.hyper]
    level = np.where(still, settings.UNKNOWN_NOISE * matters.torque, np.median(ex.noise.level, axis=0) * times)
    return Undecided(
        tuple(table.columns), chosen, links, made, hidden, gram, scale, strength, uncertainty, ex.noise.ar, level,
        band, ex.scales,
    )  # fmt: skip


class _Table:
    """Candidates of the whole library, numbered anew as they are asked for."""

    def __init__(self, ex: Explanation):
        self._candidates, self._numbers = ex.data.candidates, {}

    @property
    def columns(self) -> list[Column]:
        """The effects, in their new order."""
        picked = (self._candidates[i] for i in self._numbers)
        return [Column(c.effect, c.joints, tuple(map(float, c.shape)), c.variant) for c in picked]

    def of(self, indices) -> tuple[int, ...]:
        """New numbers of some candidates."""
        return tuple(self._numbers.setdefault(int(i), len(self._numbers)) for i in indices)

    def sets(self, ex: Explanation, members: tuple[int, ...]) -> Sets:
        """The set with every shape that its first member may have."""
        first, *others = members
        c = ex.data.candidates[first]
        alike = [i for i, o in enumerate(ex.data.candidates) if _key(o) == _key(c) and o.variant == c.variant]
        return tuple(self.of((i, *others)) for i in alike)

    def gram(
        self, ex: Explanation, loose: tuple[int, ...], matters: Reference
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gram matrix of the recordings over the new columns, their prior scales, and reference strengths in these."""
        nuisances = ex.data.nuisances
        parts = [ex.data.candidates[i].columns for i in self._numbers]
        amplitudes = np.concatenate(parts) if parts else np.zeros(0, dtype=int)
        space = ex.space
        index = space.with_y(np.concatenate(
            [np.arange(space.offset), *(space.columns[c] for c in loose), space.offset + amplitudes]
        ))  # fmt: skip
        instrument = np.arange(nuisances, space.offset)
        H, _ = eliminated(space.gram(ex.hyper, index, index), instrument)
        H = np.delete(np.delete(H, instrument, axis=0), instrument, axis=1)
        # What these recordings don't excite has no prior scale of theirs: that of lively motion stands in.
        typical = np.concatenate([np.zeros(0), *(
            np.full(len(self._candidates[i].columns), self._candidates[i].effect.prior.typical) for i in self._numbers
        )])  # fmt: skip
        likely = typical / settings.REFERENCE_SHARE * np.abs(matters.amplitudes[amplitudes])
        scale = ex.data.scale[nuisances + amplitudes]
        scale = np.where(matters.in_prior_units(amplitudes, scale) == 0.0, likely, scale)
        return H, scale, matters.in_prior_units(amplitudes, scale)


def _key(c: Candidate) -> tuple[str, tuple[int, ...]]:
    return c.slug, c.joints


def _rival(ex: Explanation, at: int, slug: str) -> tuple[int, ...] | None:
    """The likeliest set with another effect in a finding's place, a special case of the finding beside it or not."""
    c = ex.data.candidates[at]
    rest = tuple(x for x in ex.chosen if x != at)
    wider = ex.lib.effects[slug].law.contains
    special = [
        i for i, o in enumerate(ex.data.candidates)
        if o.slug in c.effect.law.contains and o.joints == c.joints and o.slug not in wider
    ]  # fmt: skip
    best, found = -np.inf, None
    for beside in ((), *((s,) for s in special)):
        which = [i for i, o in enumerate(ex.data.candidates)
                 if o.slug == slug and set(o.joints) & set(c.joints) and i not in rest]  # fmt: skip
        base = float(ex.gains(rest, beside)[0]) if beside else 0.0
        for i, gain in zip(which, ex.gains((*rest, *beside), which), strict=True):
            if base + gain > best:
                best, found = base + float(gain), (int(i), *beside)
    return found


def save_undecided(open_: Undecided, folder: pathlib.Path) -> None:
    """Write into an existing folder."""
    meta = {
        "schema": SCHEMA, "columns": [_to_json(c) for c in open_.columns], "chosen": open_.chosen,
        "loose": open_.loose, "pairs": [dataclasses.asdict(p) for p in open_.pairs], "hidden": open_.hidden,
        "uncertainty": open_.uncertainty, "band": dataclasses.asdict(open_.band), "duration": open_.scales.duration,
    }  # fmt: skip
    sizes = {k: v for k, v in open_.scales._asdict().items() if k != "duration"}
    np.savez_compressed(
        folder / FILE, meta=np.array(json.dumps(meta)), gram=open_.gram, scale=open_.scale, ar=open_.ar,
        reference=open_.reference, level=open_.level, **sizes,
    )  # fmt: skip


def _to_json(c: Column) -> dict[str, Any]:
    return {"slug": c.slug, "joints": c.joints, "shape": c.shape, "variant": c.variant}


def from_arrays(meta: dict[str, Any], arrays: dict[str, np.ndarray], effects: Sequence[Effect] = ()) -> Undecided:
    """The inverse of `save_undecided`, of what its file holds; `effects` are those that are not in the catalogue.

    Raises:
        InputError: It holds an effect that is neither among these nor in the catalogue.
    """
    sizes = {k: arrays[k] for k in Scales._fields if k != "duration"}
    return Undecided(
        columns=tuple(
            Column(known(c["slug"], effects), *(_tuples(c[k]) for k in ("joints", "shape", "variant")))
            for c in meta["columns"]
        ),
        pairs=tuple(Pair(**{k: _tuples(v) for k, v in p.items()}) for p in meta["pairs"]),
        chosen=_tuples(meta["chosen"]), loose=_tuples(meta["loose"]), hidden=_tuples(meta["hidden"]),
        gram=arrays["gram"], scale=arrays["scale"], reference=arrays["reference"], uncertainty=meta["uncertainty"],
        ar=arrays["ar"], level=arrays["level"], band=Band(**meta["band"]),
        scales=Scales(duration=meta["duration"], **sizes),
    )  # fmt: skip


def _tuples(x: Any) -> Any:
    """Lists of JSON as the tuples that they were."""
    return tuple(map(_tuples, x)) if isinstance(x, list) else x
