"""What a page knows of a law: plain JSON with names, bounds, equations and code, that ends no script element."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest

import creepkit as ck
from creepkit.app.documents import law_data
from creepkit.app.runtime_files import RUNTIME_FILES, runtime_files, runtime_script
from creepkit.errors import CreepkitError
from creepkit.exporters.javascript import script_safe_json
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.laws.norton import NORTON


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
        assert row["verdict"] in (
            *("determined", "poorly determined", "at its bound", "bounded on one side only", "not determined"),
        )


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


def test_the_runtime_is_strict_small_and_ends_no_script_element():
    files = runtime_files()
    assert tuple(files) == RUNTIME_FILES
    for name, text in files.items():
        assert re.search(r'^"use strict";$', text, re.MULTILINE), name
        assert len(text.splitlines()) <= 400, name
        assert max(map(len, text.splitlines())) <= 140, name
    script = runtime_script()
    assert len(script) < 150_000
    assert "</script" not in script.lower()
    assert not re.search(r"\b(eval|Function|import|require|fetch|XMLHttpRequest|document|window)\s*\(", script)


def test_a_page_without_the_core_in_webassembly_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setattr("creepkit.app.runtime_files.CORE_NAME", "missing.wasm")
    runtime_script.cache_clear()
    with pytest.raises(
        CreepkitError, match=r"missing\.wasm, which is missing; run 'pip install ziglang' and 'make core'"
    ):
        ck.interactive_page("norton", tmp_path / "page.html")
    assert not list(tmp_path.iterdir())
