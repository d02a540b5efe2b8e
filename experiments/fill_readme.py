"""Write what `irb140 demo --seed 0` says into the README's first screen:  python experiments/fill_readme.py"""

import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
COMMAND = "irb140 demo --seed 0 --out demo"


def demo_output() -> str:
    """The words of the demonstration on standard output, progress left out."""
    code = "import sys; from irb140_jax.cli import main; sys.exit(main())"
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", code, *COMMAND.split()[1:]]
        done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, check=True)
    lines = [line.rstrip() for line in done.stdout.splitlines()]
    return re.sub(r"\n{2,}", "\n\n", "\n".join(lines)).strip()


def filled(readme: str, output: str) -> str:
    """The README with this output in the block that begins with the command."""
    block = re.compile(rf"(```text\n\$ {re.escape(COMMAND)}\n).*?(```)", re.S)
    text, count = block.subn(lambda found: f"{found[1]}{output}\n{found[2]}", readme)
    if count != 1:
        raise SystemExit(f"README.md: {count} blocks begin with '$ {COMMAND}'; there should be one")
    return text


def main() -> None:
    path = ROOT / "README.md"
    path.write_text(filled(path.read_text(encoding="utf-8"), demo_output()), encoding="utf-8")


if __name__ == "__main__":
    main()
