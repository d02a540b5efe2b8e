"""Each layer imports only from those above it, read from the source with ast."""

import ast
import pathlib

import pytest

PACKAGE = pathlib.Path(__file__).parents[1] / "irb140_jax"

# Parts on one line stand beside each other and may not import each other.
LAYERS = (
    ("types", "errors", "arrays", "allocator", "compilation_cache", "compiler", "tables"),
    ("shapes",),
    ("sharding",),
    ("robot",),
    ("trajectory",),
    ("swarm",),
    ("kinematics", "oracle"),
    ("dynamics",),
    ("control", "effects", "learned", "identify"),
    ("simulate",),
    ("recordings",),
    ("mismatch",),
    ("report",),
    ("fleet",),
    ("cli", "library"),
    ("__main__",),
)
# Inside mismatch/: the stages of a diagnosis, in their order.
STAGES = (
    "settings", "records", "result", "inertials", "columns", "regression", "selection", "corrected", "validation",
    "experiment_design", "motion", "output", "diagnose",
)  # fmt: skip
LEVEL = {part: level for level, parts in enumerate(LAYERS) for part in parts}


def imported_parts(source: str, module: tuple[str, ...]) -> list[tuple[int, str]]:
    """Line and part of the package for every import of this source, those inside functions included."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = list(("irb140_jax", *module)[: -node.level]) if node.level else []
            prefix = ".".join([*base, *([node.module] if node.module else [])])
            names = [f"{prefix}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            head, _, rest = name.partition(".")
            if head == "irb140_jax" and rest:
                found.append((node.lineno, rest.split(".")[0]))
    return found


def breaches(source: str, module: tuple[str, ...]) -> list[str]:
    """Every import of this source that doesn't point upwards, or to a part that has no layer."""
    part = module[0]
    if part not in LEVEL:
        return [f"{part} has no layer; give it one in tests/test_layers.py and CONTRIBUTING.md"]
    wrong = []
    for line, target in imported_parts(source, module):
        if target == part:
            continue
        if target not in LEVEL:
            wrong.append(f"{'.'.join(module)}:{line} imports {target}, which has no layer")
        elif LEVEL[target] >= LEVEL[part]:
            wrong.append(f"{'.'.join(module)}:{line} imports {target}, which is not above {part}")
    return wrong


def test_every_module_imports_only_from_layers_above_its_own():
    modules = [path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py"]
    assert len(modules) > 10  # the search looked at the package
    found = []
    for path in modules:
        # A package's __init__ keeps its last name: a relative import there starts from the package itself.
        module = path.relative_to(PACKAGE).with_suffix("").parts
        found += breaches(path.read_text(encoding="utf-8"), module)
    assert not found, "\n".join(found)


def stage_breaches(source: str, stage: str) -> list[str]:
    """Every module of mismatch/ that a stage imports and that is of a later stage or of none."""
    wrong = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith("irb140_jax.mismatch"):
            continue
        below = (node.module or "").split(".")[2:3] or [alias.name for alias in node.names]
        wrong += [name for name in below if name != stage
                  and (name not in STAGES or STAGES.index(name) >= STAGES.index(stage))]  # fmt: skip
    return wrong


def test_every_stage_of_a_diagnosis_imports_only_from_earlier_ones():
    folder = PACKAGE / "mismatch"
    modules = [path for path in folder.rglob("*.py") if path != folder / "__init__.py"]
    assert len(modules) > 30
    for path in modules:
        stage = path.relative_to(folder).with_suffix("").parts[0]
        assert stage in STAGES, f"{stage} is no stage: give it a place in tests/test_layers.py"
        assert not stage_breaches(path.read_text(encoding="utf-8"), stage), path


@pytest.mark.parametrize(
    "source",
    [
        "from irb140_jax.mismatch.output.findings import findings",
        "from irb140_jax.mismatch import diagnose",
        "from irb140_jax.mismatch.somewhere_new import thing",
    ],
)
def test_a_planted_import_from_a_later_stage_is_found(source):
    assert stage_breaches(source, "selection")


@pytest.mark.parametrize(
    "source",
    [
        "from irb140_jax.mismatch import diagnose",
        "import irb140_jax.report.html",
        "from irb140_jax import cli",
        "from irb140_jax.control import sliding_mode",
        "from ..mismatch import diagnose",
        "def f():\n    from irb140_jax.simulate import rollout",
        "from irb140_jax.somewhere_new import thing",
    ],
)
def test_a_planted_breach_in_an_effect_is_found(source):
    assert breaches(source, ("effects", "coulomb_friction"))


@pytest.mark.parametrize(
    "source",
    [
        "from irb140_jax.dynamics import regressor",
        "from irb140_jax.effects.motion import Motion",
        "from . import motion",
        "import jax",
    ],
)
def test_an_import_from_above_or_from_the_own_folder_is_no_breach(source):
    assert not breaches(source, ("effects", "coulomb_friction"))


def test_the_mujoco_oracle_shares_no_code_with_what_it_judges():
    for path in (PACKAGE / "oracle").rglob("*.py"):
        for line, target in imported_parts(path.read_text(encoding="utf-8"), ("oracle", path.stem)):
            assert target in ("types", "errors", "robot", "oracle"), f"{path.name}:{line} imports {target}"


def outside_imports(path: pathlib.Path) -> set[str]:
    """First names of everything that a module imports, wherever in it."""
    tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    names = [a.name for node in tree if isinstance(node, ast.Import) for a in node.names]
    tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    names += [node.module or "" for node in tree if isinstance(node, ast.ImportFrom) and not node.level]
    return {name.partition(".")[0] for name in names}


TESTBED = sorted((PACKAGE.parent / "testbed").rglob("*.py"))


def test_the_testbed_is_made_by_nothing_that_it_judges():
    assert len(TESTBED) > 8
    calling = {path.name for path in TESTBED if outside_imports(path) & {"irb140_jax", "jax", "equinox", "experiments"}}
    assert calling == {"runner.py"}


def test_plants_on_prescribed_paths_take_no_dynamics_and_no_friction_from_mujoco():
    # It compiles a model's text in one place, and closes the loop of servos in another, and that is all.
    using = {path.name for path in TESTBED if "mujoco" in outside_imports(path)}
    assert using == {"arms.py", "servos.py"}
    assert "mj_" not in (PACKAGE.parent / "testbed" / "arms.py").read_text(encoding="utf-8")


def test_nothing_of_the_package_knows_the_testbed():
    for path in PACKAGE.rglob("*.py"):
        assert "testbed" not in outside_imports(path), f"{path.name} imports testbed"
