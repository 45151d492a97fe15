"""The same question through Python and the command line gives the same numbers, to the last digit."""

import json

import numpy as np
import pytest

import creepkit as ck
from creepkit.language import Elastic
from creepkit.records import History, Nuisance, PressureJump, constant_stress
from helpers.command_line import creepkit

TEMPERATURES = (1023.15, 1073.15, 1123.15)
RATES = (4e-18, 4e-17, 3e-16)
"""A of Norton's law at these temperatures, 1/s, in dimples; a fifth of it in bars."""

SPOILT = 14
"""The frame that is spoilt, so that it matters whether suspect frames are left out."""

QUICK = {"starts": 1, "frames": 14}
QUICK_WORDS = ("--starts", "1", "--frames", "14")


def command(*words):
    result = creepkit(*words)
    assert result.exit_code == 0, result.output
    return result


def curves(folder):
    """Two bars at each temperature; one frame of the first lies apart."""
    rng, times = np.random.default_rng(1), np.linspace(1e4, 4e5, 40)
    for T, A in zip(TEMPERATURES, RATES, strict=True):
        for stress in (80.0, 100.0):
            strain = 0.2 * A * stress**5 * times + 1e-5 * rng.standard_normal(times.size)
            if (T, stress) == (TEMPERATURES[0], 80.0):
                strain[SPOILT] += 1e-3
            test = History(f"bar-{T:.0f}-{stress:g}", times, {"strain": strain}, constant_stress(stress, "stress"), T)
            ck.write_history(test, folder / f"{test.name}.csv")


def dimples(folder):
    """A simulated dimple at each temperature, by the surrogate."""
    rng, times = np.random.default_rng(2), np.arange(600.0, 6 * 3600 + 1, 300.0)
    for T, A in zip(TEMPERATURES, RATES, strict=True):
        how = {"loading": PressureJump(8, 10, 3 * 3600), "times": times, "elastic": Elastic(150e3)}
        run = ck.simulate("norton", ck.surrogate("dimple"), {"A": A, "n": 5.0}, temperature=T, **how)
        noise = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
        outputs = {name: run.outputs[name] + sd * rng.standard_normal(times.size) for name, sd in noise.items()}
        if T == TEMPERATURES[0]:
            outputs["amplitude"][SPOILT] += 0.05
        test = History(
            f"dimple-{T:.0f}", times, outputs, run.loading, T, "bulge", elastic=run.elastic, geometry=run.geometry
        )
        ck.write_history(test, folder / f"{test.name}.csv")


def isothermal(folder):
    """The tests at the lowest temperature, the spoilt one among them."""
    return ck.select_tests(ck.read_histories(folder), temperature=TEMPERATURES[0])


def same(saved, fit):
    """Whether a saved identification is that of Python, in every number."""
    assert saved.values == fit.values
    assert [(e.low, e.high) for e in saved.estimates] == [(e.low, e.high) for e in fit.estimates]
    assert (saved.log_likelihood, repr(saved.rms)) == (fit.log_likelihood, repr(fit.rms))
    assert (saved.settings, saved.notes) == (fit.settings, fit.notes)
    return True


NUISANCES = [Nuisance("offset"), Nuisance("rate", sd=0.2)]
ONE_TEMPERATURE = ("--only", "temperature=1023")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bars")
    curves(folder)
    return folder


@pytest.mark.parametrize("case", ["bars", "bars with other options", "dimples"])
def test_identify(folder, tmp_path, case):
    words, options, using = (), {}, None
    if case == "bars with other options":
        words = ("--seed", 3, "--frames", 12, "--starts", 2, "--suspect-frames", "keep", "--nuisance", "rate=0:0.2")
        options = {"seed": 3, "frames": 12, "starts": 2, "suspect_frames": "keep", "nuisances": NUISANCES}
    elif case == "dimples":
        folder, words, using = tmp_path / "dimples", ("--using", "dimple"), ck.surrogate("dimple")
        folder.mkdir()
        dimples(folder)
    fit = ck.identify("norton", isothermal(folder), using, **options)
    command("identify", folder, "--law", "norton", "--to", tmp_path, *ONE_TEMPERATURE, *words)
    assert same(ck.load(tmp_path / "norton.json"), fit)
    assert any("suspect frames were left out: 1 of" in note for note in fit.notes) == (not options)


def test_select(folder, tmp_path):
    tests, laws = ck.read_histories(folder), ("norton", "strain-hardening")
    candidates = [ck.with_arrhenius(ck.law(name), tests) for name in laws]
    ranking = ck.select(candidates, tests, **QUICK, sums=False, seed=2)
    named = [word for name in laws for word in ("--law", name)]
    words = ("--to", tmp_path, "--json", *QUICK_WORDS, "--no-sums", "--seed", "2")
    answer = json.loads(command("identify", folder, *named, *words).stdout)
    assert answer["verdict"] == ranking.verdict
    assert [law["weight"] for law in answer["laws"]] == [ranked.weight for ranked in ranking.laws]
    for ranked in ranking.laws:
        assert same(ck.load(tmp_path / f"{ranked.fit.law.name.replace('*', '-')}.json"), ranked.fit)


def test_screen(folder, tmp_path):
    settings = ck.IdentificationSettings(starts=1, sobol_points=64, frames=14)
    options = ck.ScreeningOptions(settings=settings, dense=None)
    tests = [test.replace(alloy="A") for test in ck.read_histories(folder)]
    (tmp_path / "tests").mkdir()
    for test in tests:
        ck.write_history(test, tmp_path / "tests" / f"{test.name}.csv")
    plate = ck.screen(tests, ["norton"], options=options, workers=1)
    words = ("--law", "norton", "--dense", "none", "--workers", "1", *QUICK_WORDS)
    command("identify", tmp_path / "tests", "--by", "alloy", "--to", tmp_path / "out", *words)
    (result,) = plate.results
    assert same(ck.load(tmp_path / "out" / "fits" / "A.json"), result.best)
    assert any("suspect frames were left out: 1 of" in note for note in result.notes)


def test_discover(folder, tmp_path):
    settings = ck.IdentificationSettings(**QUICK, seed=5, suspect_frames="keep")
    forms = {"A": ["arrhenius"], "n": ["constant", "linear"]}
    study = ck.temperature_study("norton", ck.read_histories(folder), settings=settings, forms=forms)
    words = ("--form", "A=arrhenius", "--form", "n=constant,linear", "--seed", "5", "--suspect-frames", "keep")
    command("discover", folder, "--to", tmp_path, *QUICK_WORDS, *words)
    study.temperature_law.save(tmp_path / "python.json")
    documents = [json.loads((tmp_path / name).read_text()) for name in ("temperature.json", "python.json")]
    assert _without_dates(documents[0]) == _without_dates(documents[1])


def _without_dates(value):
    """A document without the moments at which identifications were made."""
    if isinstance(value, dict):
        return {name: _without_dates(item) for name, item in value.items() if name != "when"}
    return [_without_dates(item) for item in value] if isinstance(value, list) else value
