"""Two engines on the cases that both have seen, side by side.

    python -m testbed.compare work new            # results/testbed_work.jsonl beside results/testbed_work_new.jsonl
    python -m testbed.compare work one --to two
"""

import dataclasses
from typing import Literal

import tyro

from testbed import report, runner, scoring


@dataclasses.dataclass(frozen=True)
class Config:
    """Which results."""

    draw: tyro.conf.Positional[Literal["work", "check", "final"]]
    label: tyro.conf.Positional[str]
    to: str = ""
    """Label of those on the left; by default those without one."""


def common(left: report.Lines, right: report.Lines) -> tuple[report.Lines, report.Lines]:
    """The cases that both diagnosed, in the same order."""
    by = [{x["index"]: x for x in lines if x["diagnosis"]} for lines in (left, right)]
    both = sorted(by[0].keys() & by[1].keys())
    return [by[0][i] for i in both], [by[1][i] for i in both]


def changes(left: report.Lines, right: report.Lines) -> list[str]:
    """Cases whose false names or missed effects differ, a line each."""
    out = []
    for a, b in zip(left, right, strict=True):
        false = [", ".join(sorted(f["effect"] for f in scoring.false_names(x))) or "none" for x in (a, b)]
        hits = [sum(c["size"] > 0 for c in scoring.stated_classes(x)) for x in (a, b)]
        if false[0] != false[1] or hits[0] != hits[1]:
            out.append(f"{a['index']} {' + '.join(a['kinds'])}: false {false[0]} -> {false[1]}; in the stated class "
                       f"{hits[0]} -> {hits[1]} of {len(scoring.stated_classes(a))}")  # fmt: skip
    return out


def main() -> None:
    """Print the table of figures for both and every case that differs."""
    config = tyro.cli(Config)
    left, right = common(*(runner.read(runner.stored(config.draw, label)) for label in (config.to, config.label)))
    if not left:
        raise SystemExit(f"no case of {config.draw} was diagnosed under both labels: run testbed.runner for each")
    rows = [(name, a, b, goal) for (name, a, goal), (_, b, _) in
            zip(report.figures(left), report.figures(right), strict=True)]  # fmt: skip
    head = (f"{len(left)} cases of {config.draw}", config.to or "as stored", config.label, "goal")
    print(report.markdown(head, rows))
    print(*changes(left, right), sep="\n")


if __name__ == "__main__":
    main()
