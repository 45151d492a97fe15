"""Faulty laws and hooks as authors write them, each in a file: `creepkit check` names the fault and the remedy."""

import re
from pathlib import Path

import pytest
import sympy

import creepkit as ck
from creepkit.errors import ArgumentError, LawError, PluginError, SolveError, raised_text
from creepkit.language import parameters, states, stress
from creepkit.registry import Registry
from creepkit.testing import check_plugin
from helpers.command_line import creepkit, one_line

HEAD = """
import math
import sympy
from creepkit.language import *

A, n, m, Q, B, s_0 = parameters("A n m Q B s_0")
w, v = states("w v")
RATE = Param("rate coefficient", (1e-40, 1e-5), "1/s", "log", off=0.0)
POWER = Param("exponent", (1, 8))
ENERGY = Param("activation energy", (1e5, 5e5), "J/mol")
R = GAS_CONSTANT
"""

TAIL = """

@hookimpl
def creepkit_laws():
    return [LAW]
"""


def law(term: str, params: str, *, name: str = "'my-law'", refs: str = "('Author (2020)',)", more: str = "") -> str:
    """The source of a plugin with one law."""
    return (
        f"{HEAD}\nLAW = CreepLaw(name={name}, title='A law', terms={{'creep': {term}}}, params={{{params}}}, "
        f"references={refs}, {more})\n{TAIL}"
    )


PLAIN = "A: RATE, n: POWER"
GOOD = law("A * stress**n", PLAIN)
ACTIVATED = "A: RATE, n: POWER, Q: ENERGY"


def power(params: str = PLAIN, **more: str) -> str:
    """A power law."""
    return law("A*stress**n", params, **more)


def hot(over: str, params: str = ACTIVATED, **more: str) -> str:
    """A power law with exp(-Q over something)."""
    return law(f"A*stress**n*sympy.exp(-Q/{over})", params, **more)


OXIDE = PLAIN + ", B: RATE, s_0: Param('s', (1, 2), 'mm')"


def damage(state: str, term: str = "A * stress**n / (1 - w)", params: str = PLAIN + ", B: RATE") -> str:
    """A law with one internal variable w."""
    return law(term, params, more=f"states={{w: {state}}}")


