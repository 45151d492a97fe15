"""What authors of laws and specimens are told of usual mistakes: each sentence says what to write."""

import re
from pathlib import Path

import pytest
import sympy

import creepkit as ck
from creepkit.errors import ArgumentError, LawError, SolveError, raised_text
from creepkit.language import parameters, states, stress
from helpers.command_line import creepkit, one_line
from helpers.paths import ROOT

A, n = parameters("A n")
TABLE = {
    A: ck.Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log"),
    n: ck.Param("stress exponent", bounds=(1, 8)),
}


def law(term, **further) -> ck.CreepLaw:
    return ck.CreepLaw(
        "mine", {"creep": term}, TABLE, **{"title": "Mine", "references": ("Somebody (1950), Acta",), **further}
    )


@pytest.mark.parametrize(
    "use", [lambda w: 1 - w, lambda w: A * w, lambda w: w**2, lambda w: sympy.exp(w), lambda w: A / w, lambda w: w + 1]
)
def test_one_name_that_was_not_unpacked_is_told_how_to(use) -> None:
    with pytest.raises(LawError, match=re.escape('states("damage") is a tuple of 1; write (damage,) = states(')):
        use(states("damage"))
    with pytest.raises(LawError, match=re.escape('write (B,) = parameters("B")')):
        use(parameters("B"))
    with pytest.raises(LawError, match=re.escape('write B, C = parameters("B C")')):
        use(parameters("B, C"))


def test_tuples_of_symbols_are_tuples() -> None:
    (w,) = states("w")
    assert (*parameters("A n"), w) == parameters("A n") + states("w")
    with pytest.raises(LawError, match=re.escape("write (w,) = states(")):
        law(A * stress**n * w, states={states("w"): ck.State(0.0, A)})


def test_the_exclusive_or_is_no_power() -> None:
    for wrong in (lambda: A * stress ^ n, lambda: A * (stress ^ n)):
        with pytest.raises(TypeError) as caught:
            wrong()
        assert "; write ** for powers (" in raised_text(caught.value)
    with pytest.raises(LawError, match=re.escape("write ** for powers")):
        law(stress ^ n)


def test_unknown_symbols_and_arguments_are_told_where_they_belong() -> None:
    (s_inf,) = parameters("s_inf")
    with pytest.raises(LawError, match="unknown symbol s_inf in a rate.*add it to params=, or to states="):
        law(A * stress**n * s_inf)
    with pytest.raises(ArgumentError, match=r"Param\(\) takes no argument 'bound'; did you mean 'bounds'"):
        ck.Param("stress exponent", bound=(1, 8))
    with pytest.raises(TypeError, match=r"takes no argument 'stres'; did you mean 'stress'"):
        ck.constant_stress(stres=100.0)


def test_the_example_of_constraints_conforms() -> None:
    text = (ROOT / "docs" / "extend" / "write_a_law.md").read_text(encoding="utf-8")
    block = next(part for part in re.findall(r"```python\n(.*?)```", text, flags=re.S) if "constraints=" in part)
    names: dict = {}
    exec(block, names)
    report = ck.check_law(names["ABOVE_A_THRESHOLD"])
    assert report.passed, str(report)


def test_a_method_that_is_missing_is_told_with_its_arguments() -> None:
    class ThreePoint(ck.PerTest):
        name, title = "three", "Three"

        def oen(self, law, values, history, nuisances): ...

    said = r"ThreePoint has no one\(\); write a method one\(self, law, values, history, nuisances\); is oen\(\) meant\?"
    with pytest.raises(SolveError, match=said):
        ThreePoint()


def test_a_folder_and_an_unknown_name_are_told_what_to_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert creepkit("new", "law", "soft-hard").exit_code == 0
    said = one_line(creepkit("check", "soft-hard/"))
    assert said.endswith(f"name the file in it: creepkit check {Path('soft-hard', 'creepkit_soft_hard.py')}\n")
    assert creepkit("check", str(Path("soft-hard", "creepkit_soft_hard.py"))).exit_code == 0
    assert "no law, specimen, reader, camera format, exporter" in one_line(creepkit("check", "word"))
    assert "did you mean 'uniaxial'?" in one_line(creepkit("check", "uniaxal"))
