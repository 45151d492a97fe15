"""Errors of the modulus and of held strains common to all relaxation tests, against identifications that have them."""

from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.settings import USUAL_ERRORS

E, A, N = 150e3, 2e-8 / 200.0**6, 6.0


def _relaxation(stiffness: float = E) -> list[ck.History]:
    """Of Norton's law from E strain on, ds/dt = -E A s^n in closed form; files that state another modulus."""
    times, rng, tests = np.geomspace(30.0, 1.4e5, 30), np.random.default_rng(5), []
    for k, strain in enumerate((0.0015, 0.0018, 0.0020)):
        first = E * np.log1p(strain)
        stress = (first ** (1 - N) + (N - 1) * E * A * times) ** (1 / (1 - N)) + 0.4 * rng.standard_normal(30)
        loading = ck.constant_strain(strain)
        elastic = ck.Elastic(E=stiffness)
        tests.append(ck.History(f"R{k}", times, {"stress": stress}, loading, 1073.15, "relaxation", elastic=elastic))
    return tests


@pytest.mark.parametrize(
    ("share", "how", "tolerance"),
    [
        # of weights that no estimate changes, an error so small that its effect is linear
        (0.05, {"weights": "equal", "nuisances": ()}, 0.05),
        # whole errors, which a likelihood that does not know of them finds as offsets of tests
        (1.0, {"weights": "likelihood", "usual_errors": "none"}, 0.15),
    ],
)
def test_the_rate_moves_as_identifications_with_these_errors_say(share, how, tolerance):
    fit = ck.identify("norton", _relaxation(), starts=1, **how)
    effects = {e.kind: e for e in fit.unmodelled if e.common}
    stiffer = _relaxation(E * (1 + share * USUAL_ERRORS["modulus"]))
    factor = 1 + share * USUAL_ERRORS["motion"]
    strained = [replace(h, loading=ck.constant_strain(h.loading.program().values[-1] * factor)) for h in _relaxation()]
    stress = fit.reference.stress
    for kind, altered in (("modulus", stiffer), ("imposed strain", strained)):
        again = ck.identify("norton", altered, starts=1, **how)
        moved = np.log(again.rate(stress)[0] / fit.rate(stress)[0])
        assert share * effects[kind].rate_change == pytest.approx(moved, rel=tolerance)
    assert effects["modulus"].sentence.endswith("with Young's moduli 2 % above those stated, in all 3 tests")


def test_creep_tests_have_neither():
    how = {"times": np.geomspace(1e3, 1e6, 12), "elastic": ck.Elastic(E=E), "loading": ck.constant_stress(150.0)}
    curve = ck.simulate("norton", "uniaxial", {"A": A, "n": N}, **how)
    kinds = {e.kind for e in ck.identify("norton", [curve], starts=1).unmodelled}
    assert not {"modulus", "imposed strain"} & kinds


def test_a_nuisance_parameter_of_all_tests_stands_for_the_modulus():
    fit = ck.identify("norton", _relaxation(), starts=1, nuisances=[ck.Nuisance("modulus", scope="all", sd=0.02)])
    kinds = {e.kind for e in fit.unmodelled if e.common}
    assert "modulus" not in kinds
    assert "imposed strain" in kinds