LAWS: dict[str, tuple[str, str]] = {
    # ---- units
    "rate coefficient in 1/h": (
        power("A: Param('a', (1e-9, 1e-5), '1/h', 'log'), n: POWER"),
        "comes out in 0.000277778 s^-1",
    ),
    "energy in kJ, constant in J": (
        hot("(R*temperature)", ACTIVATED.replace("ENERGY", "Param('q', (100, 500), 'kJ/mol')")),
        "divides an energy in 1000 J by a constant in J; give the energy in J/mol, or multiply by 1000",
    ),
    "no gas constant": (hot("temperature"), "divide by the gas constant"),
    "exponential of a stress in MPa": (
        law("A*stress**n*sympy.exp(strain*B)", PLAIN + ", B: Param('b', (1, 9), 'MPa')"),
        "the argument of exp, B*strain, is in MPa",
    ),
    "power of a temperature": (law("A*stress**n*temperature**m", PLAIN + ", m: POWER"), "divide it by a reference"),
    "exponent with a unit": (power("A: RATE, n: Param('n', (1, 8), 'K')"), "the exponent, n, is in K"),
    "slope of temperature without its unit": (
        law("A*stress**n*(1 + B*temperature)", PLAIN + ", B: Param('b', (1e-4, 1e-3))"),
        "beside B*temperature in K",
    ),
    "unit of no known spelling": (
        power("A: Param('a', (1e-9, 1e-5), 'per second', 'log'), n: POWER"),
        "the unit of A is not understood, 'per' in 'per second'",
    ),
    "log scale without a unit": (power("A: Param('a', (1e-9, 1e-5), scale='log'), n: POWER"), "missing unit"),
    # ---- rates
    "negative by its sign": (
        law("-B*stress**m", "B: RATE, m: POWER"),
        "is negative, and a rate is not; write recovery as a factor or an internal",
    ),
    "negative at long times": (
        law("A*stress**n*(1 - time*B)", PLAIN + ", B: Param('b', (1e-3, 1), '1/s', 'log')"),
        "say in constraints where the law holds",
    ),
    "singular at zero stress": (law("A*sympy.exp(1/stress**2)*stress**n", PLAIN), "not at"),
    "falls with stress": (law("A*stress**(-n)", PLAIN), "rate never falls with stress"),
    "overflows": (law("A*sympy.exp(sympy.exp(stress))", "A: RATE"), "ln rate is finite"),
    "jump in stress": (
        law("A*stress**n*sympy.Piecewise((1, stress < 100), (10, True))", PLAIN),
        "it jumps by a factor of 10 at stress 100 MPa; let the branches meet",
    ),
    "gap between branches": (law("A*sympy.Piecewise((stress**n, stress < 100))", PLAIN), "write (..., True)"),
    "time to a power below -1 at a bound": (
        law("A*stress**n*time**(m - 1)", PLAIN + ", m: Param('m', (-0.2, 1))"),
        "narrow the bounds so that the power stays above -1",
    ),
    "damage without a limit": (damage("State(0.0, B*stress**n, 'damage')"), "'w' has no limit, and a term is infinite"),
    "softening without a limit": (
        damage("State(0.0, B*stress**n, 'softening')", "A*stress**n*(1 - w)"),
        "state where the material ends, ck.State(..., limit=1)",
    ),
    "ductility without a limit": (
        damage("State(1.0, -B*stress**n, 'ductility')", "A*stress**n*w"),
        "before it is -0.259; state where the material ends",
    ),
    "temperature in C in a denominator": (hot("(R*(temperature - 273.15))"), "temperature -273.15 stands in it"),
    "state without its unit": (
        damage("State(0.0, B*stress, 'oxide', limit=9)", "A*stress**n*sympy.exp(w/s_0)", OXIDE),
        "or give the state 'w' its unit",
    ),
    "temperature in C": (hot("(R*(temperature + 273.15))"), "temperature is in K already; leave it out"),
    "falls with temperature": (
        law("A*stress**n*sympy.exp(Q/(R*temperature))", ACTIVATED),
        "check the sign of the activation energy",
    ),
    "function without a kernel": (law("A*stress**n*sympy.gamma(n)", PLAIN), "has no kernel; allowed are Abs, "),
    "complex number": (law("A*stress**n*sympy.I", PLAIN), "is not finite and real"),
    # ---- symbols, tables and texts
    "function for a term": (law("lambda s: s", PLAIN), "is not a sympy expression"),
    "name with spaces": (power(name="'my law'"), "joined by hyphens"),
    "name that is taken": (law("2*A*stress**n", PLAIN, name="'norton'"), "'norton' is taken, by plugin 'norton'"),
    "no name": (power(name="''"), "a law needs a name in words"),
    "no references": (power(refs="()"), "missing references"),
    "letters of a reference": (power(refs="tuple('Norton')"), "write a tuple of texts"),
    "missing bounds": (power("A: RATE, n: Param('exponent')"), "bounds"),
    "number for a Param": (power("A: RATE, n: 5.0"), "allowed is a Param"),
    "constraints that never hold": (power(more="constraints=(n > 9,)"), "the constraints hold at 0"),
    "off that is no switch": (
        law("A*sympy.sinh(stress/B)", "A: RATE, B: Param('b', (1, 100), 'MPa', 'log', off=0.0)"),
        "off equals fix: law",
    ),
    # ---- internal variables
    "limit below the start": (
        damage("State(0.0, B*stress, 'damage', limit=-1.0)", "A*stress**n*sympy.exp(w)"),
        "it leaves its start, 0, away from its limit, -1",
    ),
    "damage that heals": (damage("State(0.0, -B*stress, 'damage', limit=0.99)"), "correct the sign of its rate"),
    "rate of a state in another unit": (
        damage("State(0.0, B*stress, 'oxide', unit='mm', limit=0.99)", "A*stress**n*sympy.exp(w/s_0)", OXIDE),
        "rate of 'w' comes out in s^-1, and must in mm per s",
    ),
    # ---- examples
    "example with another rate": (
        power(more="examples=({'A': 1e-16, 'n': 4, 'stress': 100, 'rate': 2e-8},)"),
        "1e-08 1/s, and the example states 2e-08",
    ),
    "example without a rate": (power(more="examples=({'A': 1e-16},)"), "write a tuple of examples"),
}
HOOKS: dict[str, tuple[str, str, bool]] = {
    "a generator": (GOOD.replace("return [LAW]", "yield LAW"), "return list(...) of it", True),
    "an empty list": (GOOD.replace("[LAW]", "[]"), "offers no law, specimen, reader", False),
    "a reader without read": (
        "import creepkit as ck\nclass R:\n    name = title = 'r'\n    def accepts(self, path):\n        return False\n"
        "@ck.hookimpl\ndef creepkit_readers():\n    return [R()]\n",
        "it has no read",
        True,
    ),
    "a specimen whose name raises": (
        "import creepkit as ck\nclass S(ck.Specimen):\n    title = 's'\n    outputs = ('x',)\n"
        "    @property\n    def name(self):\n        raise OSError('no licence')\n"
        "@ck.hookimpl\ndef creepkit_specimens():\n    return [S()]\n",
        "OSError: no licence",
        True,
    ),
    "an exporter without a name": (
        "import creepkit as ck\nclass E:\n    name = None\n    title = suffix = '.e'\n    def text(self, source):\n"
        "        return ''\n@ck.hookimpl\ndef creepkit_exporters():\n    return [E()]\n",
        "whose name is None; give it a short name in words",
        True,
    ),
}


