"""The conditioned domain: rates in closed form, fractions, stress scales, every registered law."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import DatasetError
from creepkit.language import temperature
from creepkit.records import Status
from creepkit.sampling.coefficients import term_groups
from creepkit.sampling.conditions import creep_output, hold_times, planned_test, specimen_conditions
from creepkit.sampling.domains import (
    DrawCriterion,
    OutcomeCriterion,
    SimulationOutcome,
    paper_criteria,
    sampling_design,
)
from helpers.cantilever import Cantilever
from helpers.mistakes import said_otherwise
from helpers.registered_laws import registered_laws

DIMPLE, BAR = ck.specimen("bulge"), ck.specimen("uniaxial")
HOURS_12 = 43200.0
K, KAPPA = 14.69, 42.3
"""sigma*/P and mm of amplitude per unit of strain of the paper's dimple at small deflection."""


def columns(draws, law):
    return dict(zip(law.names, draws.parameters.T, strict=True))


def reference(draws):
    return K * np.sqrt(draws.condition("P1") * draws.condition("P2"))


# ---- rates ----------------------------------------------------------------------------------------------------------


def test_the_rate_of_nortons_law_lies_where_creep_is_visible_and_the_test_lasts():
    draws = sampling_design(ck.law("norton"), DIMPLE).draw(0, 2048, seed=2)
    p = columns(draws, ck.law("norton"))
    strain = np.log10(p["A"] * reference(draws) ** p["n"] * HOURS_12)
    low, high = np.log10(0.5 * 0.02 / KAPPA), np.log10(0.2)
    assert low < strain.min() < low + 0.01
    assert high - 0.01 < strain.max() < high
    assert abs(strain.mean() - (low + high) / 2) < 2e-3  # uniform in the logarithm


def test_mixtures_have_the_shares_and_the_total_that_were_drawn():
    """Rates of Eq. (2) by hand, averaged over the test where time enters: mean of t^m is T^m/(1+m)."""
    law = ck.law("combined")
    draws = sampling_design(law, DIMPLE).draw(0, 2048, seed=2)
    p, stress = columns(draws, law), reference(draws)
    time = (np.arange(12) + 0.5) / 12 * HOURS_12
    terms = np.stack(
        [
            p["A_1"] * np.sinh(stress / p["B"]) ** p["n_1"],
            p["A_2"] * stress ** p["n_2"] * 0.01 ** p["m_1"],
            p["A_3"] * stress ** p["n_3"] * (time ** p["m_2"][:, None]).mean(axis=1),
        ]
    )
    total = np.log10(terms.sum(axis=0) * HOURS_12)
    assert total.min() > np.log10(0.5 * 0.02 / KAPPA) - 1e-9
    assert total.max() < np.log10(0.2) + 1e-9
    there = (terms > 0).sum(axis=0)
    np.testing.assert_allclose([np.mean(there == k) for k in (1, 2, 3)], [0.6, 0.3, 0.1], atol=0.005)
    alone = terms[:, there == 1] > 0
    np.testing.assert_allclose(alone.mean(axis=1), np.full(3, 1 / 3), atol=0.01)
    # Two shares of a symmetric Dirichlet distribution of .7: mean 1/2, variance 1/(4 (2 x .7 + 1)).
    pairs = terms[:2, (there == 2) & (terms[2] == 0)]
    share = pairs[0] / pairs.sum(axis=0)
    np.testing.assert_allclose([share.mean(), share.var()], [0.5, 1 / (4 * 2.4)], atol=0.02)


def test_stress_scales_are_drawn_by_their_ratio_and_no_law_is_nearly_plastic():
    law = ck.law("hyperbolic-sine")
    draws = sampling_design(law, DIMPLE).draw(0, 2048, seed=2)
    p = columns(draws, law)
    x = reference(draws) / p["B"]
    assert x.min() >= 0.05 * (1 - 1e-9)
    assert 3.9 < x.max() <= 4 * (1 + 1e-9)
    # d ln sinh^n(x) / d ln x = n x coth x; the cells of the search are 1/32 of the range wide.
    assert (p["n"] * x / np.tanh(x)).max() < 12 + 8 * 4 / 32


def test_a_threshold_stress_lies_below_the_reference_stress():
    law = ck.law("threshold-stress")
    draws = sampling_design(law, DIMPLE).draw(0, 512, seed=2)
    threshold = next(k for k, param in enumerate(law.params.values()) if param.unit == "MPa")
    assert (draws.parameters[:, threshold] < reference(draws)).all()


