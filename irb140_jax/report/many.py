"""The page of many diagnoses: all units, the worst first, and which effects they have in common."""

import urllib.parse
from collections import Counter
from collections.abc import Mapping, Sequence

from markupsafe import Markup

from irb140_jax.report import text
from irb140_jax.report.pages import stylesheet, template

Rows = Sequence[Mapping]


def many_html(rows: Rows, name: str, waiting: int = 0) -> str:
    """The page as the text of one HTML file; it lies beside the folder `diagnoses`.

    Args:
        rows: One a unit.
        name: Of the folder of recordings.
        waiting: Units that have no row yet.
    """
    told = [row for row in rows if row["status"] == "diagnosed"]
    return template("many.html.j2").render(
        name=name,
        waiting=waiting,
        units=[_shown(row) for row in by_severity(told)],
        untold=[row for row in rows if row["status"] != "diagnosed"],
        headline=headline(rows, waiting),
        counts=_counts(told),
        effects=_effects(told),
        style=Markup(stylesheet()),
    )


def by_severity(rows: Rows) -> list[Mapping]:
    """Rows, the worst first: by the verdict, then by how far the model as given is off in terms of the noise."""
    return sorted(rows, key=lambda row: (-row["severity"], -(row["given_over_noise"] or 0.0), row["unit"]))


def headline(rows: Rows, waiting: int = 0) -> str:
    """The whole in one sentence."""
    verdicts = Counter(row["verdict"] for row in rows if row["status"] == "diagnosed")
    said = [f"{count} {title.lower()}" for verdict, title in text.VERDICTS.items() if (count := verdicts[verdict])]
    untold = sum(row["status"] != "diagnosed" for row in rows)
    said += [f"{untold} could not be diagnosed"] if untold else []
    said += [f"{waiting} not yet diagnosed"] if waiting else []
    every = len(rows) + waiting
    return f"{every} unit{'' if every == 1 else 's'}: {', '.join(said) or 'none diagnosed'}."


def _counts(rows: Rows) -> list[dict]:
    """How many units have each verdict, with the length of a bar in per cent."""
    verdicts = Counter(row["verdict"] for row in rows)
    most = max(verdicts.values(), default=1)
    return [{"verdict": verdict, "title": title, "units": verdicts[verdict], "length": 100.0 * verdicts[verdict] / most}
            for verdict, title in text.VERDICTS.items() if verdicts[verdict]]  # fmt: skip


def _effects(rows: Rows) -> list[dict]:
    """How often each effect was named, on which joints."""
    units: dict[str, set[str]] = {}
    joints: dict[str, Counter] = {}
    for row in rows:
        for word in row["effects"]:
            slug, _, where = word.partition(":")
            units.setdefault(slug, set()).add(row["unit"])
            joints.setdefault(slug, Counter()).update(where.split(","))
    order = sorted(units, key=lambda slug: (-len(units[slug]), slug))
    of = max(len(rows), 1)
    where = {slug: [f"{joint} ({count})" for joint, count in joints[slug].most_common()] for slug in order}
    return [{"effect": slug, "units": len(units[slug]), "share": len(units[slug]) / of, "joints": where[slug]}
            for slug in order]  # fmt: skip


def _shown(row: Mapping) -> dict:
    """A row as a person reads it."""
    by_effect: dict[str, list[str]] = {}
    for word in row["effects"]:
        slug, _, joints = word.partition(":")
        by_effect.setdefault(slug, []).extend(joints.split(","))
    named = [f"{text.words(slug)} on {', '.join(dict.fromkeys(joints))}" for slug, joints in by_effect.items()]
    if row["unexplained"]:
        named.append(f"something without a name on {', '.join(dict.fromkeys(row['unexplained']))}")
    link = f"diagnoses/{urllib.parse.quote(row['unit'])}/report.html"
    return {**row, "named": named, "link": link, "title": text.VERDICTS.get(row["verdict"], row["verdict"])}