def told(source: str, file: Path) -> str:
    """What the check says of a plugin file: the error of loading it, or the findings that fail."""
    file.write_text(source, encoding="utf-8")
    try:
        reports = check_plugin(Registry().load_file(file))
    except PluginError as error:
        return str(error)
    failures = [check for report in reports for check in report.failures]
    assert all("\n" not in check.detail for check in failures)
    return " ".join(f"FAIL {check.name}: {check.detail}" for check in failures)


def test_a_fault_is_caught_with_a_sentence_and_of_a_hook_with_its_file(tmp_path: Path) -> None:
    wrong, faults = [], {**{name: (*fault, False) for name, fault in LAWS.items()}, **HOOKS}
    for number, (name, (source, sentence, has_line)) in enumerate(faults.items()):
        file = tmp_path / f"faulty_{number}.py"
        message = told(source, file)
        sound = sentence in message and "\n" not in message and (not has_line or f"{file}, line " in message)
        wrong += [] if sound else [f"{name}: {message}"]
    assert wrong == []


def test_what_is_no_fault_passes(tmp_path: Path) -> None:
    """1e-16 * 100^4 = 1e-8."""
    anomaly = law("A*stress**n*sympy.exp(Q/(R*temperature))", ACTIVATED, more="falls_with_temperature=True")
    example = "examples=({'A': 1e-16, 'n': 4, 'stress': 100, 'rate': 1e-8},)"
    counted = power(more=example)
    for number, source in enumerate((GOOD, anomaly, counted)):
        assert told(source, tmp_path / f"good_{number}.py") == ""
    (report,) = check_plugin(Registry().load_file(tmp_path / "good_2.py"))
    assert "example 1" in {check.name for check in report.checks}


# ---- messages --------------------------------------------------------------------------------------------------------

# What authors of laws and specimens are told of usual mistakes: each sentence says what to write.


A, n = parameters("A n")
TABLE = {
    A: ck.Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log"),
    n: ck.Param("stress exponent", bounds=(1, 8)),
}


def authored_law(term, **further) -> ck.CreepLaw:
    return ck.CreepLaw(
        "mine", {"creep": term}, TABLE, **{"title": "Mine", "references": ("Somebody (1950), Acta",), **further}
    )


@pytest.mark.parametrize("use", [lambda w: 1 - w, lambda w: A * w, sympy.exp])
def test_one_name_that_was_not_unpacked_is_told_how_to(use) -> None:
    with pytest.raises(LawError, match=re.escape('states("damage") is a tuple of 1; write (damage,) = states(')):
        use(states("damage"))
    with pytest.raises(LawError, match=re.escape('write B, C = parameters("B C")')):
        use(parameters("B, C"))


def test_tuples_of_symbols_are_tuples() -> None:
    (w,) = states("w")
    assert (*parameters("A n"), w) == parameters("A n") + states("w")
    with pytest.raises(LawError, match=re.escape("write (w,) = states(")):
        authored_law(A * stress**n * w, states={states("w"): ck.State(0.0, A)})


def test_the_exclusive_or_is_no_power() -> None:
    for wrong in (lambda: A * stress ^ n, lambda: A * (stress ^ n)):
        with pytest.raises(TypeError) as caught:
            wrong()
        assert "; write ** for powers (" in raised_text(caught.value)
    with pytest.raises(LawError, match=re.escape("write ** for powers")):
        authored_law(stress ^ n)


def test_unknown_symbols_and_arguments_are_told_where_they_belong() -> None:
    (s_inf,) = parameters("s_inf")
    with pytest.raises(LawError, match="unknown symbol s_inf in a rate.*or make it with conditions"):
        authored_law(A * stress**n * s_inf)
    with pytest.raises(ArgumentError, match=r"Param\(\) takes no argument 'bound'; did you mean 'bounds'"):
        ck.Param("stress exponent", bound=(1, 8))
    with pytest.raises(TypeError, match=r"takes no argument 'stres'; did you mean 'stress'"):
        ck.constant_stress(stres=100.0)


def test_a_method_that_is_missing_is_told_with_its_arguments() -> None:
    class ThreePoint(ck.PerTest):
        name, title = "three", "Three"

        def oen(self, authored_law, values, history, nuisances): ...

    said = r"ThreePoint has no one\(\); write a method one\(self, law, values, history, nuisances\); is oen\(\) meant\?"
    with pytest.raises(SolveError, match=said):
        ThreePoint()


def test_a_folder_and_an_unknown_name_are_told_what_to_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert creepkit("new", "law", "soft-hard").exit_code == 0
    said = one_line(creepkit("check", "soft-hard/"))
    assert said.endswith(f"name the file in it: creepkit check {Path('soft-hard', 'creepkit_soft_hard.py')}\n")
    assert creepkit("check", str(Path("soft-hard", "creepkit_soft_hard.py"))).exit_code == 0
    assert "no law, specimen, reader, camera format, instrument format, exporter" in one_line(creepkit("check", "word"))
    assert "did you mean 'uniaxial'?" in one_line(creepkit("check", "uniaxal"))
