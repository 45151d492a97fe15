"""Temperature and modulus as unknowns of uniaxial tests: derivatives against differences, planted errors found."""

import numpy as np

from creepkit.inverse.identification import IdentificationSettings
from creepkit.inverse.identify import identify
from creepkit.language import Elastic, arrhenius
from creepkit.laws.norton import NORTON
from creepkit.records import History, Nuisance, constant_stress
from creepkit.specimens.uniaxial import Uniaxial

LAW = NORTON.times(arrhenius(T_ref=1073.15))
VALUES = {"A": 1e-16, "n": 5.2, "Q": 350e3}
TIMES = np.geomspace(1e3, 1e6, 12)
BAR = Uniaxial(tolerance=1e-8)


def bar(stress=60.0, temperature=1050.0, includes_elastic=True):
    return History(
        f"{stress:g}_{temperature:g}", TIMES, {}, constant_stress(stress, "stress"), temperature,
        elastic=Elastic(120e3), includes_elastic=includes_elastic,
    )  # fmt: skip


def test_a_stiffer_bar_has_less_elastic_strain():
    """60 MPa over 120 GPa is 5e-4; with a modulus 25 % larger 4e-4."""
    plain = BAR.predict(LAW, LAW.to_internal(VALUES), [bar()]).values
    stiffer = BAR.predict(LAW, LAW.to_internal(VALUES), [bar()], nuisances={"modulus": np.array([[0.25]])}).values
    np.testing.assert_allclose(plain - stiffer, 1e-4, rtol=1e-9)


def test_planted_temperature_errors_are_found():
    """Nine bars, each a few kelvin off; Q = 350 kJ/mol at 1050 K makes 5 K 20 % of the rate. Law known but for n."""
    rng = np.random.default_rng(4)
    off, tests = rng.normal(0, 4, 9), []
    conditions = [(s, T) for s in (40.0, 60.0, 80.0) for T in (1020.0, 1050.0, 1080.0)]
    for (stress, T), shift in zip(conditions, off, strict=True):
        plan = bar(stress, T, includes_elastic=False)
        strain = BAR.predict(
            LAW, LAW.to_internal(VALUES), [plan], nuisances={"temperature": np.array([[shift]])}
        ).values[0, 0, :, 0]
        tests.append(plan.replace(outputs={"strain": strain + rng.normal(0, 1e-6, TIMES.size)}))
    settings = IdentificationSettings(starts=1, sobol_points=8, nuisances=(Nuisance("temperature", sd=4.0),))
    fit = identify(LAW.fix(A=VALUES["A"], Q=VALUES["Q"]), tests, BAR, settings=settings)
    (n,) = fit.estimates
    assert n.low <= VALUES["n"] <= n.high
    errors = np.array([(e.value - shift) / e.sd for e, shift in zip(fit.nuisances, off, strict=True)])
    assert np.sqrt(np.mean(errors**2)) < 1.9
    assert np.corrcoef([e.value for e in fit.nuisances], off)[0, 1] > 0.95


def test_derivatives_are_those_of_differences():
    nuisances = {"temperature": np.array([[3.0, -2.0]]), "modulus": np.array([[0.1, 0.2]])}
    tests = [bar(), bar(80.0, 1030.0)]
    found = BAR.predict(LAW, LAW.to_internal(VALUES), tests, nuisances=nuisances, sensitivities=True)
    for kind, step in (("temperature", 0.5), ("modulus", 1e-3)):
        up, down = (
            BAR.predict(LAW, LAW.to_internal(VALUES), tests, nuisances={**nuisances, kind: nuisances[kind] + s}).values
            for s in (step, -step)
        )
        np.testing.assert_allclose(found.nuisance_jacobian[kind], (up - down) / (2 * step), rtol=2e-3)
