"""The page on two machines that are not arms (docs/real-machines.md), from the results of their experiments.

python experiments/real_machines_page.py [--results results]
"""

import dataclasses
import json
import pathlib

import numpy as np
import tyro

PAGE = pathlib.Path(__file__).resolve().parents[1] / "docs" / "real-machines.md"
PUBLISHED = {
    "Coulomb and viscous friction": 0.0588, "with load-dependent friction, as named": 0.0325,
    "the same, within what the torque says of it": 0.0325,
}  # fmt: skip  # rad


@dataclasses.dataclass(frozen=True)
class Config:
    """Where the results are."""

    results: pathlib.Path = pathlib.Path("results")


def named(findings: list[dict]) -> str:
    """Findings in one line, with their numbers."""
    number = lambda k, v: f"{k} {v['value']:.3g} ± {v['std']:.1g} {v['unit']}".rstrip(" 1")  # noqa: E731
    return "; ".join(
        f"{f['effect']} ({', '.join(number(k, v) for k, v in f['parameters'].items())})" for f in findings
    )


def servo(result: dict) -> list[str]:
    """What was named of the servo, and how its position loop is simulated."""
    fit = result["fit"]["servo"]
    rows = [
        f"| {law} | {optimum['error_seen']:.4f} | {optimum['error_judged']:.4f} | {PUBLISHED[law]} |"
        for law, optima in result["simulation"].items() for optimum in optima
    ]  # fmt: skip
    tried = [
        f"| {r['scatter']:.0%} | {r['error_on_a_gain_left_out']:.4f} | {r['error_judged']:.4f} |"
        for r in result["other_scatters"]
    ]
    drawn = [
        f"| {r['copies']} | {', '.join(f'{x:.4f}' for x in sorted(r['errors_judged']))} |"
        for r in result["other_draws"]
    ]
    met = sum(x <= result["goal"] for r in result["other_draws"] for x in r["errors_judged"])
    judged = [optima[0]["error_judged"] for optima in result["simulation"].values()]
    free = result["simulation"]["with load-dependent friction, as named"][0]["numbers"]
    told = next(f for f in result["findings"] if f["effect"] == "load_dependent_friction")["parameters"]
    told = told["load_coefficient"]
    reached = ["reached" if x <= result["goal"] else "not reached" for x in judged]
    rest = "; ".join(u["where"] for u in result["unexplained"]) or "nothing that repeats"
    return [
        "## A hobby servo with a pendulum (`bam_xl330`)", "",
        "Twelve runs (gains 100, 200, 800) are diagnosed; the four with gain 400 are judged. Named from torque alone:",
        f"{named(result['findings'])}. On a single hinge",
        "a payload's mass moves nothing, only its moments do, and a payload without a mass is none.", "",
        f"On torque that the fit did not see, the error goes from {fit['rmse_nominal']:.3g} N m (model as given) over",
        f"{fit['rmse_refit']:.3g} (inertials refitted) to {fit['rmse_corrected']:.3g} N m. What is left: {rest}.", "",
        "Then the position loop is simulated with the published drive, and the numbers are refitted to the positions",
        "of the twelve runs: freely, from five starts, and with the load's friction within three standard deviations",
        "of what was named, from the same five and from the five optima found freely. Whether a simulated servo",
        "sticks at a turn is a matter of a percent in its friction, so the lowest error of single simulations is luck;",
        "what is minimised is the mean error when the numbers scatter as widely as the diagnosis is unsure of them,",
        f"by {result['scatter']:.1%}. Every optimum, the one with the least mean error on the runs seen first; mean",
        "absolute errors without scatter, in rad:", "",
        "| law | runs seen | runs judged | published |", "|---|---|---|---|", *rows, "",
        f"Of the error of Coulomb and viscous friction the best optimum leaves {judged[1] / judged[0]:.2f} freely, and",
        f"{judged[2] / judged[0]:.2f} within what the torque says; the goal of {result['goal']} rad is {reached[1]}",
        f"freely, and {reached[2]} within. The optimum that the positions alone prefer has a load coefficient of",
        f"{free['load']:.3g}, {abs(free['load'] - told['value']) / told['std']:.1f} standard deviations from what the"
        " torque says. (That bound was added when the",
        "free figures were known; it holds no number but the diagnosis' own.)", "",
        "Other scatters, freely refitted, the best optimum. That width was settled when judged figures of others were",
        "known; one gain of three left out at a time would prefer more scatter, but tells little between any of them:",
        "", "| scatter of the numbers | error on the gain left out | runs judged |", "|---|---|---|", *tried, "",
        f"Copies drawn anew, refitted freely from the data sheet, runs judged. The goal is met by {met} of these"
        f" {sum(len(r['errors_judged']) for r in result['other_draws'])} draws:", "",
        "| copies | every draw |", "|---|---|", *drawn,
    ]  # fmt: skip


def gears(results: dict) -> list[str]:
    """Play that was named in every run, beside the published gap."""
    rows = []
    for name, r in results.items():
        gap, published = r["gap_arc_minutes"], r["published_gap_arc_minutes"]
        play = f"{gap['value']:.1f} ± {gap['std']:.1f}" if gap else "none"
        others = ", ".join(f["effect"] for f in r["findings"] if f["effect"] != "backlash")
        rows.append(f"| `{name}` | {play} | {'' if published is None else f'{published:g}'} | {others} |")
    known = [r for r in results.values() if r["published_gap_arc_minutes"] is not None]
    off = [abs(r["gap_arc_minutes"]["value"] - r["published_gap_arc_minutes"]) if r["gap_arc_minutes"] else np.inf
           for r in known]  # fmt: skip
    return [
        "## Cycloidal gears, output bolted down (`cycloidal_play`)", "",
        "| run | play named [arc-min] | published | named beside it |", "|---|---|---|---|", *rows, "",
        f"The published gaps are met within {max(off):.0f} arc-minutes (goal 10). They come from a spring, dry",
        "friction and a dead zone; where the diagnosis also finds friction that springs before it slips, such a",
        "fit counts that as play. `12pre` runs are preloaded, and no play may be named there. Small changes of the",
        "noise level turn what is named beside the play.",
    ]  # fmt: skip


def main() -> None:
    config = tyro.cli(Config)
    read = lambda name: json.loads((config.results / f"real_{name}.json").read_text(encoding="utf-8"))  # noqa: E731
    lines = [
        "# Two machines that are not arms: a servo that rubs under load, gears with play", "",
        "<!-- Written by experiments/real_machines_page.py from the stored results; don't edit. -->", "",
        "`python experiments/real_bam_xl330.py` and `python experiments/real_cycloidal_play.py` diagnose published",
        "recordings with the general method, no number of which is theirs. Where recordings come from:",
        "[recordings](recordings.md).", "",
        *servo(read("bam_xl330")), "", *gears(read("cycloidal_play")),
    ]  # fmt: skip
    PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
