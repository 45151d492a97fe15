"""Cards for other codes: read back by their grammars, the formulas of the codes' manuals give the law's own rate."""

import dataclasses
import re
from functools import cache
from itertools import product

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import qmc

import creepkit as ck
from creepkit.errors import ExportError
from creepkit.exporters.material_cards import AbaqusCards, AnsysCards, CalculixCards, CodeAsterMaterial
from creepkit.exporters.moose_neml2 import MooseBlock, Neml2Model
from creepkit.kernels import lower
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language import (
    GAS_CONSTANT,
    CreepLaw,
    Elastic,
    arrhenius,
    linear,
    mean_stress,
    parameters,
    stress,
    wachtman,
)
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import LawWithValues, Units
from creepkit.registry import default_registry, kinds
from helpers.creep_form_cases import CASES, COMBINED, EXPONENTIAL, HAS, STEEL, valued
from helpers.input_file_parsers import READERS, abaqus, abaqus_cards, ansys_commands, aster_keywords, code_aster, hit
from helpers.paths import GOLDEN
from helpers.registered_laws import registered_laws

EXPORTERS = {e.name: e for e in (AbaqusCards(), AnsysCards(), MooseBlock(), CodeAsterMaterial(), Neml2Model())}
EVERY = {**EXPORTERS, "calculix-cards": CalculixCards()}
EXACT = cache(MultiprecisionLaw)
UNITS = [Units(), Units("Pa", "h"), Units("psi", "min")]
TABLES = {
    "strain hardening with temperature",
    "time hardening with temperature",
    "time hardening with temperature, small",
    "other notation",
}
"""Cases that Abaqus takes as a table against temperature."""


def exported(name: str, case: str, units: Units | None = None) -> str:
    source = CASES[case].replace(units=units or Units())
    return EXPORTERS[name].text(source if name != "neml2" else source.replace(elastic=STEEL))


def points(count: int) -> list[list[float]]:
    """Stress 20 to 200 MPa, strain 1e-5 to 0.2, time 1 to 1e7 s, temperature 900 to 1250 K."""
    low, high = np.log([20.0, 1e-5, 1.0, 900.0]), np.log([200.0, 0.2, 1e7, 1250.0])
    return np.exp(qmc.scale(qmc.Sobol(4, seed=7).random(count), low, high)).tolist()


def true_rate(source: LawWithValues, s: float, e: float, t: float, T: float) -> float:
    """The rate, 1/s, in 50 digits."""
    return mpmath.fsum(EXACT(source.law).term_and_state_rates([s, e, t, T, s, s / 3], source.values.values()))


# ---- the round trip ------------------------------------------------------------------------------------------------


def test_the_manuals_formula_gives_the_laws_rate():
    bad = []
    accepted = [(name, case) for name, cases in HAS.items() for case in sorted(cases)]
    for (name, case), units in product(accepted, UNITS):
        rate, source = READERS[name](exported(name, case, units)), CASES[case]
        for s, e, t, T in points(16):
            if name == "abaqus-cards" and case in TABLES:
                T = 873.15 + round(T - 873.15)  # a row of the table
            found = rate(s / units.megapascals, e, t / units.seconds, T) / units.seconds
            true = float(true_rate(source, s, e, t, T))
            bad += [] if found == pytest.approx(true, rel=1e-10) else [f"{case} as {name}: {found}, not {true}"]
    assert not bad, "\n".join(bad)


@pytest.mark.parametrize("case", sorted(TABLES))
def test_between_the_rows_of_a_table_abaqus_is_within_a_thousandth(case):
    """Linear interpolation of a convex function lies above it."""
    rate, source = abaqus(exported("abaqus-cards", case)), CASES[case]
    temperatures = np.arange(873.2, 1273.0, 0.3)
    truth = lower(source.law, "numpy").rate(
        source.values, stress=100.0, strain=0.01, time=1e4, temperature=temperatures
    )
    errors = [rate(100.0, 0.01, 1e4, T) / true - 1 for T, true in zip(temperatures, truth, strict=True)]
    assert -1e-11 < min(errors) < 1e-4 < max(errors) < 1e-3


