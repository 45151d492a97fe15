"""What a page gets to show: laws of every kind of source, specimens by their records, tests with noise and offsets."""

import json
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import pytest

import creepkit as ck
from creepkit.app.contents import MOST_TESTS, page_contents
from creepkit.app.documents import MOST_FRAMES, contents_document, law_data
from creepkit.app.page import page_fragment, page_html, shared_scripts
from creepkit.app.runtime_files import runtime_script
from creepkit.cli.report import fitted_laws
from creepkit.errors import CreepkitError, ExportError, FitError
from creepkit.exporters.javascript import script_safe_json
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.laws.norton import NORTON
from creepkit.records import is_logarithmic
from helpers.planted_bars import SPL, bars
from helpers.registered_laws import laws_of_scalars


@pytest.fixture(scope="module")
def histories():
    loadings = [ck.constant_stress(s) for s in (40.0, 50.0, 60.0)]
    return bars(ck.law("strain-hardening"), SPL, loadings, seed=1)


@pytest.fixture(scope="module")
def fit(histories):
    return ck.identify("strain-hardening", histories, starts=1)


def document(*arguments, **options):
    """As the scripts read it."""
    return json.loads(json.dumps(contents_document(page_contents(*arguments, **options)), allow_nan=False))


@pytest.mark.parametrize("name", laws_of_scalars())
def test_every_law_has_a_page_and_a_first_curve(name):
    shown = document(laws_of_scalars()[name])
    (law,) = shown["laws"]
    for p in law["parameters"]:
        assert p["low"] <= p["value"] <= p["high"]
    assert 0.0 < law["end"] < 1e22
    assert " style=" not in "".join(law["equations"])
    for text in (*law["equations"], *(p["symbol"] for p in law["parameters"])):
        assert ElementTree.fromstring(text).tag.endswith("math")
    assert json.loads(script_safe_json(shown)) == shown


def test_an_identification_brings_its_tests_intervals_and_covariance(fit, histories):
    shown = document(fit)
    (law,) = shown["laws"]
    assert [test["name"] for test in shown["tests"]] == [h.name for h in histories]
    for p, estimate in zip(law["parameters"], fit.estimates, strict=True):
        assert p["value"] == estimate.value
        assert p["interval"] == [estimate.low, estimate.high]
    sd = np.sqrt(np.diag(law["covariance"]))
    assert sd == pytest.approx(fit.correlation().sd, rel=1e-9)
    assert shown["tests"][0]["noise"]["strain"] == pytest.approx(2e-5)


def test_specimens_are_described_by_their_records():
    shown = {one["name"]: one for one in document("norton")["specimens"]}
    for name, specimen in ck.available("specimens").items():
        if name not in shown:  # none of those that the core in WebAssembly simulates
            assert name not in ("uniaxial", "relaxation", "bulge")
            continue
        one = shown[name]
        assert [o["name"] for o in one["outputs"]] == list(specimen.outputs)
        assert [(o["title"], o["unit"]) for o in one["outputs"]] == [
            (o.long_name, "%" if is_logarithmic(o) else o.unit) for o in specimen.outputs
        ]
        assert [(load["title"], load["unit"]) for load in one["loads"]] == [
            (load.long_name, load.unit) for load in specimen.loads
        ]


def test_a_long_test_is_thinned_and_unused_frames_are_left_out(histories):
    times = np.linspace(1.0, 1e5, 5000)
    used = np.arange(5000) != 17
    long = ck.History("long", times, {"strain": 1e-8 * times}, histories[0].loading, 1000.0, used=used)
    (test,) = document("norton", [long])["tests"]
    assert len(test["times"]) == len(test["outputs"]["strain"]) == MOST_FRAMES
    assert test["times"][0] == 1.0
    assert test["times"][-1] == 1e5


def test_what_cannot_be_shown_is_one_sentence(histories, tmp_path):
    with pytest.raises(FitError, match=f"at most {MOST_TESTS} tests"):
        page_contents("norton", histories * 50)
    with pytest.raises(FitError, match="'bulg'"):
        page_contents("norton", specimen="bulg")
    ck.interactive_page("norton", tmp_path / "page.html")
    ck.interactive_page("norton", tmp_path / "page.html")
    (tmp_path / "page.html").write_text("changed since")
    with pytest.raises(ExportError, match="creepkit did not write it"):
        ck.interactive_page("norton", tmp_path / "page.html")


def test_fragments_share_their_scripts():
    contents = page_contents("norton")
    alone, part = page_fragment(contents), page_fragment(contents, style=False, scripts=False)
    assert "<style>" in alone
    assert "<style>" not in part
    assert len(part) < 0.3 * len(alone)
    assert "simulateDimple" in shared_scripts(contents)
    assert "simulateDimple" not in part


