"""What a comparison says in plain sentences."""

from collections.abc import Mapping, Sequence
from typing import Any

from irb140_jax.report import text

WHY_NOT = {
    "not_testable": "whose motion could not have shown it",
    "undecided": "which is undecided",
    "not_found": "which could have shown it and does not name it",
}


def said_of_parameter(p: Mapping[str, Any], names: Sequence[str], same_within: float) -> str:
    """What is known of one parameter in all diagnoses.

    Args:
        p: The parameter in compare.json.
        names: Of the diagnoses.
        same_within: Share by which they may differ and are still called the same.
    """
    unit, share = p["unit"], text.percent(same_within)
    if p["says"] == "named_in_some":
        return "Only one diagnosis has a value with an interval, so there is nothing to compare."
    mean, d = p["pooled"], p["largest"]
    if p["says"] == "same":
        small = f" A difference is there all the same ({_p(p['p_holm'])} after Holm)." if p["p_holm"] < 0.05 else ""
        return (f"The same within {share}: {text.with_std(mean['value'], mean['std'])} {unit}; every difference lies "
                f"within {_at_most(p)} {unit} (90 %).{small}")  # fmt: skip
    between = f"from {names[d['first']]} to {names[d['second']]}"
    change = f"{_signed(d['value'], d)} {unit} (90 %: {_signed(d['low'], d)} to {_signed(d['high'], d)}){_relative(p)}"
    if p["says"] == "differs":
        odd = f"; {names[p['most_unlike']]} is the most unlike the others" if p["most_unlike"] is not None else ""
        return f"Differs: {between} by {change}; {_p(p['p_holm'])} after Holm{odd}."
    least = _at_most(p)
    return (f"Can't tell: no difference is shown ({_p(p['p_holm'])} after Holm), but one of up to {least} {unit} "
            f"is possible; {between} it is {change}.")  # fmt: skip


def said_of_effect(named: Sequence[int], without: Sequence[Mapping[str, Any]], names: Sequence[str]) -> str:
    """Which diagnoses name an effect, and what the others say of it."""
    if not without:
        return f"All {len(named)} diagnoses name it."
    others = [f"not in {names[one['of']]}, {_why_not(one['why'])}" for one in without]
    return f"Named in {', '.join(names[k] for k in named)}; {'; '.join(others)}."


def _why_not(why: str) -> str:
    kind, _, what = why.partition(":")
    if kind == "alternative":
        return f"which names {text.words(what)} and can't rule this out instead"
    if kind == "other_joints":
        return f"which names it on {what.replace(',', ', ')}"
    return WHY_NOT[kind]


def _at_most(p: Mapping[str, Any]) -> str:
    """The largest difference that the intervals allow."""
    return text.number(max(max(abs(d["low"]), abs(d["high"])) for d in p["differences"]), 2)


def _relative(p: Mapping[str, Any]) -> str:
    first = p["values"][p["largest"]["first"]]["value"]
    return f", {100 * p['largest']['value'] / abs(first):+.0f} %".replace("-", "−") if first else ""


def _signed(x: float, d: Mapping[str, Any]) -> str:
    """A difference with its sign, to the digits that its interval makes worth reading."""
    said = text.rounded_like(abs(x), (d["high"] - d["low"]) / 2 / text.HALF_WIDTH_90)
    return f"{'−' if x < 0 else '+'}{said}"


def _p(p: float) -> str:
    return "p < 0.0001" if p < 1e-4 else f"p = {p:.2g}"
