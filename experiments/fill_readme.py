"""Write what `irb140 demo` says into the README, a certain case and an open one:  python experiments/fill_readme.py"""

import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
CERTAIN, OPEN = "irb140 demo --seed 1 --out demo", "irb140 demo --seed 6 --out demo"


def demo_output(command: str) -> str:
    """The words of the demonstration on standard output, progress left out."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "irb140_jax", *command.split()[1:]]
        done = subprocess.run(words, cwd=folder, stdout=subprocess.PIPE, text=True, check=True)
    lines = [line.rstrip() for line in done.stdout.splitlines()]
    return re.sub(r"\n{2,}", "\n\n", "\n".join(lines)).strip()


def shortened(output: str) -> str:
    """The same without the table of errors and the notes, which the certain case shows."""
    return re.sub(r"\n *torque error on unseen data.*?\n(Report:)", r"\n  [...]\n\1", output, flags=re.S)


def filled(readme: str, command: str, output: str) -> str:
    """The README with this output in the block that begins with the command."""
    block = re.compile(rf"(```text\n\$ {re.escape(command)}\n).*?(```)", re.S)
    text, count = block.subn(lambda found: f"{found[1]}{output}\n{found[2]}", readme)
    if count != 1:
        raise SystemExit(f"README.md: {count} blocks begin with '$ {command}'; there should be one")
    return text


def main() -> None:
    path = ROOT / "README.md"
    readme = filled(path.read_text(encoding="utf-8"), CERTAIN, demo_output(CERTAIN))
    path.write_text(filled(readme, OPEN, shortened(demo_output(OPEN))), encoding="utf-8")


if __name__ == "__main__":
    main()