def test_calculix_has_powers_of_stress_and_time_with_a_coefficient_from_1e_20_on():
    """ccx 2.20 creeps by A = 1e-20 where less is written: a bar at 100 MPa for 1000 h has PEEQ 3.6e-4 of n = 5."""
    for case in ("norton", "time hardening", "time hardening with temperature", "norton with temperature"):
        source = CASES[case].replace(elastic=STEEL, units=Units("GPa", "h"))
        text, rate = CalculixCards().text(source), abaqus(CalculixCards().text(source))
        for s, e, t, T in points(8):
            T = 873.15 + round(T - 873.15)
            true = float(true_rate(source, s, e, t, T))
            assert rate(1e-3 * s, e, t / 3600, T) / 3600 == pytest.approx(true, rel=1e-10), case
        cards = abaqus_cards(text)
        assert [row[2:] for row in cards["ELASTIC"][1]] == [row[3:] for row in cards["CREEP"][1]], case
    for case, why in {
        "strain hardening": "not rate = A q",
        "time hardening, small": "creeps by 1e-20 where less",
    }.items():
        with pytest.raises(ExportError, match=f"{why}.*; export it as 'calculix'"):
            CalculixCards().text(CASES[case])


def test_what_a_code_does_not_have_is_refused_with_a_way_out():
    refused = [(name, case) for name, cases in HAS.items() for case in sorted({*CASES} - cases)]
    for name, case in refused:
        with pytest.raises(ExportError, match=rf"^law '{re.escape(CASES[case].law.name)}'.*; export it as '"):
            exported(name, case)


# ---- published figures ---------------------------------------------------------------------------------------------


def test_moose_power_law_creep_cube():
    """MOOSE's test power_law_creep.i: 10 MPa at 1000 K, its own R; creep strains of its file of results."""
    R, Q = 8.3143, 3e5
    law = NORTON.times(arrhenius(1000.0))
    values = {"A": 1e-15 * 1e24 * np.exp(-Q / (R * 1000.0)), "n": 4.0, "Q": Q * GAS_CONSTANT / R}
    creep = hit(MooseBlock().text(LawWithValues(law, values, units=Units("Pa"))))["Materials"]["power_law"]
    assert float(creep["coefficient"]) == pytest.approx(1e-15, rel=1e-12)
    assert float(creep["n_exponent"]) == 4
    assert float(creep["m_exponent"]) == 0
    assert float(creep["activation_energy"]) / float(creep["gas_constant"]) == pytest.approx(Q / R, rel=1e-12)
    run = ck.simulate(
        law, "uniaxial", values, loading=ck.constant_stress(10.0, "stress"), times=[0.1, 0.5, 1.0], temperature=1000.0
    )
    np.testing.assert_allclose(
        run.outputs["strain"], [0.00021359459285203, 0.0010680153108105, 0.0021360306230979], rtol=1e-4
    )


def test_code_aster_ssnp107():
    """ssnp107a: LEMAITRE with N = 11, UN_SUR_K = 8e-4, UN_SUR_M = 1/5.6, held 3600 s after a plastic ramp.

    210 MPa of tension with 121.24 MPa of shear make 297 MPa; the ramp leaves p = (297 - 120)/H, H = E E_t/(E - E_t).
    code_aster asks for its reference to 1e-3.
    """
    source = LawWithValues(STRAIN_HARDENING, {"A": 8e-4**11, "n": 11.0, "m": -11 * 0.178571429})
    text = CodeAsterMaterial().text(source)
    lemaitre = aster_keywords(text)["LEMAITRE"]
    assert lemaitre == pytest.approx({"N": 11.0, "UN_SUR_K": 8e-4, "UN_SUR_M": 0.178571429}, rel=1e-12)
    tension, shear, E, tangent = 210.0, 4 * 30.31088913, 178600.0, 1930.0
    equivalent = np.hypot(tension, np.sqrt(3) * shear)
    before = (equivalent - 120.0) * (E - tangent) / (E * tangent)
    rate = code_aster(text)
    after = solve_ivp(lambda t, p: [rate(equivalent, p[0], t, 293.0)], (0, 3600), [before], rtol=1e-10).y[0, -1]
    assert after * tension / equivalent == pytest.approx(0.0906364, rel=1e-4)
    assert after * 1.5 * shear / equivalent == pytest.approx(0.0784935, rel=1e-4)


def test_code_aster_ssna104():
    """ssna104a is Newtonian: N = 1, K = 1, UN_SUR_M = 0."""
    text = CodeAsterMaterial().text(LawWithValues(NORTON, {"A": 1.0, "n": 1.0}, elastic=Elastic(1.0, 0.3)))
    assert aster_keywords(text) == {
        "ELAS": {"E": 1.0, "NU": 0.3},
        "LEMAITRE": {"N": 1.0, "UN_SUR_K": 1.0, "UN_SUR_M": 0.0},
    }