def test_a_page_names_no_other_address():
    """Neither of a network nor of this machine; names of XML are not fetched."""
    text = page_html(page_contents("norton"))
    text = text.replace("http://www.w3.org/1998/Math/MathML", "").replace("http://www.w3.org/2000/svg", "")
    for word in ("http:", "https:", "//cdn", "src=", "@import", "url("):
        assert word not in text


def test_a_law_without_temperature_over_several_temperatures_is_warned_of(histories):
    hot = [histories[0], histories[1].replace(temperature=histories[1].mean_temperature + 100.0)]
    (law,) = document("norton", hot)["laws"]
    assert law["warning"].startswith("The law does not depend on temperature, and these tests are at ")
    assert document("norton", histories)["laws"][0]["warning"] == ""
    assert document(ck.with_arrhenius(ck.law("norton"), hot), hot)["laws"][0]["warning"] == ""


def test_a_test_without_stated_minimum_rate_shows_that_of_its_readings():
    """Strain in proportion to time has one slope."""
    times = np.linspace(3600.0, 360000.0, 50)
    steady = ck.History("steady", times, {"strain": 3e-8 * times}, ck.constant_stress(80.0), 873.15)
    stated = steady.replace(name="stated", minimum_rate=5e-8)
    assert [test["minimum_rate"] for test in document("norton", [steady, stated])["tests"]] == [
        pytest.approx(3e-8, rel=1e-6),
        5e-8,
    ]


# ---- model data ------------------------------------------------------------------------------------------------------

# What a page knows of a law: plain JSON with names, bounds, equations and code, that ends no script element.


def test_a_law_alone_has_the_middle_of_its_bounds_and_no_intervals():
    data = law_data(NORTON)
    A, n = data["parameters"]
    assert (A["name"], A["unit"], A["scale"], A["low"], A["high"]) == ("A", "1/s", "log", 1e-40, 1e-5)
    assert (n["unit"], n["scale"], n["value"], n["title"]) == ("", "linear", 4.5, "stress exponent")
    assert [p["interval"] for p in data["parameters"]] == [None, None]
    assert data["variables"] == ["stress"]


def planted_fit():
    """Norton with A = 1e-16, n = 5 from two exact tests."""
    tests = [
        ck.simulate(
            NORTON, "uniaxial", {"A": 1e-16, "n": 5.0}, loading=ck.constant_stress(s), times=np.linspace(0, 1e4, 12),
            temperature=1073.0, name=f"{s} MPa",
        )
        for s in (60.0, 90.0, 120.0)
    ]  # fmt: skip
    return ck.identify(NORTON, tests, using="uniaxial")


def test_a_fit_brings_its_values_and_intervals():
    fit = planted_fit()
    data = law_data(fit)
    rows = {p["name"]: p for p in data["parameters"]}
    assert rows["n"]["value"] == pytest.approx(5.0, rel=1e-2)
    for row in rows.values():
        low, high = row["interval"]
        assert low <= row["value"] <= high
        assert row["verdict"] in ("determined", "poorly determined", "not determined")


class Elements(HTMLParser):
    """Names of the elements of a page."""

    def __init__(self, text):
        super().__init__()
        self.names = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.names.append(tag)


def test_nothing_of_a_hostile_law_leaves_its_script_element():
    words = parameters("k __proto__")
    law = CreepLaw(
        "</script><b>",
        {"</script><i>": words[0] * stress ** words[1]},
        {words[0]: Param("</script><u>", (1e-9, 1.0), "</script>", "log"), words[1]: Param("<!--", (1, 8))},
        title="</script><img src=x onerror=alert(1)>",
        references=("</script><s>",),
    )
    data = law_data(law)
    page = f"<p></p><script>x = {script_safe_json(data)};</script><script>y = {data['source']};</script><em></em>"
    assert Elements(page).names == ["p", "script", "script", "em"]


def test_a_page_without_the_core_in_webassembly_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setattr("creepkit.app.runtime_files.CORE_NAME", "missing.wasm")
    runtime_script.cache_clear()
    with pytest.raises(
        CreepkitError, match=r"missing\.wasm, which is missing; run 'pip install ziglang' and 'make core'"
    ):
        ck.interactive_page("norton", tmp_path / "page.html")
    assert not list(tmp_path.iterdir())


def test_a_law_and_tests_open_with_its_fit_and_tests_alone_with_three(histories):
    """Of strain hardening the law that is planted comes first."""
    pages = [page_contents(fitted_laws(names, histories)).laws for names in (["norton"], [])]
    shown = [(len(laws), laws[0].fit is None, laws[0].law.name) for laws in pages]
    assert shown == [(1, False, "norton"), (3, False, "strain-hardening")]
