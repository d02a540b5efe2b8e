"""The public names are those of the list beside this file, and importing them is cheap.

After a wanted change, write the list anew:  python tests/test_api.py
"""

import importlib
import pathlib
import pkgutil
import subprocess
import sys

import irb140_jax

LIST = pathlib.Path(__file__).with_name("public_names.txt")


def public_names() -> list[str]:
    """Every public name of the package and its subpackages, as `package.name`."""
    names = [f"irb140_jax.{name}" for name in irb140_jax.__all__]
    for info in pkgutil.iter_modules(irb140_jax.__path__):
        if info.ispkg:
            package = importlib.import_module(f"irb140_jax.{info.name}")
            modules = {inner.name for inner in pkgutil.iter_modules(package.__path__)}
            own = {name for name in vars(package) if not name.startswith("_")} - (modules - reexported(package))
            names += [f"{package.__name__}.{name}" for name in own]
    return sorted(names)


def reexported(package) -> set[str]:
    """Names that `__init__.py` re-exports in the form `x as x`."""
    lines = pathlib.Path(package.__file__).read_text(encoding="utf-8").split()
    return {b for a, word, b in zip(lines, lines[1:], lines[2:], strict=False) if word == "as" and a == b}


def run(code: str) -> str:
    """What a fresh interpreter prints."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    return done.stdout.strip()


def test_the_public_names_are_those_of_the_list():
    listed = LIST.read_text(encoding="utf-8").split()
    now = public_names()
    assert not set(listed) - set(now), "gone"
    assert not set(now) - set(listed), "new; if that is wanted: python tests/test_api.py, and a line in CHANGELOG.md"


def test_importing_the_package_imports_no_heavy_one():
    heavy = ("jax", "mujoco", "pandas", "scipy", "matplotlib", "numpy")
    assert run(f"import sys, irb140_jax; print([m for m in {heavy} if m in sys.modules])") == "[]"


def test_every_subpackage_is_reached_as_an_attribute():
    assert run("import irb140_jax as irb; print(irb.robot.load_robot is irb.load_robot)") == "True"


def test_numbers_are_float64_whichever_of_jax_and_the_package_comes_first():
    show = "import jax.numpy as jnp; print(jnp.zeros(1).dtype)"
    assert run(f"import irb140_jax, jax; {show}") == "float64"
    assert run(f"import jax, irb140_jax; {show}") == "float64"


def test_an_unknown_name_is_an_attribute_error_that_lists_the_known_ones():
    code = "import irb140_jax\ntry: irb140_jax.nonsense\nexcept AttributeError as e: print(e)"
    assert "load_robot" in run(code)


if __name__ == "__main__":
    LIST.write_text("\n".join(public_names()) + "\n", encoding="utf-8")
