"""Creep over compositions: planted functions are found, alloys borrow from others, and the best one is proposed."""

from dataclasses import replace

import numpy as np
import pytest
import sympy

import creepkit as ck
from creepkit.composition.forms import LawsByComposition
from creepkit.composition.mapping import map_where_known
from creepkit.composition.regression import CompositionRegression
from creepkit.errors import FitError
from creepkit.records import History, constant_stress
from creepkit.screening.alloys import compositions_of_labels

ELEMENTS = ("Fe", "Ni", "Cr")


def planted(x):
    """ln of a rate over contents x (alloys, 3): a mixture rule and one pair."""
    return x @ np.array([-14.0, -16.0, -17.0]) - 5.0 * x[:, 0] * x[:, 1]


@pytest.fixture(scope="module")
def plate():
    """(contents, sd, alloys' true values, regression) of 40 alloys that scatter by 0.1."""
    rng = np.random.default_rng(3)
    x, sd = rng.dirichlet([1.0] * 3, 40), rng.uniform(0.05, 0.3, 40)
    true = planted(x) + 0.1 * rng.normal(size=40)
    return x, sd, true, CompositionRegression.of(ELEMENTS, x, true + sd * rng.normal(size=40), sd)


def test_the_planted_function_is_found_with_intervals_that_hold(plate):
    x, _, true, found = plate
    at = np.random.default_rng(4).dirichlet([1.0] * 3, 300)
    value, sd = found.predict(at, of_alloy=False)
    assert np.sqrt(np.mean((value - planted(at)) ** 2)) < 0.1
    assert np.mean(np.abs(value - planted(at)) < 1.96 * sd) > 0.9
    assert found.left_out_error < 1.2 * np.sqrt(np.mean((found.values - planted(x)) ** 2))
    assert found.scatter == pytest.approx(0.1, rel=0.6)
    iron, nickel, chromium = sympy.symbols("x_Fe x_Ni x_Cr", nonnegative=True)
    assert set(found.formula.as_coefficients_dict()) == {iron, nickel, chromium, iron * nickel}
    assert found.formula.coeff(iron * nickel) == pytest.approx(-5.0, abs=1.0)
    assert np.abs(found.shared[0] - true).mean() < 0.7 * np.abs(found.values - true).mean()


def test_closed_forms_are_those_of_the_alloys_without_the_one(plate):
    """What others say is the prediction without the alloy; what is shared is the normal posterior of its true value."""
    x, sd, _, found = plate
    others = np.arange(40) != 7
    without = replace(found, contents=x[others], values=found.values[others], sd=sd[others])
    assert [float(v[7]) for v in found.left_out] == pytest.approx(
        [float(v[0]) for v in without.predict(x[7:8])], rel=1e-6
    )
    of_truth = np.asarray(found.kernel(x)) * found.scale**2
    posterior = found.mean + of_truth @ np.linalg.solve(of_truth + np.diag(sd**2), found.values - found.mean)
    assert found.shared[0] == pytest.approx(posterior, abs=1e-6)


def test_an_undecided_alloy_has_the_law_of_its_neighbours():
    rng = np.random.default_rng(1)
    x = rng.dirichlet([1.0] * 3, 30)
    iron = x[:, 0] > x[:, 1]
    weights = [{"norton": 0.02 + 0.96 * (not one), "hyperbolic-sine": 0.02 + 0.96 * one} for one in iron]
    far = int(np.argmax(np.abs(x[:, 0] - x[:, 1])))
    weights[far] = {"norton": 0.5, "hyperbolic-sine": 0.5}
    found = LawsByComposition.of(x, weights)
    assert found.laws[int(found.shared[far].argmax())] == ("hyperbolic-sine" if iron[far] else "norton")
    assert found.shared[far].max() > 0.9
    assert found.at(np.array([[0.9, 0.05, 0.05]]))[0, found.laws.index("hyperbolic-sine")] > 0.9


@pytest.fixture(scope="module")
def alloys():
    """({alloy: identification}, {alloy: tests}) of 10 alloys with four minimum rates each, contents as labels in wt.%.

    ln of the rate at 100 MPa is -17 - 0.05 x at.% Ni, the exponent 4 + at.% Ni / 50.
    """
    rng, fits, tests = np.random.default_rng(5), {}, {}
    for k, nickel in enumerate(np.linspace(5.0, 60.0, 10)):
        weight = nickel * 58.693 / (nickel * 58.693 + (100 - nickel) * 55.845) * 100
        labels = {"Ni [wt.%]": f"{weight:.6f}", "Fe [wt.%]": "bal."}
        rates = {s: np.exp(-17 - 0.05 * nickel) * (s / 100) ** (4 + nickel / 50) for s in (60.0, 90.0, 130.0, 180.0)}
        tests[f"A{k}"] = [
            History(
                f"A{k} {s:g}", np.array([1.0]), {}, constant_stress(s, "stress"), 1073.15, alloy=f"A{k}", labels=labels,
                minimum_rate=float(rate * np.exp(0.03 * rng.normal())),
            )
            for s, rate in rates.items()
        ]  # fmt: skip
        fits[f"A{k}"] = ck.identify("norton", tests[f"A{k}"])
    return fits, tests