def test_a_law_of_temperature_has_its_rate_at_the_temperature_of_the_test():
    law = ck.law("norton").times(ck.arrhenius(T_ref=1073))
    draws = sampling_design(law, DIMPLE, temperature=(1000.0, 1150.0)).draw(0, 512, seed=2)
    p, T = columns(draws, law), draws.condition("temperature")
    warm = np.exp(-p["Q"] / 8.314462618 * (1 / T - 1 / 1073.0))
    strain = np.log10(p["A"] * reference(draws) ** p["n"] * warm * HOURS_12)
    assert np.log10(0.5 * 0.02 / KAPPA) - 1e-9 < strain.min()
    assert strain.max() < np.log10(0.2) + 1e-9


@pytest.mark.parametrize(("name", "exponent"), [("kachanov-rabotnov", "chi"), ("liu-murakami", "p")])
def test_a_test_takes_a_share_of_the_life_of_a_law_with_damage(name, exponent):
    """Rupture after 1/(B s^p) at constant stress by Liu and Murakami; v = B s^chi t^(1+m)/(1+m) by Kachanov."""
    law = ck.law(name)
    draws = sampling_design(law, BAR, stress_1=100.0, stress_2=100.0).draw(0, 512, seed=2)
    p = columns(draws, law)
    spent = p["B"] * 100.0 ** p[exponent] * HOURS_12
    if "m" in p:
        spent *= (((np.arange(12) + 0.5) / 12 * HOURS_12) ** p["m"][:, None]).mean(axis=1)
    assert 0.03 * 0.97 < spent.min() < 0.031
    assert 0.67 < spent.max() < 0.7 * 1.03


# ---- every law ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", registered_laws())
def test_every_registered_law_has_a_box_or_says_why_not(name):
    """Rates of diffusion creep, in the bounds of its laws, hardly reach the highest ones wanted."""
    law = registered_laws()[name]
    warm = {"temperature": (1000.0, 1100.0)} if law.uses(temperature) else {}
    if name == "norton-bailey-strain":
        with pytest.raises(DatasetError, match="no linear rate coefficient .* use the paper's sampling domain"):
            sampling_design(law, DIMPLE, **warm)
        return
    design = sampling_design(law, DIMPLE, **warm)
    draws = design.draw(0, 64, seed=1)
    assert np.isfinite(draws.parameters).all()
    met = [c.passes(law, draws) for c in design.criteria if isinstance(c, DrawCriterion)]
    assert np.all(met, axis=0).mean() >= {"coble": 0.65, "nabarro-herring": 0.8}.get(name, 0.85)


def test_terms_that_share_a_coefficient_are_one_part():
    """Blackburn's A multiplies all three terms, beside the combined law's own three."""
    parts = term_groups(ck.law("combined") + ck.law("blackburn"))
    assert [len(part.law.terms) for part in parts] == [1, 1, 1, 3]


# ---- what they give -------------------------------------------------------------------------------------------------


def informative_share(design, specimen, samples):
    """Share of the first samples that meet every criterion, simulated."""
    draws, good = design.draw(0, samples, seed=1), 0
    for row in range(samples):
        test = planned_test(specimen, dict(zip(draws.condition_names, draws.conditions[row], strict=True)), design.grid)
        at = hold_times(test)
        times = np.union1d(test.times[::24], at)
        values = dict(zip(design.law.names, draws.parameters[row].tolist(), strict=True))
        found = specimen.predict(design.law, design.law.to_internal(values), [test.replace(times=times)])
        seen = found.of(0)
        end = SimulationOutcome(times, seen, seen[np.searchsorted(times, at)], Status(int(found.status[0, 0])), 0.0, {})
        good += all(c.passes(end) for c in design.criteria if isinstance(c, OutcomeCriterion))
    return good / samples


def test_at_least_80_percent_of_dimples_do():
    assert informative_share(sampling_design(ck.law("norton"), DIMPLE), DIMPLE, 16) >= 0.8


# ---- any specimen ----------------------------------------------------------------------------------------------------

# Specimens that no module knows by name: their conditions, tests and reference stresses come from their records.


BEAM, NORTON = Cantilever(), ck.law("norton")


def test_conditions_are_those_of_the_record() -> None:
    known = specimen_conditions(BEAM)
    assert known.names == (
        "force_1", "force_2", "jump_time", "end_time", "span", "breadth", "height", "temperature",
    )  # fmt: skip
    assert known.required == ("force_1",)
    assert [known.unit(name) for name in known.names] == ["N", "N", "s", "s", "mm", "mm", "mm", "K"]
    relaxation = specimen_conditions(ck.specimen("relaxation"))
    assert relaxation.names == ("modulus", "strain_1", "strain_2", "jump_time", "end_time", "temperature")
    assert [relaxation.unit(name) for name in relaxation.names] == ["MPa", "", "", "s", "s", "K"]


