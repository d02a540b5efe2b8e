"""Hostile inputs: all of them anew, and the page of them."""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).parents[1]
GOOD, BAD = ("refused", "used"), ("silently wrong", "traceback", "hung", "files lost or left", "more than one line")


def counts(page: str) -> dict[str, int]:
    """The last row of the table by its columns."""
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("|")]
    return dict(zip(rows[0][2:], (int(cell.strip("*")) for cell in rows[-1][2:]), strict=True))


def test_every_hostile_input_is_refused_with_one_line_or_used(tmp_path):
    command = [sys.executable, "experiments/hostile_inputs.py", "--out", str(tmp_path / "page.md")]
    subprocess.run(command, cwd=ROOT, check=True, timeout=600)
    found = counts((tmp_path / "page.md").read_text())
    assert found["inputs"] >= 300 and {kind: found[kind] for kind in BAD} == dict.fromkeys(BAD, 0)
    assert sum(found[kind] for kind in GOOD) == found["inputs"]


def test_the_page_tells_of_at_least_three_hundred_and_of_nothing_lost():
    page = (ROOT / "docs" / "hostile-inputs.md").read_text(encoding="utf-8")
    found = counts(page)
    assert found["inputs"] >= 300 and {kind: found[kind] for kind in BAD} == dict.fromkeys(BAD, 0)
    assert len(re.findall(r"^\| two joints ", page, re.M)) == len(re.findall(r"^\| IRB 140 ", page, re.M)) >= 8
