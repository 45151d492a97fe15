"""The guide "Extend creepkit": every example is a file of its own, loaded and used as that of an outsider."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import creepkit as ck
from creepkit.errors import LawError, SolveError
from creepkit.records import Dimension, LawWithValues
from creepkit.registry import Plugin, Registry, default_registry
from helpers.paths import ROOT

GUIDE = ROOT / "docs" / "extend"


@pytest.fixture(autouse=True)
def own_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Each test is a process of its own: a new registry, and an empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    default_registry.cache_clear()
    yield
    default_registry.cache_clear()


def blocks(page: str, language: str = "python") -> list[str]:
    text = (GUIDE / f"{page}.md").read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.S)


def page_of(kind: str) -> str:
    return next(path.stem for path in GUIDE.glob("write_*.md") if re.fullmatch(rf"write_an?_{kind}", path.stem))


def examples(kind: str) -> list[str]:
    return [block for block in blocks(page_of(kind)) if "hookimpl" in block]


def loaded(kind: str) -> list[Plugin]:
    """Every example of a page, each in a registry of its own."""
    plugins = []
    for k, text in enumerate(examples(kind)):
        Path(f"example_{k}.py").write_text(text)
        plugins.append(Registry().load_file(f"example_{k}.py"))
    return plugins


def contributed(kind: str) -> list:
    """What each example of a page offers."""
    label = kind.replace("_", " ")
    return [next(iter(plugin.contributions[label].values())) for plugin in loaded(kind)]


# ---- laws ----------------------------------------------------------------------------------------------------------


def test_laws_keep_what_every_law_promises() -> None:
    for law in contributed("law"):
        report = ck.check_law(law, samples=16)
        assert report.passed, str(report)


def test_the_law_with_damage_breaks_when_kachanov_says() -> None:
    """Without its first term, at a held stress: t = (1 - (1 - limit)^(v + 1)) / ((v + 1) C s^v)."""
    law = contributed("law")[-1]
    C, v, s = 1e-14, 4.0, 80.0
    rupture = (1 - (1 - 0.9) ** (v + 1)) / ((v + 1) * C * s**v)
    values = {"A": 1e-17, "B": 0.0, "n": 4.0, "e0": 0.01, "C": C, "v": v}
    run = ck.simulate(
        law, "uniaxial", values, loading=ck.constant_stress(s, "stress"), times=np.linspace(1, 2 * rupture)
    )
    assert run.status is ck.Status.RUPTURED
    assert run.end_time == pytest.approx(rupture, rel=1e-3)


# ---- specimens -----------------------------------------------------------------------------------------------------


def end_deflection(law_values: dict, force: float, span: float, width: float, height: float, time: float) -> float:
    """By two quadratures: fibres of a section give curvature for a moment, curvature along the span the deflection."""
    A, n = law_values["A"], law_values["n"]
    unit, _ = quad(lambda y: 2 * width * (y / A) ** (1 / n) * y, 0, height / 2)  # moment at a curvature rate of one
    curvature = lambda x: (force * x / unit) ** n  # noqa: E731
    return time * quad(lambda x: curvature(x) * x, 0, span)[0]


def test_the_cantilever_is_that_of_beam_theory() -> None:
    beam = contributed("specimen")[-1]
    values, times = {"A": 1e-16, "n": 4.0}, np.array([3.6e5, 3.6e6])
    run = ck.simulate("norton", beam, values, loading=ck.constant_load("force", 12.0), times=times)
    expected = [end_deflection(values, 12.0, 50.0, 10.0, 2.0, t) for t in times]
    np.testing.assert_allclose(run.outputs["deflection"], expected, rtol=1e-7)
    assert [d.name for d in beam.dimensions] == ["span", "width", "height"]
    assert isinstance(beam.dimensions[0], Dimension)
    how = {"loading": ck.constant_load("force", 24.0), "times": times}
    twice = ck.simulate("norton", beam.replace(width=20.0), values, **how)
    assert run.outputs["deflection"][0] == pytest.approx(twice.outputs["deflection"][0])
    with pytest.raises(SolveError, match="found 'strain-hardening'"):
        ck.simulate("strain-hardening", beam, values | {"m": -0.3}, **how)


def test_its_central_differences_are_the_derivatives_of_the_closed_form() -> None:
    """The deflection goes with A and with h^-(2 n + 1)."""
    beam, norton = contributed("specimen")[-1], ck.law("norton")
    test = ck.History("beam", np.array([3.6e6]), {}, ck.constant_load("force", 12.0), 300.0, specimen="cantilever")
    theta = norton.to_internal({"A": 1e-16, "n": 4.0})[0]
    found = beam.predict(norton, theta[None], [test], nuisances={"height": np.array([[2.0]])}, sensitivities=True)
    deflection = found.values[0, 0, 0, 0]
    assert found.jacobian[0, 0, 0, 0, 0] == pytest.approx(deflection, rel=3e-6)
    assert found.nuisance_jacobian["height"][0, 0, 0, 0] == pytest.approx(-9.0 / 2.0 * deflection, rel=1e-3)


def test_the_cantilever_is_used_by_name() -> None:
    Path("cantilever.py").write_text(examples("specimen")[-1])
    (use,) = (block for block in blocks("write_a_specimen") if "load_plugin" in block)
    space: dict = {}
    exec(compile(use, "write_a_specimen.md", "exec"), space)
    assert space["fit"].values["n"] == pytest.approx(4.0, rel=1e-3)
    assert space["fit"].values["A"] == pytest.approx(1e-16, rel=1e-2)


def test_three_specimens_are_identified_together() -> None:
    """Planted values lie in every interval, and the tests of others find the dimensions of a test piece."""
    Path("cantilever.py").write_text(examples("specimen")[-1])
    space: dict = {}
    (program,) = blocks("joint_identification")
    exec(compile(program, "joint_identification.md", "exec"), space)
    fits, truth = space["fits"], space["TRUTH"]
    for fit in fits.values():
        for estimate in fit.estimates:
            low, high = (estimate.value * (end / estimate.value) ** 1.32 for end in (estimate.low, estimate.high))
            assert low < truth[estimate.name] < high  # at 99 %: of eight at 95 % one lies outside in a third of draws
    width = {g: {e.name: np.log(e.high / e.low) for e in fit.estimates} for g, fit in fits.items()}
    for name in ("A", "n"):
        assert width["all"][name] < 1.1 * min(width[group][name] for group in ("bar", "dimple", "beams"))
    assert width["all"]["A"] < 0.3 * width["beams"]["A"] < 0.3 * width["bar"]["A"]
    (height,) = (one for one in fits["all"].nuisances if (one.key, one.owner) == ("height", "all"))
    assert abs(height.value - 2.012) < 4 * height.sd < 0.002, "the beams are 2.012 mm high"
    assert not fits["all"].adequacy.rejects


# ---- readers -------------------------------------------------------------------------------------------------------


def test_readers_read_the_files_that_are_shown() -> None:
    index, frames, log = blocks("write_a_reader", "text")
    plain, ours, recorder = contributed("reader")
    Path("ours").mkdir()
    Path("ours/index.csv").write_text(index)
    Path("ours/b7.csv").write_text(frames)
    Path("plain").mkdir()
    Path("plain/index.csv").write_text("specimen,stress_MPa,temperature_C\nb7,120,750\n")
    Path("plain/b7.csv").write_text("time_h,strain_pct\n1,0.02\n2,0.03\n")
    Path("b7.log").write_text(log)
    for reader, path in ((plain, Path("plain")), (ours, Path("ours")), (recorder, Path("b7.log"))):
        assert reader.accepts(path)
        (bar,) = reader.read(path)
        np.testing.assert_allclose(bar.times, [3600.0, 7200.0])
        np.testing.assert_allclose(bar.outputs["strain"], [2e-4, 3e-4])
        assert bar.loading.program().values.tolist() == [120.0]
        assert (bar.name, bar.temperature, bar.strain_measure) == ("b7", 1023.15, "engineering")
    assert ours.read(Path("ours"))[0].unruptured
    assert not recorder.accepts(Path("ours/b7.csv"))


# ---- camera formats ------------------------------------------------------------------------------------------------


def test_camera_formats_read_the_frames_that_are_shown() -> None:
    (text,) = blocks("write_a_camera_format", "text")
    ours, system = contributed("camera_format")
    for format in (ours, system):
        report = ck.check_camera_format(format)
        assert report.passed, str(report)
    ck.load_plugin("example_0.py")
    Path("run").mkdir()
    for k in range(2):
        Path(f"run/frame_{k}.csv").write_text(text)
    frames = ck.read_frames("run")
    assert frames.system == ck.available("cameras")["our-program"].title
    assert frames[1].valid.tolist() == [True, False]
    np.testing.assert_allclose(frames[1].points[0], [-2.5, 1.0, 0.1])
    np.testing.assert_allclose(frames[1].displacements[0], [0.003, -0.001, 0.1205])


# ---- exporters -----------------------------------------------------------------------------------------------------


def test_the_format_of_instruments_reads_its_example():
    Path("our_format.py").write_text(examples("instrument_format")[0])
    ck.load_plugin("our_format.py")
    Path("furnace.csv").write_text(blocks("write_an_instrument_format", "text")[0], encoding="utf-8")
    record = ck.read_record("furnace.csv")
    assert record.channel("P1").reference == "gauge"
    np.testing.assert_allclose(record.channel("P1").values, [0.002, 1.25, 4.0])
    np.testing.assert_allclose(record.channel("T1").values[0], 1053.25)
    found = ck.imposed(record, "1", [1.0, 2.0], ck.ClockAlignment.stated(0.0))
    assert found.channels == ("P1", "T1")


def test_exporters_write_what_is_shown() -> None:
    values, table, _ = contributed("exporter")
    source = LawWithValues(ck.law("norton"), {"A": 1e-16, "n": 5.0}, notes=("a note",))
    assert values.text(source) == "A 1e-16\nn 5.0\n"
    assert table.text(source).splitlines() == ["# a note", "name,value,unit", "A,1e-16,1/s", "n,5.0,1"]


HARDENING = ("strain-hardening", {"A": 1e-16, "n": 4.4, "m": -0.35}, 1e-16 * 90.0**4.4 * 0.003**-0.35)


@pytest.mark.parametrize(("name", "values", "rate"), [HARDENING])
def test_the_function_of_octave_is_the_law(name: str, values: dict, rate: float) -> None:
    """Its lines are Python's but for the signs of operators, which stand for those of arrays."""
    text = contributed("exporter")[-1].text(LawWithValues(ck.law(name), values, notes=("a note",)))
    head, *body, end = [line for line in text.splitlines() if not line.startswith("%")]
    assert "% a note" in text
    assert head == f"function rate = {name.replace('-', '_')}(stress, strain, time, temperature)"
    assert end == "end"
    space = {"stress": 90.0, "strain": 0.003, "time": 7e4, "temperature": 1000.0}
    for line in body:
        exec(line.strip().rstrip(";").replace(".*", "*").replace(".^", "**").replace("^", "**"), space)
    assert space["rate"] == pytest.approx(rate, rel=1e-12)


