"""The committed feature table and the numbers that follow from it."""

import json

import numpy as np
import pytest

from registration_core.fitted import PATH
from registration_core.fitting.__main__ import check, differences, written
from registration_core.fitting.numbers import last_rounds
from registration_core.fitting.table import FeatureTable, from_units, in_units, read_table
from registration_core.judge import pixel_evidence as evidence


@pytest.fixture(scope="module")
def table() -> FeatureTable:
    return read_table()


@pytest.mark.slow
def test_the_committed_numbers_are_what_the_committed_table_gives(capsys) -> None:
    assert check() == 0
    assert "are what the feature table gives" in capsys.readouterr().out


def test_a_number_edited_by_hand_is_named() -> None:
    committed = json.loads(PATH.read_text(encoding="utf-8"))
    edited = json.loads(PATH.read_text(encoding="utf-8"))
    edited["judge"]["prior"] += 1.0
    edited["doubts"][0] -= 0.2
    assert differences(committed, committed) == []
    assert differences(edited, committed) == ["fitted.json: judge: prior", "fitted.json: doubts"]
    del edited["made"]["seed"]
    assert "fitted.json: made" in differences(edited, committed)


def test_the_file_is_written_as_json_again() -> None:
    committed = json.loads(PATH.read_text(encoding="utf-8"))
    assert json.loads(written(committed)) == committed
    assert written(committed) == PATH.read_text(encoding="utf-8")


def test_table_survives_its_file(table, tmp_path) -> None:
    table.write(tmp_path / "table.npz")
    again = read_table(tmp_path / "table.npz")
    assert again.hash() == table.hash()
    assert len(again.choices()) == len(table.lengths)


def test_table_is_consistent(table) -> None:
    assert table.features.shape == (table.lengths.sum(), evidence.COUNT + 2)
    assert table.counts.shape[2] == evidence.COUNT
    assert table.scores.shape == table.won_right.shape == table.won_exact.shape
    assert len(set(table.families.tolist())) >= 5


def test_units_hold_features_to_a_fraction_of_a_pixel() -> None:
    values = np.array([0.0, 0.123, -3.4])
    np.testing.assert_allclose(from_units(in_units(values)), values, atol=0.002)


def test_a_snap_ends_after_the_round_that_made_it_sure() -> None:
    claims = np.array([[0.95, 0.99, 0.99], [0.5, 0.95, 0.99], [0.5, 0.6, 0.99]])
    np.testing.assert_array_equal(last_rounds(claims, [0.9, 0.9]), [0, 1, 2])
