"""Files that a report carries: what was embedded is read back, and nothing else."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest

from creepkit.errors import ReportError
from creepkit.reports.attachments import LARGEST_ATTACHMENT, embed, read_attachments
from creepkit.reports.contents import Attachment

FILES = (
    Attachment("study.toml", b"title = '</script><script>alert(1)</script>'\n"),
    Attachment("data/test 1 & <b>2</b>.csv", bytes(range(256)) * 40),
    Attachment("data/Prüfung_β.csv", b""),
)


def page(tmp_path: Path, html: str) -> Path:
    path = tmp_path / "report.html"
    path.write_text(f"<!DOCTYPE html><title>t</title><p>text</p>{html}", encoding="utf-8")
    return path


def test_what_was_embedded_is_read_back(tmp_path: Path) -> None:
    assert read_attachments(page(tmp_path, embed(FILES))) == {a.name: a.content for a in FILES}


def test_no_name_or_content_ends_its_element() -> None:
    html = embed(FILES)
    assert html.count("<script") == html.count("</script>") == 1 + len(FILES)
    assert re.sub(r"</?script[^>]*>", "", html).count("<") == 0


ODD_NAMES = ["\ud800", "x" * 401, "x" * 300, "~/\x7f"]


@pytest.mark.parametrize(
    "name",
    [
        *ODD_NAMES,
        "",
        "/etc/passwd",
        "../x",
        "a/../x",
        "./a",
        "a//b",
        "a/",
        "a\\b",
        "C:/x",
        "c:x",
        "a\nb",
        "a\x00",
        "a\u202eb",
        ".bashrc",
        ".git/hooks/post-checkout",
        "inputs/.x",
        "-rf",
        "~x",
        "con",
        "inputs/AUX.txt",
        "a.",
        "a ",
    ],
)
def test_names_outside_a_folder_are_refused_both_ways(tmp_path: Path, name: str) -> None:
    with pytest.raises(ReportError, match=r"plain path|characters"):
        embed([Attachment(name, b"x")])
    with pytest.raises(ReportError, match=r"plain path|characters"):
        read_attachments(page(tmp_path, changed_manifest(lambda files: files[0].update(name=name))))


@pytest.mark.parametrize("names", [("a", "A"), ("a", "a/b"), ("ä", "Ä"), ("b/c", "b"), ("\u00e9", "e\u0301")])
def test_names_that_are_one_file_somewhere_are_refused(names: tuple[str, str]) -> None:
    with pytest.raises(ReportError, match=r"twice|a file and a folder"):
        embed([Attachment(name, b"x") for name in names])


def changed_manifest(change: Callable[[list[dict[str, object]]], object]) -> str:
    html = embed(FILES)
    text = re.findall(r'id="creepkit-attachments">([^<]*)<', html)[0]
    document = json.loads(text)
    change(document["files"])
    return html.replace(text, json.dumps(document).replace("<", "\\u003c"))


DAMAGE: dict[str, Callable[[str], str]] = {
    "a digest": lambda html: re.sub(r'("sha256": ")[0-9a-f]', lambda m: m[1] + "g", html, count=1),
    "another digest": lambda html: html.replace(hashlib.sha256(FILES[0].content).hexdigest(), "0" * 64),
    "a size": lambda html: html.replace('"bytes": 0', '"bytes": 1'),
    "a negative size": lambda html: html.replace('"bytes": 0', '"bytes": -1'),
    "a size of thousands of digits": lambda html: html.replace('"bytes": 0', '"bytes": 1' + "0" * 4000),
    "a size of hundreds of digits": lambda html: html.replace('"bytes": 0', '"bytes": 1' + "0" * 400),
    "a size that is no number": lambda html: html.replace('"bytes": 0', '"bytes": true'),
    "an enormous size": lambda html: html.replace('"bytes": 0', f'"bytes": {LARGEST_ATTACHMENT + 1}'),
    "two lists": lambda html: html + embed(FILES),
    "a file more": lambda html: html + '<script type="application/x-creepkit-attachment" data-number="3">eA==</script>',
    "a file less": lambda html: html[: html.rindex("<script")],
    "a list less": lambda html: html[html.index("</script>") :],
    "another order": lambda html: html.replace('data-number="0"', 'data-number="7"'),
    "no JSON": lambda html: html.replace('{"files"', '{{"files"'),
    "nested JSON": lambda html: re.sub(r'(attachments">)[^<]*', lambda m: m[1] + "[" * 100_000, html),
    "an unknown key": lambda html: html.replace('"format"', '"formats"'),
    "another version": lambda html: html.replace('"version": 1', '"version": 2'),
    "no base64": lambda html: html.replace('data-number="1">', 'data-number="1">=A'),
    "no element": lambda html: html.replace('data-number="1">', 'data-number="1">*'),
    "cut": lambda html: html[:-20],
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_a_report_that_was_changed_is_refused_in_one_sentence(tmp_path: Path, kind: str) -> None:
    html = embed(FILES)
    changed = DAMAGE[kind](html)
    assert changed != html
    with pytest.raises(ReportError) as error:
        read_attachments(page(tmp_path, changed))
    assert str(error.value).count("\n") == 0
    assert "report.html" in str(error.value)


def test_little_that_decompresses_to_much_is_refused(tmp_path: Path) -> None:
    """10 MB of zeros behind a stated size of one byte; no more than that is decompressed."""
    bomb = base64.b64encode(zlib.compress(bytes(10_000_000))).decode()
    html = embed([Attachment("a", b"x")])
    encoded = re.findall(r'data-number="0">([^<]*)<', html)[0]
    with pytest.raises(ReportError, match="size and sha256"):
        read_attachments(page(tmp_path, html.replace(encoded, bomb)))


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ReportError, match="holds no files of a study"):
        read_attachments(page(tmp_path, ""))
    with pytest.raises(ReportError, match="no such file"):
        read_attachments(tmp_path / "none.html")
    with pytest.raises(ReportError, match="is a folder"):
        read_attachments(tmp_path)
    assert embed([]) == ""


def test_a_list_of_millions_is_refused_before_it_is_parsed(tmp_path: Path) -> None:
    sound = embed([Attachment("a.csv", b"x")])
    with pytest.raises(ReportError, match="its list of files: some 2000.* lists, objects and keys, more than"):
        read_attachments(page(tmp_path, sound.replace('"files": [', '"files": [' + "[]," * 2_000_000)))
