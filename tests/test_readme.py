"""The README keeps its promises: its commands are those of the CI, and what it refers to exists."""

import pathlib
import re
import shlex
import tomllib

import pytest

from irb140_jax.cli.commands import word
from irb140_jax.cli.parsing import parsed

ROOT = pathlib.Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
CI = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CONSTRAINTS = (ROOT / "constraints.txt").read_text(encoding="utf-8")


def shell_lines() -> list[str]:
    """Every line of the README's shell blocks."""
    return [line for block in re.findall(r"```sh\n(.*?)```", README, re.S) for line in block.splitlines() if line]


def normal(name: str) -> str:
    """A package's name as indexes write it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def test_the_two_commands_come_first_and_start_from_nothing_but_python():
    first, second = shell_lines()[:2]
    for command in (first, second):
        assert command.startswith("python3 -m venv .venv && .venv/bin/pip install -q -c constraints.txt -e ")
    assert " irb140 demo " in first.replace(".venv/bin/", " ") and "pytest" in second


def test_the_ci_runs_the_test_command_of_the_readme_word_for_word():
    assert shell_lines()[1] in CI.replace(" \\\n    ", " ")


def test_a_ci_with_another_test_command_would_be_noticed():
    assert shell_lines()[1].replace("-n 2", "-n 4") not in CI


@pytest.mark.parametrize("line", [line for line in shell_lines() if "irb140 " in line])
def test_every_irb140_command_of_the_readme_is_understood(line):
    words = shlex.split(line.split("irb140 ", 1)[1], comments=True)
    command = parsed(words)
    assert word(type(command)) == words[0]


def test_every_link_of_the_readme_and_of_the_docs_leads_somewhere():
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")]
    targets = [(page, link) for page in pages for link in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8"))]
    assert len(targets) >= 4
    missing = [
        f"{page.name}: {link}" for page, link in targets if "://" not in link and not (page.parent / link).exists()
    ]
    assert not missing


def test_every_dependency_has_a_lower_bound_and_a_pin():
    wanted = [
        *PROJECT["dependencies"],
        *(name for extra in PROJECT["optional-dependencies"].values() for name in extra),
    ]
    pins = {normal(line.split("==")[0]) for line in CONSTRAINTS.splitlines() if line and not line.startswith("#")}
    for requirement in wanted:
        name = re.split(r"[\[<>=!]", requirement)[0]
        if name == PROJECT["name"]:  # extras of our own
            continue
        assert ">=" in requirement, requirement
        assert normal(name) in pins, f"{name} has no pin in constraints.txt"


def test_constraints_are_exact_versions_without_hosts_or_paths():
    for line in CONSTRAINTS.splitlines():
        assert line.startswith("#") or re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.]+", line), line


def test_every_page_of_the_docs_is_in_an_index():
    for folder in (ROOT / "docs", ROOT / "docs" / "decisions"):
        index = (folder / "index.md").read_text(encoding="utf-8")
        pages = [path.name for path in folder.glob("*.md") if path.name != "index.md"]
        assert pages and not [page for page in pages if f"({page})" not in index]