def test_abaqus_time_and_strain_hardening_have_one_set_of_constants():
    """Abaqus' manual: at constant stress both are equivalent with the same A, n, m.

    From e = A s^n t^(m+1)/(m+1), A s^n t^m is A^(1/(m+1)) s^(n/(m+1)) [(m+1) e]^(m/(m+1)).
    """
    A, n, m = 3e-13, 4.5, -0.6
    own = A ** (1 / (m + 1)) * (m + 1) ** (m / (m + 1))
    by_time = AbaqusCards().text(LawWithValues(TIME_HARDENING, {"A": A, "n": n, "m": m}))
    by_strain = AbaqusCards().text(LawWithValues(STRAIN_HARDENING, {"A": own, "n": n / (m + 1), "m": m / (m + 1)}))
    (time_law, (constants,)), (strain_law, (same,)) = (abaqus_cards(t)["CREEP"] for t in (by_time, by_strain))
    assert (time_law["LAW"], strain_law["LAW"]) == ("TIME", "STRAIN")
    assert constants == pytest.approx([A, n, m], rel=1e-12)
    assert same == pytest.approx(constants, rel=1e-12)


# ---- what else a card says -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EXPORTERS)
def test_the_header_tells_units_reference_intervals_and_new_names(name):
    head = exported(name, "norton with temperature", Units("Pa", "h"))
    for told in (
        "Numbers below are in Pa and h, temperatures in K: stress is a ratio to 1 Pa, time to 1 h",
        "n = 5.2 [5.1, 5.3]",
        "valid from 973 to 1123 K",
        "A = 1.2e-16 1/s, rate coefficient",
        "Norton (1929)",
    ):
        assert told in head


def test_elastic_moduli_follow_the_unit_of_stress():
    source = CASES["norton"].replace(units=Units("GPa"))
    assert abaqus_cards(EXPORTERS["abaqus-cards"].text(source))["ELASTIC"] == ({}, [[150.0, 0.3]])
    assert [c for c in ansys_commands(EXPORTERS["ansys"].text(source)) if c[0] == "MP"] == [
        ["MP", "EX", "1", "150"],
        ["MP", "PRXY", "1", "0.3"],
    ]
    elasticity = hit(EXPORTERS["moose"].text(source))["Materials"]["elasticity"]
    assert (elasticity["youngs_modulus"], elasticity["poissons_ratio"]) == ("150", "0.3")
    assert aster_keywords(EXPORTERS["code_aster"].text(source))["ELAS"] == {"E": 150, "NU": 0.3}
    assert hit(EXPORTERS["neml2"].text(source))["Models"]["elasticity"]["coefficients"] == "150 0.3"


STEEL_WITH_TEMPERATURE = Elastic(wachtman(210e3, 60.0, 300.0), 0.3)


def test_moduli_that_depend_on_temperature_are_tabulated_or_written_as_a_formula():
    source = CASES["norton with temperature"].replace(elastic=STEEL_WITH_TEMPERATURE, units=Units("Pa"))
    _, rows = abaqus_cards(EXPORTERS["abaqus-cards"].text(source))["ELASTIC"]
    assert (rows[0][2], rows[-1][2]) == (873.15, 1273.15)
    for E, nu, T in rows:
        assert (E, nu) == (pytest.approx(1e6 * (210e3 - 60.0 * T * np.exp(-300.0 / T)), rel=1e-12), 0.3)
    commands = ansys_commands(EXPORTERS["ansys"].text(source))
    T, E = (
        [float(v) for c in commands if c[0] == head for v in c[skip:]] for head, skip in (("MPTEMP", 2), ("MPDATA", 4))
    )
    assert len(E) == 2 * len(T)
    np.testing.assert_allclose(E[: len(T)], [1e6 * (210e3 - 60.0 * t * np.exp(-300.0 / t)) for t in T], rtol=1e-12)
    elastic = aster_keywords(EXPORTERS["code_aster"].text(source))["ELAS_FO"]
    assert elastic["E"](1000.0) == pytest.approx(1e6 * (210e3 - 60e3 * np.exp(-0.3)), rel=1e-12)
    assert elastic["NU"](1000.0) == 0.3


def test_moduli_stand_at_every_temperature_of_a_table_of_creep():
    """CalculiX creeps by the first row of *CREEP at every temperature unless *ELASTIC has a row at each."""
    source = CASES["strain hardening with temperature"].replace(elastic=STEEL)
    cards = abaqus_cards(EXPORTERS["abaqus-cards"].text(source))
    creep, elastic = ([row[-1] for row in cards[keyword][1]] for keyword in ("CREEP", "ELASTIC"))
    assert creep == elastic
    assert len(creep) > 10
    assert {tuple(row[:2]) for row in cards["ELASTIC"][1]} == {(150e3, 0.3)}


