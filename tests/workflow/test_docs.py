"""The documentation as it stands in the tree: its links, its snippets, and the files and names that it mentions."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import creepkit as ck
from helpers.paths import ROOT

DOCS = ROOT / "docs"
WRITTEN_AT_BUILD = ("gallery", "laws/pages", "reference/pages")
"""Folders of docs/ that `make docs` fills."""

PAGES = [
    path
    for path in sorted([ROOT / "README.md", *ROOT.glob("plugins/*/README.md"), *DOCS.rglob("*.md")])
    if not any(path.is_relative_to(DOCS / folder) for folder in WRITTEN_AT_BUILD)
]


def page_name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def python_blocks(path: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", path.read_text(encoding="utf-8"), flags=re.S)


def exists_after_build(path: Path) -> bool:
    """Whether a link into a folder that `make docs` fills will lead somewhere."""
    folder = next(DOCS / folder for folder in WRITTEN_AT_BUILD if path.is_relative_to(DOCS / folder))
    if folder.name != "gallery":
        return path.stem in {"index", "public_names"}
    return path.stem == "index" or (ROOT / "examples" / f"{path.stem}.py").is_file()


@cache
def reports_of_studies() -> set[str]:
    """{folder/name} of the reports that `make docs` has studies write."""
    studies = [(path, ck.Study.load(path).file.model.report) for path in ROOT.glob("examples/studies/*/*.toml")]
    return {f"{path.parent.name}/{report.file.removesuffix('.html')}" for path, report in studies if report}


def broken_links(page: Path) -> Iterator[str]:
    """Links of a page that lead nowhere, or out of the project."""
    text = re.sub(r"```.*?```|`[^`]*`", "", page.read_text(encoding="utf-8"), flags=re.S)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"https?://|#", link):
            continue
        target = (page.parent / link.partition("#")[0]).resolve()
        if link.startswith("report:"):
            leads = link.removeprefix("report:") in reports_of_studies()
        elif any(target.is_relative_to(DOCS / folder) for folder in WRITTEN_AT_BUILD):
            leads = exists_after_build(target)
        else:
            leads = target.is_relative_to(ROOT) and target.exists()
        if not leads:
            yield f"{page_name(page)}: {link} leads nowhere inside the project"


def wrong_names(page: Path) -> Iterator[str]:
    """Files that a page mentions and that there are not, paths outside the project, and names that are not public."""
    text = page.read_text(encoding="utf-8")
    for name in re.findall(r"`((?:src|tests|docs|plugins|examples)/[\w./-]+)", text):
        if not (ROOT / name).exists():
            yield f"{page_name(page)}: {name} does not exist"
    for match in re.findall(r"(?<![\w.])/(?:home|tmp|work|root|usr|opt|mnt|Users)/|~/", text):
        yield f"{page_name(page)}: names {match}"
    for block in python_blocks(page):
        compile(block, str(page), "exec")
        for name in set(re.findall(r"\bck\.(\w+)", block)) - {*ck.__all__, "__version__"}:
            yield f"{page_name(page)}: creepkit has no public {name}"


def test_pages_link_and_name_what_there_is() -> None:
    assert [wrong for page in PAGES for wrong in (*broken_links(page), *wrong_names(page))] == []


def test_the_files_of_the_guide_are_read(tmp_path):
    """Each says what its head and its columns mean: nothing of it becomes a label that was not meant as one."""
    text = (DOCS / "how-to" / "write_a_test_file.md").read_text(encoding="utf-8")
    found, blocks = [], re.findall(r"```text\n(.*?)```", text, re.S)
    for k, block in enumerate(blocks):
        (tmp_path / f"{k}.csv").write_text(block, encoding="utf-8")
        found += ck.read_histories(tmp_path / f"{k}.csv")
    bar, dimple, rings, beam, correlated = found
    assert set(bar.labels) == {"heat", "laboratory", "assumed"}
    assert bar.standard_deviation["strain"] == pytest.approx(2e-5)
    assert (dimple.labels, dimple.geometry) == ({}, {"apex_thickness": 0.502})
    assert dimple.standard_deviation["amplitude"] == pytest.approx(2e-3)
    assert (rings.labels, rings.operator) == ({}, "rings 0, 2, 4 mm")
    assert list(rings.outputs) == ["displacement_1", "displacement_2", "displacement_3"]
    assert (beam.labels, beam.geometry) == ({}, {"height": 2.02})
    assert beam.outputs["deflection"] == pytest.approx([0.031, 0.052])
    assert correlated.noise_correlation["width", "shape"] == -0.5
    assert correlated.labels == {}
    alone = "\n".join(line.rsplit(",", 3)[0] if line[0] != "#" else line for line in blocks[1].splitlines())
    (tmp_path / "alone.csv").write_text(alone, encoding="utf-8")
    assert list(ck.read_histories(tmp_path / "alone.csv")[0].outputs) == ["amplitude"]
