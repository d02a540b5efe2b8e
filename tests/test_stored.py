"""A folder of a diagnosis that is damaged or of another version is refused with one line."""

import json
import shutil

import helpers_stored
import numpy as np
import pytest
from helpers_cli import refused

from irb140_jax.errors import InputError
from irb140_jax.mismatch import load_corrected, load_model, load_undecided
from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.experiment_design import undecided
from irb140_jax.mismatch.regression.discrepancy import FEATURES, Discrepancy


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return helpers_stored.stored(tmp_path_factory.mktemp("whole"))


@pytest.fixture
def folder(whole, tmp_path):
    """A copy to be spoiled."""
    return shutil.copytree(whole, tmp_path / "d")


def test_what_was_stored_by_hand_can_be_read(whole):
    assert isinstance(load_model(whole), CorrectedModel)
    again, made = load_undecided(whole), helpers_stored.open_questions()
    assert (again.columns, again.pairs, again.band) == (made.columns, made.pairs, made.band)
    np.testing.assert_array_equal(again.gram, made.gram)


def without(*path):
    def spoil(data):
        *parents, last = path
        for key in parents:
            data = data[key]
        del data[last]

    return spoil


def with_value(value, *path):
    def spoil(data):
        *parents, last = path
        for key in parents:
            data = data[key]
        data[last] = value

    return spoil


def unnamed(joints: int = 3, **sizes) -> dict:
    """What a model carries without a name as JSON, some of the sizes replaced."""
    scales = helpers_stored.open_questions().scales
    data = Discrepancy(scales, np.zeros((joints, FEATURES))).to_json()
    return data | {"scales": data["scales"] | sizes}


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (with_value(2, "schema"), "schema 2, this version reads and writes schema 5"),
        (with_value("2", "schema"), "schema '2'"),
        (without("schema"), "no schema"),
        (without("phi_refit"), "'phi_refit' is missing"),
        (without("robot", "leaves", "mass"), "mass"),
        (with_value([1.0], "robot", "leaves", "mass"), "mass has shape"),
        (with_value(["nan", 1.0, 1.0], "robot", "leaves", "mass"), "robot.mass holds what is no number"),
        (with_value("text", "robot"), "model.json"),
        (with_value(["a", "a", "b"], "robot", "joint_names"), "joint_names"),
        (with_value([[0.0] * 10] * 2, "phi_corrected"), "phi_corrected has shape (2, 10)"),
        (with_value([[float("inf")] * 10] * 3, "phi_corrected"), "phi_corrected holds"),
        (with_value([0.0] * 3, "rest_speed"), "rest_speed"),
        (with_value("gremlins", "effects", 0, "effect"), "gremlins"),
        (with_value([7], "effects", 0, "joints"), "joints (7,)"),
        (with_value([0.1, 0.2], "effects", 0, "amplitudes"), "amplitudes has shape"),
        (with_value([5], "effects", 0, "variant"), "no columns (5,)"),
        (with_value(0, "band", "rate"), "band"),
        (with_value(1, "band", "unheard_of"), "unheard_of"),
        (without("discrepancy"), "'discrepancy' is missing"),
        (with_value(unnamed(joints=2), "discrepancy"), f"discrepancy has shape (2, {FEATURES})"),
        (with_value(unnamed() | {"scales": {}}, "discrepancy"), "missing"),
        (with_value(unnamed(torque=[1.0, 2.0]), "discrepancy"), "torque has shape (2,)"),
        (with_value(unnamed(torque=["nan", 1.0, 1.0]), "discrepancy"), "torque holds what is no number"),
    ],
)
def test_a_model_of_another_version_or_with_wrong_numbers_is_refused(spoil, said, folder):
    data = json.loads((folder / "model.json").read_text())
    spoil(data)
    (folder / "model.json").write_text(json.dumps(data))
    with pytest.raises(InputError) as error:
        load_model(folder)
    assert said in str(error.value) and "diagnose again" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda meta, arrays: meta.update(schema=3), "schema 3"),
        (lambda meta, arrays: meta.pop("schema"), "no schema"),
        (lambda meta, arrays: meta.pop("pairs"), "'pairs' is missing"),
        (lambda meta, arrays: meta.update(chosen=[9]), "a set of effects"),
        (lambda meta, arrays: meta["columns"][0].update(joints=[5]), "columns: (5,)"),
        (lambda meta, arrays: meta.update(uncertainty="much"), "uncertainty"),
        (lambda meta, arrays: arrays.pop("gram"), "gram"),
        (lambda meta, arrays: arrays.update(gram=np.eye(3)), "gram has shape (3, 3)"),
        (lambda meta, arrays: arrays["scale"].fill(np.nan), "scale holds"),
        (lambda meta, arrays: arrays.pop("meta"), "meta"),
    ],
)
def test_open_questions_of_another_version_or_with_wrong_numbers_are_refused(spoil, said, folder):
    path = folder / undecided.FILE
    with np.load(path) as file:
        arrays = dict(file)
    meta = json.loads(str(arrays["meta"]))
    spoil(meta, arrays)
    arrays |= {"meta": np.array(json.dumps(meta))} if "meta" in arrays else {}
    np.savez(path, **arrays)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError) as error:
        load_undecided(folder)
    assert said in str(error.value) and "diagnose again" in str(error.value)


@pytest.mark.parametrize("name", ["model.json", undecided.FILE])
@pytest.mark.parametrize("damage", ["gone", "empty", "cut", "flipped", "text", "list", "deep", "folder", "array"])
def test_a_damaged_folder_is_refused_with_one_line(name, damage, folder, capsys, tmp_path):
    path, rng = folder / name, np.random.default_rng(0)
    content = bytearray(path.read_bytes())
    path.unlink()
    if damage == "folder":
        path.mkdir()
    elif damage == "array":
        with path.open("wb") as file:
            np.save(file, np.eye(3))
    elif damage != "gone":
        for place in rng.integers(len(content), size=60):
            content[place] ^= 0x55
        new = {"empty": b"", "cut": bytes(content[: len(content) // 2]), "flipped": bytes(content), "text": b"\xff\xfe",
               "list": b"[1, 2]", "deep": b"[" * 10**5}  # fmt: skip
        path.write_bytes(new[damage])
    assert name in refused(capsys, "excite", folder, "--out", tmp_path / "m.csv")
    assert not (tmp_path / "m.csv").exists()


def test_bytes_of_open_questions_flipped_anywhere_never_end_in_another_error(whole, tmp_path):
    content, rng = (whole / undecided.FILE).read_bytes(), np.random.default_rng(1)
    for _ in range(150):
        spoilt = bytearray(content)
        for place in rng.integers(len(content), size=rng.integers(1, 4)):
            spoilt[place] ^= 1 << rng.integers(8)
        (tmp_path / undecided.FILE).write_bytes(bytes(spoilt))
        try:
            load_undecided(tmp_path)
        except InputError as error:
            assert "\n" not in str(error)


@pytest.mark.parametrize("load", [load_model, load_corrected, load_undecided])
def test_a_file_in_place_of_the_folder_is_refused(load, tmp_path):
    (tmp_path / "d").write_text("x")
    for name in ("d", "absent"):
        with pytest.raises(InputError):
            load(tmp_path / name)


def test_predict_refuses_a_model_of_another_schema(folder, capsys, tmp_path):
    data = json.loads((folder / "model.json").read_text())
    (folder / "model.json").write_text(json.dumps(data | {"schema": 99}))
    said = refused(capsys, "predict", folder, tmp_path / "r.csv", "--out", tmp_path / "p.csv")
    assert "schema 99" in said