def test_names_that_neml2_or_its_file_keep_are_renamed_openly():
    source = CASES["two power laws"].replace(elastic=STEEL)
    for label in ("lambda", "class", "yield", "stress", "E", "strain", "plastic strain", "sum"):
        terms = dict(zip((label, "other"), source.law.terms.values(), strict=True))
        text = ck.export(source.replace(law=dataclasses.replace(source.law, terms=terms)), "neml2")
        name = label.replace(" ", "_")
        assert f"# '{label}' is called {name}_2 here" in text
        assert {f"{name}_2", "other"} <= hit(text)["Models"].keys()


@pytest.mark.parametrize("name", ["moose", "neml2"])
def test_moduli_that_depend_on_temperature_are_refused_where_numbers_are_needed(name):
    with pytest.raises(ExportError, match=r"the elastic moduli depend on temperature.*give elastic.at\(1073\)"):
        EXPORTERS[name].text(CASES["norton"].replace(elastic=STEEL_WITH_TEMPERATURE))


AT, SPL, TPL = dict(A=1e-9, n=4), STRAIN_HARDENING, TIME_HARDENING
A, n = parameters("A n")
MEAN = LawWithValues(CreepLaw("mean", {"creep": A * (stress + mean_stress) ** n}, NORTON.params), AT)
ALL, BENT = valued(COMBINED, **COMBINED.center()), valued(NORTON.with_temperature(n=linear()), n_T=-1e-3, **AT)
REFUSED = [
    ("abaqus-cards", valued(SPL, A=1e-9, n=0, m=-0.5), r"asks for n > 0 .* \(n = 0, m = -0.333333\); export"),
    ("abaqus-cards", valued(EXPONENTIAL, A=1e-9, B=20), "its exponential of stress does not stand alone there"),
    ("abaqus-cards", ALL, r"a sum of 3 \(hyperbolic sine \+ strain hardening \+ time"),
    ("ansys", ALL, "none of Ansys' implicit creep laws.*USERCREEP"),
    ("ansys", BENT, "not a number .constants at one temperature may"),
    ("ansys", valued(NORTON.times(arrhenius(300.0)), Q=2.7e6, **AT), "C1 would be 1e461, .* give the temperature"),
    ("moose", valued(SPL, m=-0.5, **AT), r"power -0.5 of creep strain \(its m_exponent is one of time\)"),
    ("moose", valued(HYPERBOLIC_SINE, B=40, **AT), "no creep model for its sinh of stress"),
    ("code_aster", valued(TPL, m=-0.5, **AT), "is not code_aster's LEMAITRE: time hardening depends on time"),
    ("code_aster", valued(HYPERBOLIC_SINE, B=40, **AT), "is a sinh of stress; export it as 'mfront'"),
    ("neml2", valued(TPL, m=-0.5, **AT), "steady power laws of stress only.*time exponent -0.5"),
    ("neml2", valued(NORTON, **AT), r"needs the moduli; give export\(..., elastic=ck.Elastic"),
    ("calculix-cards", MEAN, "mean.*; export it as 'mfront', which has the principal and the mean stress"),
]


@pytest.mark.parametrize(("name", "source", "message"), REFUSED)
def test_refusals_give_the_reason(name, source, message):
    with pytest.raises(ExportError, match=message) as error:
        EVERY[name].text(source)
    assert "\n" not in str(error.value)


def test_moduli_are_an_argument():
    assert ck.export(NORTON, "neml2", AT, elastic=STEEL) == Neml2Model().text(LawWithValues(NORTON, AT, elastic=STEEL))


def test_a_temperature_makes_a_card_possible():
    """What lies beyond double range at infinite temperature is an ordinary number at the analysis' own."""
    source = valued(NORTON.times(arrhenius(300.0)), A=1e-9, n=4, Q=2.7e6)
    rate = READERS["ansys"](AnsysCards().text(source.at(310.0)))
    assert rate(50.0, 0.0, 0.0, 1.0) == pytest.approx(float(true_rate(source, 50.0, 0.0, 0.0, 310.0)), rel=1e-10)


CODINGS = ["-*- coding: unicode_escape -*- \\x0aharmed = 1 #", "coding: utf-7 +AAo-harmed = 1+AAo-#"]


