"""Printed kernels read well, whatever the author's names are."""

import re

import pytest

from creepkit.kernels import lower
from creepkit.kernels.compilation import assembly, module_source
from creepkit.kernels.symbolic_kernel import symbolic_kernel
from creepkit.language import CreepLaw, parameters, stress
from creepkit.laws.combined import COMBINED
from helpers.literature_laws import EQUATIONS, POWER, RATE, A, law, n


def test_a_kernel_is_printed_in_the_words_of_its_author() -> None:
    source = lower(COMBINED, "numpy").source

    assert "# strain hardening: A_2*strain**m_1*stress**n_2" in source
    assert "    ln_stress = log_floor(stress, 1e-30)" in source
    assert "    B = exp(ln_B)" in source
    assert "    strain_hardening = exp(ln_A_2 + ln_strain*m_1 + ln_stress*n_2)" in source
    assert "        hyperbolic_sine + strain_hardening + time_hardening," in source


def test_what_needs_no_point_is_done_once_for_all_eight() -> None:
    """Functions of parameters alone, such as exp(-r) of Liu-Murakami, are called for one number, not for a vector."""
    for law_ in (COMBINED, EQUATIONS["Liu-Murakami"]):
        for function in assembly(module_source(symbolic_kernel(law_))).split("define internal i64 ")[1:]:
            numbers_in_every_lane = set(re.findall(r"(%\w+) = shufflevector", function))
            for arguments in re.findall(r"= call <8 x double> @\w[\w.]*\((.*)\)", function):
                assert set(re.findall(r"%\w+", arguments)) - numbers_in_every_lane


@pytest.mark.parametrize("name", ["names of Python", "names of kernels"])
def test_awkward_names_are_made_fit_to_print(name: str) -> None:
    foreign = EQUATIONS[name]
    values = foreign.center()

    for target in ("numpy", "torch"):
        rate = lower(foreign, target).rate(values, stress=50.0, strain=0.01, time=10.0, temperature=1000.0)
        assert float(rate) == pytest.approx(float(_by_sympy(foreign, values)), rel=1e-12)


def test_names_that_look_alike_stay_apart() -> None:
    """Python reads the micro sign and the Greek letter as one name."""
    micro, greek = parameters("µ μ")
    foreign = law(A * stress**n * (micro + 10 * greek), {A: RATE, n: POWER, micro: POWER, greek: POWER})

    rate = lower(foreign, "numpy").rate({"A": 1e-10, "n": 1.0, "µ": 2.0, "μ": 3.0}, stress=1.0)

    assert float(rate) == pytest.approx(32e-10, rel=1e-14)


def test_a_label_cannot_leave_its_comment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Laws refuse such labels; generated source does not rely on it."""
    monkeypatch.setattr("creepkit.language.law_record.validate_law", lambda law_: None)
    label = 'creep """\nraise SystemExit("label was run")\r# \x0c\u2028'
    foreign = law({label: A * stress**n}, {A: RATE, n: POWER}, name=label)

    assert float(lower(foreign, "numpy").rate({"A": 1e-10, "n": 2.0}, stress=3.0)) == pytest.approx(9e-10, rel=1e-14)
    text = module_source(symbolic_kernel(foreign))
    assert next(line for line in text.splitlines() if "SystemExit" in line).startswith("# ")


def _by_sympy(foreign: CreepLaw, values: dict[str, float]) -> float:
    at = {foreign.symbol(name): value for name, value in values.items()}
    point = {s: v for s in foreign.rate.free_symbols for n, v in _POINT.items() if s.name == n}
    return foreign.rate.evalf(30, subs={**at, **point})


_POINT = {"stress": 50.0, "strain": 0.01, "time": 10.0, "temperature": 1000.0}
