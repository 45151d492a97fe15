"""Studies of tables of minimum rates and rupture times: what is proposed, columns left out, and bounds of Q."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse import candidates
from creepkit.studies.inputs import input_files
from creepkit.studies.proposal import propose_study
from creepkit.studies.study_file import parse_study
from helpers.rate_tables import GAS_CONSTANT

EXPONENT, ENERGY = 6.5, 430e3


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """15 tests whose rates are a power law at 1e-5 1/h at 150 MPa, 600 C, and which break ten times before Norton's."""
    rng, rows = np.random.default_rng(0), ["test,stress_MPa,T (C),min creep rate (1/h),t_r (h),heat"]
    for T, stresses in (
        (550, (200, 220, 240, 270, 300)),
        (600, (110, 130, 150, 175, 200)),
        (650, (60, 70, 85, 100, 125)),
    ):
        for stress in stresses:
            factor = np.exp(-ENERGY / GAS_CONSTANT * (1.0 / (T + 273.15) - 1.0 / 873.15))
            rate = 1e-5 * (stress / 150.0) ** EXPONENT * factor * np.exp(0.1 * rng.standard_normal())
            life = 0.015 / rate * np.exp(0.1 * rng.standard_normal())
            stated = "" if len(rows) % 5 == 0 else f"{rate:.4g}"
            rows.append(f"T{len(rows)},{stress},{T},{stated},{life:.0f},B7")
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "table.csv").write_text("\n".join(rows) + "\n")
    return tmp_path


def identified(folder: Path, identification: str, data: str = "") -> ck.Identification:
    path = folder / "study.toml"
    path.write_text(f'[data]\nfiles = ["data/*.csv"]\n{data}\n[identification]\nstarts = 1\n{identification}\n')
    return ck.Study.load(path).run().rankings[""].best


def test_damage_is_proposed_for_tables_where_it_is_installed(folder, monkeypatch):
    study = folder / "study.toml"
    text = propose_study(folder / "data", study).text
    if "kachanov-rabotnov" in ck.available("laws"):
        assert 'laws = ["norton", "hyperbolic-sine", "kachanov-rabotnov", "sinh-damage"]' in text
        assert "fix = { alpha = 0, m = 0 }" in text
    registered = candidates._law
    monkeypatch.setattr(
        candidates, "_law", lambda name: None if "damage" in name or "rabot" in name else registered(name)
    )
    text = propose_study(folder / "data", study).text
    assert 'laws = ["norton", "hyperbolic-sine"]  #' in text  # no law of hardening of minimum rates without curves
    assert "# No law of damage is installed: rupture times of tests without curves are not used to identify." in text


def test_a_default_study_of_a_law_without_damage_gives_the_rates(folder):
    fit = identified(folder, 'laws = ["norton"]')
    values = {e.name: e for e in fit.estimates}
    _, low, high = fit.rate(150.0, 873.15)
    assert values["n"].low <= EXPONENT <= values["n"].high
    assert values["Q"].low <= ENERGY <= values["Q"].high
    assert low <= 1e-5 / 3600.0 <= high
    without = identified(folder, 'laws = ["norton"]', 'ignore = ["t_r (h)"]')
    assert without.values == pytest.approx(fit.values, rel=1e-6)
    assert len(without.tests) == len(fit.tests) == 12
    used = identified(folder, 'laws = ["norton"]\nrupture_times = "use"')
    assert used.adequacy.rejects


def test_a_factor_of_temperature_is_bounded_and_fixed(folder):
    bounded = identified(folder, 'laws = ["norton"]\nbounds = { Q = [1e5, 4e5] }')
    assert bounded.law.table["Q"].bounds == (1e5, 4e5)
    assert bounded.values["Q"] <= 4e5
    fixed = identified(folder, 'laws = ["norton"]\nfix = { Q = 4.2e5 }')
    assert "Q" not in fixed.values
    one, other = (fixed.rate(150.0, T, warn=False)[0] for T in (873.15, 900.0))
    assert np.log(other / one) == pytest.approx(4.2e5 / GAS_CONSTANT * (1.0 / 873.15 - 1.0 / 900.0), rel=1e-6)
    with pytest.raises(ck.errors.StudyError, match="no law has a parameter 'Q'"):
        identified(folder, 'laws = ["norton"]\ntemperature = "none"\nfix = { Q = 4.2e5 }')


def test_one_law_has_one_set_of_values(folder):
    """The law of the findings and the one beside the forms of temperature."""
    path = folder / "study.toml"
    path.write_text('[data]\nfiles = ["data/*.csv"]\n[identification]\nlaws = ["norton"]\nstarts = 1\n[selection]\n'
                    '[temperature]\nforms = { A = ["arrhenius"], n = ["constant"] }\n')  # fmt: skip
    results = ck.Study.load(path).run()
    best, study = results.rankings[""].best, results.temperature[""]
    assert study.joint_fit.values == best.values
    assert [(e.low, e.high) for e in study.joint_fit.estimates] == [(e.low, e.high) for e in best.estimates]
    law = {e.name: e for e in study.temperature_law.estimates}
    assert law["n"].value == pytest.approx(best.values["n"], rel=0.01)


def test_answers_beside_the_data_are_among_its_files(folder):
    """A report that carries the data of a study carries what was answered about them."""
    data, study = folder / "data", folder / "study.toml"
    (data / "other.csv").write_text("Last (MPa);T (C);t_r (h)\n120;600;900\n")
    (data / "tests.toml").write_text('["other.csv"]\ncolumns = {Last = "stress"}\n')
    files = input_files(parse_study(study, '[data]\nfiles = ["data"]\n'), [data], [])
    assert {one.path.name for one in files} == {"table.csv", "other.csv", "tests.toml"}