@pytest.mark.parametrize("title", CODINGS)
def test_no_title_sets_the_encoding_of_a_file_for_code_aster(title):
    """Such a file is Python, whose first two lines may name an encoding (PEP 263) in which a comment has more lines."""
    law = NORTON.rename("norton", title)
    text = CodeAsterMaterial().text(LawWithValues(law, {"A": 1e-16, "n": 4.0}))
    commands = dict.fromkeys(("DEFI_MATERIAU", "_F"), lambda **given: given)
    names = {**commands}
    exec(compile(text.encode(), "law.comm", "exec"), names)
    assert {*names} - {*commands} == {"norton", "__builtins__"}


PROGRAMS = {"c", "javascript", "abaqus", "calculix", "mfront", "python", "numpy"}
UPDATES = {"c-update", "numpy-update", "abaqus-umat", "calculix-umat", "ansys-usermat", "ls-dyna-umat"}
ELSEWHERE = PROGRAMS | UPDATES | {"latex", "markdown", "mathml", "json", "calculix-cards"}
"""Targets judged over all laws by tests of their own; the others are cards, which are read here."""


def test_every_registered_law_gives_a_card_with_its_rate_or_a_reason():
    """In Pa and h, at points spread over what tests visit, by the formulas of the codes' manuals."""
    assert set(default_registry().all(kinds.EXPORTERS)) == {*EXPORTERS, *ELSEWHERE}
    bad, accepted = [], set()
    for law in registered_laws().values():
        source = LawWithValues(law, law.center(), elastic=STEEL, units=Units("Pa", "h"))
        for name, exporter in EXPORTERS.items():
            try:
                rate = READERS[name](exporter.text(source))
            except ExportError as error:
                ways_out = re.findall(r"'([\w-]+)'", str(error).partition("; export it as ")[2])
                bad += [] if ways_out and f"law '{law.name}'" in str(error) else [f"{law.name} as {name}: {error}"]
                for other in ways_out:
                    text = default_registry().one(kinds.EXPORTERS, other).text(source)
                    assert text, f"{law.name} as {other}, which {name} names"
                continue
            accepted.add((law.name, name))
            for s, e, t, T in points(8):
                T = 873.15 + round(T - 873.15)  # a row, where the card is a table
                found, true = rate(1e6 * s, e, t / 3600.0, T) / 3600.0, float(true_rate(source, s, e, t, T))
                bad += [] if found == pytest.approx(true, rel=1e-10) else [f"{law.name} as {name}: {found} for {true}"]
    assert not bad, "\n".join(bad)
    assert {("norton", name) for name in EXPORTERS} <= accepted
    assert len(accepted) >= 20


# ---- golden files --------------------------------------------------------------------------------------------------


def golden_cases() -> dict[str, str]:
    """{file: text}. After a wanted change, write them by hand: golden_cases() items into tests/golden."""
    files = {
        f"{name}_{case.replace(' ', '_').replace(',', '')}{EXPORTERS[name].suffix}": exported(name, case, units)
        for name, case, units in (
            ("abaqus-cards", "norton", None),
            ("abaqus-cards", "strain hardening", Units("Pa", "h")),
            ("abaqus-cards", "time hardening, small", None),
            ("abaqus-cards", "sine with temperature", Units("Pa", "h")),
            ("abaqus-cards", "two power laws with temperature", None),
            ("ansys", "strain hardening with temperature", Units("Pa", "s")),
            ("ansys", "primary and steady with temperature", Units("Pa", "h")),
            ("ansys", "garofalo", None),
            ("moose", "norton with temperature", Units("Pa", "s")),
            ("moose", "primary and steady", None),
            ("code_aster", "strain hardening", None),
            ("code_aster", "norton with temperature", Units("Pa", "h")),
            ("neml2", "norton", None),
            ("neml2", "two power laws with temperature", None),
        )
    }
    short = AbaqusCards().text(CASES["other notation"].replace(ranges={"temperature": (1025.0, 985.0)}))  # 25 K wider
    return files | {"abaqus-cards_other_notation_1000_to_1010_K.inp": short}


def test_cards_are_as_they_were_checked_line_by_line():
    for file, text in golden_cases().items():
        assert text.splitlines() == (GOLDEN / file).read_text(encoding="utf-8").splitlines(), file


def test_a_table_covers_what_the_tests_did():
    law = STRAIN_HARDENING.times(arrhenius(T_ref=1073.15))
    values = {"A": 1e-16, "n": 4.0, "m": -0.3, "Q": 3e5}
    text = AbaqusCards().text(LawWithValues(law, values, ranges={"temperature": (1023.15, 1073.15)}))
    kelvin = [float(line.split(",")[-1]) for line in text.splitlines() if line[:1].isdigit()]
    assert (kelvin[0], kelvin[-1]) == (998.15, 1098.15)
