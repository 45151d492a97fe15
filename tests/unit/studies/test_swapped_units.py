"""Files whose loads or times are a factor of units apart are named; tests that merely differ are not."""

import numpy as np
import pytest

from creepkit.records import History, constant_stress
from creepkit.studies.proposal import propose_study
from creepkit.studies.swapped_units import swapped_units

HOUR = 3600.0


def bar(source, stress, hours=100.0, rate=1e-8, temperature=1000.0):
    """A steady curve, as a file of right units gives it."""
    times = np.linspace(0.01, 1.0, 30) * hours * HOUR
    return History(source, times, {"strain": rate * times}, constant_stress(stress), temperature, source=source)


def test_loads_in_ksi_are_found():
    tests = [bar("a.csv", 100.0), bar("a.csv", 150.0), bar("b.csv", 14.5), bar("b.csv", 21.76)]
    (said,) = swapped_units(tests)
    assert said == (
        "loads of 'a.csv' are those of 'b.csv' times 6.895, as of ksi and MPa: are the units of both files right?"
    )


def test_loads_in_psi_are_found():
    (said,) = swapped_units([bar("a.csv", 100.0), bar("b.csv", 14504.0)])
    assert "'b.csv' are those of 'a.csv' times 145, as of MPa and psi" in said


@pytest.mark.parametrize(("factor", "units"), [(60.0, "as of min and s"), (3600.0, "as of h and s")])
def test_times_of_repeated_tests_in_another_unit_are_found(factor, units):
    """Rates scatter by a third, and the tests last unlike long."""
    slow = bar("a.csv", 100.0, hours=300.0, rate=1.3e-8)
    (said,) = swapped_units([slow, bar("b.csv", 100.0, hours=100.0 / factor, rate=1e-8 * factor)])
    assert f"times of 'a.csv' are about {factor:g} times those of 'b.csv', {units}" in said


def test_tests_that_last_alike_but_for_a_unit_are_found():
    (said,) = swapped_units([bar("a.csv", 100.0), bar("b.csv", 80.0, hours=100.0 / 3600.0)])
    assert "as of h and s" in said


def test_tests_that_merely_differ_are_not_named():
    loads = [bar(f"{s}.csv", s, rate=1e-8 * (s / 100.0) ** 5, hours=2e11 * s**-4.7) for s in (40.0, 60.0, 90.0, 140.0)]
    assert swapped_units(loads) == []
    assert swapped_units([bar("a.csv", 100.0)]) == []
    six = [bar("a.csv", 17.4, rate=1e-9), bar("b.csv", 120.0, rate=1e-9 * 6.9**4)]  # by chance 6.9 times, n = 4
    assert swapped_units(six) == []
    assert swapped_units([bar("a.csv", 100.0), bar("b.csv", 100.0, temperature=1100.0, rate=6e-7)]) == []


def test_a_proposal_warns(tmp_path):
    for name, stress in (("a", 100.0), ("b", 14.5)):
        rows = "\n".join(f"{t},{1e-8 * t}" for t in np.linspace(100.0, 3.6e5, 30))
        (tmp_path / f"{name}.csv").write_text("# temperature_C: 700\ntime_s,strain_1,stress_MPa\n"
                                              + "\n".join(f"{row},{stress}" for row in rows.splitlines()))  # fmt: skip
    proposal = propose_study(tmp_path, tmp_path / "study.toml")
    assert "# Check the units: loads of 'a.csv' are those of 'b.csv' times 6.895" in proposal.text
    assert any(line.startswith("check the units: ") for line in proposal.summary)
