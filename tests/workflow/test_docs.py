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
MEASURED_BY_OTHERS = {"index"}
"""The page of docs/measured that no program of tests/benchmarks writes."""


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


def test_every_measured_page_has_its_program():
    """A page has the name of its program, or begins with it where a program writes several."""
    programs = tuple(path.stem for path in (ROOT / "tests" / "benchmarks").glob("*.py"))
    pages = {path.stem for path in (DOCS / "measured").glob("*.md")}
    assert [page for page in pages - MEASURED_BY_OTHERS if not page.startswith(programs)] == []


def test_measured_pages_end_with_the_command_that_repeats_them():
    """The command is that of the page's program, and has no option that the program does not know."""
    for page in (DOCS / "measured").glob("*.md"):
        if page.stem in MEASURED_BY_OTHERS:
            continue
        last = page.read_text(encoding="utf-8").splitlines()[-1]
        command = re.search(r"`python (tests/benchmarks/(\w+)\.py)( [^`]*)?`\.$", last)
        assert command, f"{page.name} does not end with its command"
        assert page.stem.startswith(command[2]), f"{page.name} is not written by {command[1]}"
        text = (ROOT / command[1]).read_text(encoding="utf-8")
        options = set(re.findall(r"--[a-z][a-z-]*", command[3] or "")) - {"--write"}
        assert [option for option in options if f'"{option}"' not in text] == [], page.name
        by_hand = re.search(r"kept by hand until `([\w./]+)` writes this page", last)
        assert not by_hand or by_hand[1] == command[1], page.name


def test_every_page_is_reachable_from_the_index():
    """Each folder of docs/ has an index whose table of contents names its pages, or takes all of them."""
    for index in [DOCS / "index.md", *DOCS.glob("*/index.md")]:
        text = index.read_text(encoding="utf-8")
        trees = re.findall(r"```\{toctree\}\n(.*?)```", text, flags=re.S)
        assert trees, f"{index} has no table of contents"
        if any(":glob:" in tree for tree in trees):
            continue
        entries = {line.strip() for tree in trees for line in tree.splitlines()}
        siblings = {path.stem for path in index.parent.glob("*.md")} - {"index"}
        assert siblings <= entries, f"{index} does not name {siblings - entries}"
