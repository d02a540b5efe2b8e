"""Run the commands of docs/first-hour.md as they stand there, in a folder of their own, and time each.

    python experiments/first_hour.py [--out results]
"""

import dataclasses
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import time

import tyro

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "first-hour.md"


@dataclasses.dataclass(frozen=True)
class Config:
    """Where to write."""

    out: pathlib.Path = pathlib.Path("results")
    smoke: bool = False
    """Without the diagnosis."""


def commands() -> list[str]:
    """What the page has one type, without the installation."""
    return [block.strip() for block in re.findall(r"```console\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)]


def column_map() -> str:
    """The map that the page has one save."""
    return re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)[0]


def run(config: Config) -> dict:
    rows = []
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        for name in ("assets", "docs"):
            (folder / name).symlink_to(ROOT / name)
        (folder / "map.toml").write_text(column_map(), encoding="utf-8")
        for command in commands():
            words = shlex.split(command)
            if config.smoke and "diagnose" in words:
                continue
            words = [sys.executable, *(["-m", "irb140_jax"] if words[0] == "irb140" else []), *words[1:]]
            start = time.perf_counter()
            # The package of this checkout, also where another one is installed.
            paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
            done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False,
                                  env=os.environ | {"PYTHONPATH": paths})  # fmt: skip
            rows.append({"command": command, "exit": done.returncode, "seconds": round(time.perf_counter() - start, 1)})
            print(f"$ {command}\n{done.stdout}{done.stderr}", flush=True)
        result = {"commands": rows}
        if not config.smoke:
            diagnosis = json.loads((folder / "report" / "diagnosis.json").read_text(encoding="utf-8"))
            found = [{"effect": f["effect"], "joints": f["joints"], "parameters": f["parameters"]}
                     for f in diagnosis["findings"]]  # fmt: skip
            result |= {"verdict": diagnosis["verdict"], "findings": found}
    return result


def main() -> None:
    config = tyro.cli(Config)
    result = run(config)
    config.out.mkdir(parents=True, exist_ok=True)
    path = config.out / "first_hour.json"
    path.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(path)
    sys.exit(max(row["exit"] for row in result["commands"]))


if __name__ == "__main__":
    main()