def test_the_range_of_the_load_is_that_of_both_its_levels() -> None:
    dimple = ck.specimen("bulge")
    both = sampling_design(NORTON, dimple, pressure=(5, 20))
    assert both == sampling_design(NORTON, dimple, P1=(5, 20), P2=(5, 20))
    with pytest.raises(DatasetError, match="the range of pressure is that of both its levels, and P2 has one as well"):
        sampling_design(NORTON, dimple, pressure=(5, 20), P2=20)


def test_rates_of_a_beam_lie_where_its_deflection_is_visible_and_the_test_lasts() -> None:
    """By hand, for tests without a jump: 12 h at the reference stress."""
    design = sampling_design(NORTON, BEAM, force_1=10.0, force_2=10.0, span=(40.0, 60.0))
    draws = design.draw(0, 512, seed=2)
    stress = 0.7 * 6.0 * 10.0 * draws.condition("span") / (10.0 * 2.0**2)
    strain = np.log10(draws.parameters[:, 0] * stress ** draws.parameters[:, 1] * HOURS_12)
    lowest = np.log10(0.5 * 0.02 / (draws.condition("span") ** 2 / 6.0))
    share = (strain - lowest) / (np.log10(0.2) - lowest)
    assert -1e-9 < share.min() < 0.01
    assert 0.99 < share.max() < 1 + 1e-9
    assert abs(share.mean() - 0.5) < 3e-3  # uniform in the logarithm


def test_an_output_that_falls_shows_creep_by_its_fall() -> None:
    shown = creep_output(ck.specimen("relaxation"))
    assert (shown.falls, shown.column, str(shown.output)) == (True, 0, "stress")
    criteria = {c.name: c for c in paper_criteria(ck.specimen("relaxation"))}
    assert list(criteria) == ["1", "2", "3", "4"]  # a stress that has relaxed is no rejection
    marks = np.array([300.0, 280.0, 420.0, 400.0])[:, None]
    fallen = SimulationOutcome(np.arange(4.0), marks, marks, Status.COMPLETE, 4.0, {}, falls=True)
    assert fallen.creep_in_holds == (20.0, 20.0)
    assert criteria["4"].passes(fallen)
    risen = SimulationOutcome(np.arange(4.0), marks[::-1], marks[::-1], Status.COMPLETE, 4.0, {}, falls=True)
    assert not criteria["4"].passes(risen)


class Silent(ck.PerTest):
    """A specimen that says nothing but what PerTest asks for."""

    name, title = "silent", "A specimen that says little"
    outputs = ("deflection",)

    def one(self, law, values, history, nuisances):
        return {"deflection": history.times}


def saying(**said):
    return type("Saying", (Silent,), said)()


FORCE = {"loads": (ck.Load("force", "force"),)}
RANGE = {**FORCE, "conditions": {"force": (5.0, 20.0)}}
NOISE = {**RANGE, "outputs": (ck.Output("deflection", "length", noise=0.002),)}


BEAM_MISTAKES = [
    ({"P1": (5, 20)}, "a cantilever test has no condition 'P1'"),
    ({"modulus": 1e5}, "a cantilever test has no condition 'modulus'"),
    ({"force_1": (10, 20)}, "force_2 from 5 to 20 N reaches below force_1, 10 to 20 N"),
    ({"jump_time": (7200, 90000)}, "jump_time reaches 90000 s"),
    ({"span": "long"}, r"condition 'span' is 'long'; give a number or \(low, high\) in mm"),
]
UNSAID = [
    ({}, r"add the attribute loads = \(ck.Load"),
    (FORCE, r'add the attribute conditions = {"force": \(low, high\)}, in N'),
    ({**FORCE, "conditions": {"farce": (5.0, 20.0)}}, r"add the attribute conditions"),
    ({**RANGE, "conditions": {"force": (5.0, 20.0), "spam": (1.0, 2.0)}}, "`conditions` name 'spam', which no test"),
    (RANGE, r'write ck.Output\("deflection", "number", noise=...\)'),
    (NOISE, r"add the method reference_stress\(self, history\)"),
    ({**NOISE, "reference_stress": lambda self, h: 1.0}, r"add the method growth_per_strain\(self, history\)"),
    (
        {**NOISE, "reference_stress": lambda self, h: float("nan"), "growth_per_strain": lambda self, h: 1.0},
        r"its reference_stress\(history\) gives 0 for a planned test",
    ),
]


def test_what_a_record_does_not_say_and_what_is_no_design_of_a_beam_is_a_sentence() -> None:
    designs = [(partial(sampling_design, NORTON, BEAM, **changes), told) for changes, told in BEAM_MISTAKES]
    unsaid = [(lambda said=said: sampling_design(NORTON, saying(**said)).draw(0, 4, 1), told) for said, told in UNSAID]
    assert not said_otherwise([*designs, *unsaid], DatasetError)
