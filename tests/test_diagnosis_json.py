"""A diagnosis as JSON: written as the contract has it, read back the same, refused where it is of another kind."""

import json

import numpy as np
import pytest
from helpers_report import example_document

from irb140_jax.errors import InputError
from irb140_jax.mismatch import Diagnosis, load_diagnosis
from irb140_jax.mismatch.records import digits, plain, rounded
from irb140_jax.mismatch.result import Estimate


def test_a_diagnosis_read_back_is_the_same_and_its_entries_stand_in_the_contracts_order():
    diagnosis = Diagnosis.from_json(example_document())
    text = json.dumps(diagnosis.to_json())
    assert Diagnosis.from_json(json.loads(text)) == diagnosis
    assert json.loads(text) == example_document()
    assert list(diagnosis.to_json()) == [
        "schema", "verdict", "findings", "unexplained", "not_testable", "fit", "notes", "provenance", "summary",
    ]  # fmt: skip
    assert list(diagnosis.to_json()["findings"][0]) == [
        "effect", "joints", "where", "parameters", "evidence", "certain", "alternatives",
    ]  # fmt: skip


def test_numbers_have_six_digits_and_what_is_not_finite_is_null():
    rough = Estimate(np.float64(1.23456789), float("inf"), "N m")
    assert plain(rounded({"viscous": rough})) == {"viscous": {"value": 1.23457, "std": None, "unit": "N m"}}


def test_an_entry_that_this_version_does_not_know_is_no_obstacle():
    assert Diagnosis.from_json(example_document() | {"later": 1}) == Diagnosis.from_json(example_document())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": 1}, "schema 1, this version reads and writes schema 2"),
        ({"verdict": "perhaps"}, "verdict can't be 'perhaps'"),
        ({"findings": "none"}, "findings can't be 'none'"),
        ({"findings": [{"effect": "payload"}]}, "'joints' is missing"),
        ({"fit": {"joint1": {"rmse_nominal": "small"}}}, "rmse_nominal can't be 'small'"),
        ({"summary": True}, "summary can't be 'True'"),
    ],
)
def test_a_diagnosis_of_another_schema_or_with_wrong_entries_is_refused_with_one_line(change, said, tmp_path):
    (tmp_path / "diagnosis.json").write_text(json.dumps(example_document() | change))
    with pytest.raises(InputError) as error:
        load_diagnosis(tmp_path)
    assert said in str(error.value) and "diagnose again" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("content", ["", "{", "[1, 2]", "[" * 10**5, "\0"])
def test_a_broken_file_is_refused(content, tmp_path):
    (tmp_path / "diagnosis.json").write_text(content)
    with pytest.raises(InputError, match="diagnose again"):
        load_diagnosis(tmp_path)


def test_a_folder_without_a_diagnosis_is_refused(tmp_path):
    with pytest.raises(InputError, match="holds no diagnosis.json"):
        load_diagnosis(tmp_path)


@pytest.mark.parametrize(
    ("x", "count", "said"), [(431.2, 2, "430"), (12.0, 1, "10"), (0.0571, 2, "0.057"), (5.0, 2, "5")]
)
def test_numbers_of_sentences_have_no_exponent(x, count, said):
    assert digits(x, count) == said
