"""`creepkit app`: what it writes, and its mistakes."""

import pytest

import creepkit as ck
from helpers.command_line import creepkit, one_line

BARS = ck.example_data("planted creep curves")


def test_the_page_as_one_file(tmp_path):
    result = creepkit("app", "norton", str(BARS / "planted_800C_60MPa.csv"), "--to", str(tmp_path / "page.html"))
    assert result.exit_code == 0, result.stderr
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "planted_800C_60MPa" in text
    assert len(text) < 1_000_000
    (tmp_path / "page.html").write_text("edited", encoding="utf-8")
    again = creepkit("app", "norton", "--to", str(tmp_path / "page.html"))
    assert "creepkit did not write it as it is now" in one_line(again)
    assert creepkit("app", "norton", "--to", str(tmp_path / "page.html"), "--force").exit_code == 0


def test_sums_results_and_exported_laws(tmp_path):
    ck.export("norton", "json", {"A": 3e-16, "n": 4.25}, to=tmp_path / "law.json")
    for source, shown in (("norton+strain-hardening", "strain"), (str(tmp_path / "law.json"), "4.25")):
        path = tmp_path / "page.html"
        assert creepkit("app", source, "--to", str(path), "--force").exit_code == 0
        assert shown in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("nortom",), "norton"),
        (("norton", "hyperbolic-sine"), "name one"),
        (("norton", "no/such/file.csv"), "file.csv"),
        (("norton", "--specimen", "bulg"), "bulge"),
        (("norton", "--specimen", "point"), "point"),
    ],
)
def test_mistakes_are_one_sentence(words, said, tmp_path):
    assert said in one_line(creepkit("app", *words, "--to", str(tmp_path / "page.html")))