def test_a_map_predicts_and_proposes_alloys_of_labelled_tests(alloys, tmp_path):
    fits, _ = alloys
    mapped = map_where_known(fits)[""]
    found = mapped.predict({"Ni": 40.0, "Fe": 60.0})
    at = mapped.point["stress"] / 100.0
    assert found.rate[0] == pytest.approx(np.exp(-19.0) * at**4.8, rel=0.05)
    assert found.stress_exponent[1] < 4.8 < found.stress_exponent[2]
    assert found.laws == {"norton": 1.0}
    (best, *_), (worst, *_) = mapped.propose(2), mapped.propose(2, "highest rate", within={"Ni": (20.0, 50.0)})
    assert best.composition["Ni"] == pytest.approx(60.0, abs=2.5)
    assert worst.composition["Ni"] == pytest.approx(20.0, abs=2.5)
    assert mapped.predict({"Ni": 80, "Fe": 20}).notes[0].startswith("Ni 80 at.% is outside the alloys, 5 to 60")
    assert "the composition predicts the creep rate of an alloy to a factor of 1.0" in str(mapped).replace("\n", " ")
    assert list(mapped.to_dataframe()["ln_rate"]) == pytest.approx(list(mapped.log_rate.values))
    mapped.plot(tmp_path / "map.png")
    ck.report(list(fits.values()), tmp_path / "report.html")
    assert "Creep over compositions" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_activation_energies_are_mapped_over_the_alloys_that_have_several_temperatures(alloys):
    """Q = 250 + 2 at.% Ni kJ/mol in nine of ten alloys; one has a single temperature, at which rates are compared."""
    fits, tests = alloys
    rng, law = np.random.default_rng(7), ck.law("norton").times(ck.arrhenius(T_ref=1073.15))
    both = {}
    for k, (name, own) in enumerate(tests.items()):
        nickel = compositions_of_labels(tests).atomic[name]["Ni"]
        factor = np.exp(-(250e3 + 2e3 * nickel) / 8.314462618 * (1 / 1023.15 - 1 / 1073.15))
        colder = [
            one.replace(
                name=f"{one.name} 1023", temperature=1023.15,
                minimum_rate=float(one.minimum_rate * factor * np.exp(0.03 * rng.normal())),
            )
            for one in own
        ]  # fmt: skip
        both[name] = ck.identify(law, own + colder) if k else fits[name]
    mapped = ck.composition_map(both, temperature=1073.15)
    found = mapped.predict({"Ni": 40.0, "Fe": 60.0})
    assert len(mapped.activation_energy.values) == 9
    assert found.activation_energy[1] < 330e3 < found.activation_energy[2]
    assert found.activation_energy[0] == pytest.approx(330e3, abs=10e3)
    assert "activation energies" in str(mapped)
    assert mapped.to_dataframe()["activation_energy"].isna().sum() == 1
    assert ck.composition_map(fits).activation_energy is None
    colder = ck.composition_map(both, temperature=1023.15)
    assert "its tests were at 800 °C: nothing is known of 750 °C" in colder.left_out["A0"]
    factor = np.exp(-330e3 / 8.314462618 * (1 / 1023.15 - 1 / 1073.15))
    rate = colder.predict({"Ni": 40.0, "Fe": 60.0}).rate
    assert rate[1] < np.exp(-19.0) * (colder.point["stress"] / 100.0) ** 4.8 * factor < rate[2]


def test_what_a_map_cannot_say_is_one_sentence(alloys):
    fits, tests = alloys
    known = compositions_of_labels(tests)
    unlabelled = [one.replace(labels={}) for one in tests["A0"]]
    mapped = ck.composition_map(fits, known)
    for call, said in (
        (lambda: ck.composition_map({"A0": fits["A0"].with_histories(unlabelled)}), "give compositions="),
        (lambda: ck.composition_map(dict([*fits.items()][:5]), known), "5 alloys have a law and a composition; 8 are"),
        (lambda: ck.composition_map(fits, known, stress=-5.0), "stress"),
        (lambda: mapped.predict({"Ni": 40.0, "Mo": 60.0}), "the alloys of the map hold no Mo"),
        (lambda: mapped.predict({"Ni": 40.0}), "add up to 40 %"),
        (lambda: mapped.propose(within={"Ni": (1.0, 2.0), "Fe": (1.0, 2.0)}), "widen `within`"),
    ):
        with pytest.raises(FitError, match=said):
            call()