# ---- temperature forms ---------------------------------------------------------------------------------------------


def strain_at(law, values: dict, temperature: float) -> float:
    """Creep strain of 1 h at a held stress of 100 MPa."""
    loading = ck.constant_stress(100.0, "stress")
    run = ck.simulate(law, "uniaxial", values, loading=loading, times=[3600.0], temperature=temperature)
    return float(run.outputs["strain"][0])


def test_rates_double_in_the_interval_of_doubling() -> None:
    doubling = contributed("temperature_form")[0]
    law, values = ck.law("norton").times(doubling(1050.0)), {"A": 1e-16, "n": 4.0, "D": 15.0}
    assert strain_at(law, values, 1050.0) == pytest.approx(1e-16 * 100.0**4 * 3600, rel=1e-9)
    assert strain_at(law, values, 1080.0) == pytest.approx(4e-16 * 100.0**4 * 3600, rel=1e-9)
    assert ck.check_law(law, samples=16).passed


def test_an_exponent_steps_between_two_values() -> None:
    transition = contributed("temperature_form")[-1]
    law = ck.law("norton").with_temperature(n=transition(1050.0, width=30.0))
    values = {"A": 1e-16, "n": 4.0, "n_S": 0.5, "n_Ts": 1100.0}
    assert strain_at(law, values, 1050.0) == pytest.approx(1e-16 * 100.0**4 * 3600, rel=1e-9)
    ratio = strain_at(law, values, 1140.0) / strain_at(law, values, 1060.0)
    assert ratio == pytest.approx(100.0 ** (0.5 * 0.8), rel=1e-9), "40 K of 50 K, the sides being 30, 40 and 50"
    assert ck.check_law(law, samples=16).passed
    with pytest.raises(LawError, match="'A' has a log scale"):
        ck.law("norton").with_temperature(A=transition())
    with pytest.raises(LawError, match="width is 0"):
        transition(width=0)
