"""The gate of benchmarks/: what is missing or no number fails."""

import importlib.util
import pathlib

GOALS_FILE = pathlib.Path(__file__).parents[1] / "benchmarks" / "goals.py"
spec = importlib.util.spec_from_file_location("goals", GOALS_FILE)
assert spec is not None and spec.loader is not None
goals = importlib.util.module_from_spec(spec)
spec.loader.exec_module(goals)

MET = {name: goal for name, (goal, _) in goals.GOALS.items()}


def failures(metrics: dict[str, float], slack: float = 1.0) -> list[str]:
    return [name for name in goals.GOALS if goals.missed(name, metrics, slack)]


def test_a_goal_just_met_passes():
    assert failures(MET) == []


def test_a_missing_metric_fails():
    assert failures({k: v for k, v in MET.items() if k != "paper_style_ratio"}) == ["paper_style_ratio"]


def test_a_metric_that_is_no_number_fails():
    assert failures({name: float("nan") for name in MET}) == list(MET)


def test_slack_lowers_a_ratio_and_lengthens_a_time():
    relaxed = {name: goal * (0.8 if sense == "min" else 1.25) for name, (goal, sense) in goals.GOALS.items()}
    assert failures(relaxed) == list(MET)
    assert failures(relaxed, slack=0.7) == []
