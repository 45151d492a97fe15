"""Tables of compositions: atomic per cent, classes, and what is wrong with a table."""

import numpy as np
import pytest

from creepkit.screening.alloys import ATOMIC_WEIGHTS, Compositions, atomic_percent, read_compositions


def written(folder, text):
    path = folder / "compositions.csv"
    path.write_text(text)
    return path


def test_weight_becomes_atomic_per_cent_as_in_a_textbook():
    """TiAl alloy of 64.0 wt.% Ti: Ti50Al50 by the masses 47.867 and 26.982 (50 at.% = 63.95 wt.%)."""
    found = atomic_percent({"Ti": 100 * 47.867 / (47.867 + 26.982), "Al": 100 * 26.982 / (47.867 + 26.982)})
    np.testing.assert_allclose([found["Ti"], found["Al"]], 50.0, rtol=1e-12)


def test_atomic_per_cent_of_316l_against_hand_arithmetic():
    """Fe 68, Cr 17, Ni 12, Mo 3 wt.%: moles 1.21766, .32695, .20445, .03127, in all 1.78033."""
    found = atomic_percent({"Fe": 68.0, "Cr": 17.0, "Ni": 12.0, "Mo": 3.0})
    expected = {"Fe": 68.395, "Cr": 18.365, "Ni": 11.484, "Mo": 1.756}
    assert found == pytest.approx(expected, abs=2e-3)


def test_masses_are_those_of_iupac():
    """A few of the standard atomic weights of 2021, as printed there to five digits."""
    told = {"Fe": 55.845, "Ni": 58.693, "Co": 58.933, "Cr": 51.996, "Mo": 95.95, "W": 183.84, "Al": 26.982, "Y": 88.906}
    assert {name: ATOMIC_WEIGHTS[name] for name in told} == told


def test_classes_follow_the_principal_element_unless_the_second_is_near():
    table = Compositions({"a": {"Fe": 70.0, "Cr": 30.0}, "b": {"Co": 40.0, "Ni": 35.1, "Cr": 24.9}, "c": {"Ni": 100.0}})
    assert [table.class_of(name) for name in "abcd"] == ["Fe-rich", "near-equimolar", "Ni-rich", "unknown"]


def test_five_atomic_per_cent_apart_is_not_near():
    assert Compositions({"a": {"Co": 40.0, "Ni": 35.0}}).class_of("a") == "Co-rich"


def test_a_table_is_read_in_its_unit(tmp_path):
    weights = read_compositions(written(tmp_path, "# unit: wt.%\nalloy,Ti,Al\nX,63.951,36.049\n"))
    assert weights.atomic["X"] == pytest.approx({"Ti": 50.0, "Al": 50.0}, abs=1e-2)
    shares = read_compositions(written(tmp_path, "# unit: at.%\nalloy,Ti,Al,Nb\nX,50,50,\n"))
    assert shares.atomic["X"] == {"Ti": 50.0, "Al": 50.0}


def test_an_alloy_that_the_table_lacks_is_named():
    told = Compositions({"alloy 1": {"Fe": 100.0}}, "table.csv").missing(["alloy 1", "aloy 1"])
    assert told == (
        "table.csv: no alloy 'aloy 1', whose class stays unknown; did you mean 'alloy 1'? (known: alloy 1)",
    )
