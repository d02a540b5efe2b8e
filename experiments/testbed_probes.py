"""Where an engine stands in minutes: cases that broke one, true beside said.

    python experiments/testbed_probes.py                  # all
    python experiments/testbed_probes.py lugre spring     # these

What each probe hides is in `testbed/probes.py`, and every figure is `testbed/scoring.py`'s.  Results are kept in
results/testbed_probes.jsonl, each in the place of its former one.
"""

import json
import pathlib
import sys
from typing import Any

import numpy as np
import study_provenance

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))  # testbed/ stands beside experiments/ and is installed by nobody

from testbed import runner, scoring  # noqa: E402
from testbed.probes import PROBES  # noqa: E402
from testbed.statistics import covered  # noqa: E402


def row(line: dict[str, Any]) -> str:
    """What was said, beside what is true."""
    if line["diagnosis"] is None:
        return line.get("refused") or line["failed"]
    short = lambda f: f"{f['effect']} on {','.join(f['joints']) if len(f['joints']) < 6 else 'all'}"  # noqa: E731
    said = line["diagnosis"]
    false = [f"{short(f)} ({f['evidence']['probability']:.5g})" for f in scoring.false_names(line)]
    classes, found = scoring.stated_classes(line), scoring.intervals(line)
    ordinary = [x for x in found if x[0] in scoring.ORDINARY]
    many = sum(h["role"] == "ordinary" for h in line["truth"]["hidden"])
    hold = lambda xs: f"{sum(covered(v, s, true, 0.9) for *_, v, s, true in xs)} of {len(xs)}"  # noqa: E731
    parts = [
        f"verdict {said['verdict']} ({'right' if scoring.verdict_right(line) else 'WRONG'})",
        f"false names: {'; '.join(false) or 'none'}",
        f"false ordinary friction: {len(scoring.false_names(line, ordinary=True))}",
        f"ordinary friction named {len(ordinary)} (true {many}); 90 % intervals that hold {hold(ordinary)}",
    ]
    if classes:
        parts.append("special: " + "; ".join(f"{c['kind']} {c['how']}" for c in classes))
        parts.append(f"90 % intervals of the rest that hold {hold([x for x in found if x not in ordinary])}")
    parts += [f"{kind}: {how}" for kind, how in dict(scoring.located(line)).items()]
    if gains := scoring.gains(line):
        parts.append(f"gains within 5 %: {sum(gains)} of {len(gains)}")
    share = lambda u: "" if u["share"] is None else f" {100 * u['share']:.0f} %"  # noqa: E731
    at = [f"{','.join(u['joints'])}{share(u)}" for u in said["unexplained"]]
    parts.append(f"unexplained: {'; '.join(at) or 'none'}")
    floors = scoring.floors(line)
    parts.append(f"noise stated over the sensors': median {np.median(floors):.3g}, largest {np.max(floors):.3g}")
    parts.append(f"error on unseen motions over refit's: {scoring.unseen_ratio(line):.3g}")
    if any(line["impossible"].values()) or scoring.impossible_stated(line):
        parts.append(f"impossible bodies: exported {line['impossible']}, stated {scoring.impossible_stated(line)}")
    return "\n    ".join([*parts, f"{line['seconds']:.1f} s"])


def keep(name: str, line: dict[str, Any]) -> None:
    """Store a probe's result in the place of its former one."""
    path = runner.RESULTS / "testbed_probes.jsonl"
    kept = {r["probe"]: r for r in runner.read(path)} | {name: {"probe": name} | line}
    path.write_text("".join(json.dumps(kept[n]) + "\n" for n in PROBES if n in kept), encoding="utf-8")


def main() -> None:
    from irb140_jax.compilation_cache import set_up_compilation_cache

    set_up_compilation_cache()
    engine = study_provenance.commit()
    for name in sys.argv[1:] or PROBES:
        sentence, make = PROBES[name]
        line = json.loads(json.dumps(runner.compact(runner.judged(make())))) | {"engine": engine}
        keep(name, line)
        print(f"{name}: {sentence}\n    {row(line)}", flush=True)


if __name__ == "__main__":
    main()
