"""Each setting of a diagnosis multiplied and divided by 1.5: what is said otherwise on cases of *work*.

    python experiments/settings_swept.py                    # goes on where it stopped; an hour of two cores
    python experiments/settings_swept.py --cases 3          # what is stored; half an hour
    python experiments/settings_swept.py --part 0 --of 2    # every second setting; with --part 1 in another process
    python experiments/settings_swept.py --page-only

A setting whose change flips names is a defect of the model and no setting.  Probabilities and shares near one are moved
by their odds.  Left out are those that say only what is worth a sentence, and those of the motion that decides.
"""

import dataclasses
import json
import pathlib
import tempfile
from typing import Any

import numpy as np
import tyro

from irb140_jax.compilation_cache import set_up_compilation_cache
from irb140_jax.mismatch import diagnose, settings
from testbed.cases import Variation, kinds_of, make
from testbed.runner import read_case

ROOT = pathlib.Path(__file__).parents[1]
STORED, PAGE = ROOT / "results" / "settings_swept.jsonl", ROOT / "docs" / "settings.md"
FACTOR = 1.5
BY_ODDS = ("NAMED", "COMMON", "ALONE", "NEARLY", "ENOUGH_LAGS", "LARGE_ERROR")
OF_SENTENCES = (
    "LISTED_POWER", "SLOW", "LISTED_PROBABILITY", "NOTABLE_DELAY", "NOTABLE_GAP", "NOTABLE_SHIFT", "FEW_LINKS",
    "COARSE", "HIDDEN_WEIGHT", "SPEED_UP", "EFFORT_SHARE", "UNKNOWN_NOISE",
)  # fmt: skip
OF_NO_NUMBER = ("LIVELY", "WIDTH_OCTAVES")


@dataclasses.dataclass(frozen=True)
class Config:
    """Which settings, and on how many cases."""

    cases: int = 6
    """Of *work*: 0 to cases - 1."""
    part: int = 0
    of: int = 1
    engine: str = ""
    """Commit of the package, kept with each result."""
    page_only: bool = False


def names() -> list[str]:
    """Settings that are swept, in the order of the file."""
    return [k for k in vars(settings) if k.isupper() and k not in OF_SENTENCES + OF_NO_NUMBER]


def moved(name: str, factor: float) -> Any:
    """The setting's value, larger or smaller."""
    value = getattr(settings, name)
    if name in BY_ODDS:
        odds = factor * value / (1.0 - value)
        return odds / (1.0 + odds)
    if isinstance(value, tuple):
        return tuple(factor * x for x in value)
    return max(1, round(factor * value)) if isinstance(value, int) else factor * value


def main(config: Config) -> None:
    """Diagnose the cases at each setting and write the page."""
    set_up_compilation_cache()
    if not config.page_only:
        _diagnose_all(config)
    PAGE.write_text(page(_stored()), encoding="utf-8")


def _diagnose_all(config: Config) -> None:
    done = {(r["setting"], r["factor"], r["case"]) for r in _stored()}
    mine = [(name, f) for name in names()[config.part :: config.of] for f in (FACTOR, 1.0 / FACTOR)]
    mine = [("", 1.0), *mine] if config.part == 0 else mine
    with tempfile.TemporaryDirectory() as folder:
        read = [read_case(make("work", i, "", Variation(1.0, 1.0, None)), pathlib.Path(folder))[:2]
                for i in range(config.cases)]  # fmt: skip
    for name, factor in mine:
        usual = getattr(settings, name) if name else None
        if name:
            setattr(settings, name, moved(name, factor))
        for i, (robot, recordings) in enumerate(read):
            if (name, factor, i) not in done:
                found = diagnose(robot, recordings).diagnosis
                said = {
                    "engine": config.engine, "setting": name, "factor": factor, "case": i, "verdict": found.verdict,
                    "names": sorted(f"{f.effect} on {', '.join(f.joints)}" for f in found.findings),
                    "unexplained": sorted(j for u in found.unexplained for j in u.joints),
                }  # fmt: skip
                with STORED.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(said) + "\n")
        if name:
            setattr(settings, name, usual)
        print(name or "as they are", f"x {factor:.3g}", flush=True)


def _stored() -> list[dict[str, Any]]:
    return [json.loads(line) for line in STORED.read_text(encoding="utf-8").splitlines()] if STORED.exists() else []


def page(results: list[dict[str, Any]]) -> str:
    """The page: what changes at each setting."""
    usual = {r["case"]: r for r in results if not r["setting"]}
    said = {(r["setting"], round(r["factor"], 3), r["case"]): r for r in results}
    every = sum(len(r["names"]) for r in usual.values())
    lines = [
        "# What the settings decide", "",
        "Written by `experiments/settings_swept.py` from `results/settings_swept.jsonl`; don't edit.", "",
        f"Every number of `irb140_jax/mismatch/settings.py` that can change a name, multiplied and divided by {FACTOR}",
        f"on cases 0 to {max(usual, default=0)} of the testbed's draw *work*, {every} names in all. + and - are names",
        "that come and go; a name that goes may still be listed as an alternative. Probabilities and shares near one",
        f"are moved by their odds. Engine at commit {', '.join(sorted({r['engine'] for r in results}))}.", "",
        f"The cases hide {'; '.join(' and '.join(kinds_of('work', i)) for i in sorted(usual))}; of other",
        "kinds, and of names that are close to even, this says nothing.", "",
        "| setting | value | x 1.5 | / 1.5 |", "|---|---|---|---|",
    ]  # fmt: skip
    flips = 0
    for name in names():
        cells = []
        for factor in (FACTOR, 1.0 / FACTOR):
            pairs = [(said[name, round(factor, 3), i], usual[i]) for i in usual if (name, round(factor, 3), i) in said]
            changes = [c for new, old in pairs for c in _changes(new, old)]
            flips += len(changes)
            cells.append("; ".join(changes) if changes else "nothing" if len(pairs) == len(usual) else "not run")
        lines.append(f"| `{name}` | {_value(getattr(settings, name))} | {cells[0]} | {cells[1]} |")
    lines += ["", f"{flips} changes in {len(results) - len(usual)} diagnoses.", ""]
    return "\n".join(lines)


def _changes(new: dict[str, Any], old: dict[str, Any]) -> list[str]:
    come, go = set(new["names"]) - set(old["names"]), set(old["names"]) - set(new["names"])
    out = [f"case {new['case']}: + {n}" for n in sorted(come)] + [f"case {new['case']}: - {n}" for n in sorted(go)]
    if new["unexplained"] != old["unexplained"]:
        out.append(f"case {new['case']}: unexplained on {', '.join(new['unexplained']) or 'none'}")
    return out + ([f"case {new['case']}: {new['verdict']}"] if new["verdict"] != old["verdict"] else [])


def _value(value: Any) -> str:
    return ", ".join(f"{x:.3g}" for x in np.atleast_1d(value))


if __name__ == "__main__":
    main(tyro.cli(Config))
