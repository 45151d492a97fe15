"""What is published beside the code says the same as the code: versions, systems, steps, licence."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml

import creepkit as ck
from helpers.paths import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
WORKFLOW = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))
JOBS = WORKFLOW["jobs"]


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def declared_pythons() -> list[str]:
    found = [re.fullmatch(r"Programming Language :: Python :: (3\.\d+)", one) for one in PROJECT["classifiers"]]
    return [match[1] for match in found if match]


def steps(job: str) -> list[str]:
    return [step["run"] for step in JOBS[job]["steps"] if "run" in step]


def test_versions_of_python_agree_everywhere() -> None:
    pythons = declared_pythons()
    assert PROJECT["requires-python"] == f">={pythons[0]}"
    assert JOBS["tests"]["strategy"]["matrix"]["python"] == pythons
    assert re.search(r"^PYTHONS := (.*)$", text("Makefile"), re.M)[1].split() == [f"python{one}" for one in pythons]
    assert tomllib.loads(text("pyproject.toml"))["tool"]["mypy"]["python_version"] == pythons[0]
    assert f"Python {pythons[0]}, " in text("README.md")


def test_the_workflow_calls_the_scripts_of_this_folder() -> None:
    assert "bash .ci/run" in steps("everything")
    assert "bash .ci/tests" in steps("tests")
    for script in re.findall(r"\.ci/[\w.]+", " ".join([*steps("everything"), *steps("tests"), text(".ci/run")])):
        assert (ROOT / script).is_file(), script


def test_ci_runs_the_programs_on_hostile_input_in_their_short_forms() -> None:
    assert "tests/benchmarks/all.py --short" in text(".ci/run")


def test_the_short_script_runs_the_same_tests_as_make() -> None:
    """Other systems have no make; the installation and the tests are those of the Makefile."""
    for part in ("hatchling>=1.26", "editables>=0.5", "src/core/compile.py", "-n 2 --dist loadgroup"):
        assert part in text(".ci/tests"), part
        assert part in text("Makefile"), part


def test_every_system_is_tested_and_has_wheels_of_its_processors() -> None:
    """PyTorch, which creepkit requires, has no packages for Macs with processors of Intel since 2.3."""
    systems = {"ubuntu": {"x86_64", "aarch64"}, "macos": {"arm64"}, "windows": {"amd64", "arm64"}}
    tested = JOBS["tests"]["strategy"]["matrix"]["os"]
    built = [(one["os"], one["arch"].lower()) for one in JOBS["wheels"]["strategy"]["matrix"]["include"]]
    for runner, processors in systems.items():
        assert any(one.startswith(runner) for one in tested)
        assert {arch for system, arch in built if system.startswith(runner)} == processors


def test_claimed_is_only_the_system_on_which_tests_have_run() -> None:
    """The workflow has not been run: of macOS and Windows nothing more than a simulation is known."""
    claimed = [one.rpartition(" ")[2] for one in PROJECT["classifiers"] if one.startswith("Operating System")]
    assert claimed == ["Linux"]
    assert "have not been run on macOS and Windows" in text("README.md")


def test_one_wheel_serves_all_versions_of_python() -> None:
    (build,) = [step for step in JOBS["wheels"]["steps"] if "cibuildwheel" in step.get("uses", "")]
    assert build["env"]["CIBW_BUILD"] == f"cp{declared_pythons()[0].replace('.', '')}-*"
    assert "py3-none-" in text("hatch_build.py")


def test_citation_agrees_with_the_package() -> None:
    citation = yaml.safe_load(text("CITATION.cff"))
    assert citation["version"] == ck.__version__
    assert citation["title"] == PROJECT["name"]
    assert citation["license"] == PROJECT["license"]
    assert {"cff-version", "message", "authors", "type"} <= citation.keys()


def test_the_licence_is_that_of_all_plugins() -> None:
    assert text("LICENSE").lstrip().startswith("Apache License")
    for path in ROOT.glob("plugins/*/pyproject.toml"):
        plugin = tomllib.loads(path.read_text(encoding="utf-8"))["project"]
        assert plugin.get("license", PROJECT["license"]) == PROJECT["license"], path
        assert plugin["requires-python"] == PROJECT["requires-python"], path


def test_the_changelog_has_the_form_of_keep_a_changelog() -> None:
    headings = re.findall(r"^## (.*)$", text("CHANGELOG.md"), re.M)
    assert headings[0] == "[Unreleased]"
    assert all(re.fullmatch(r"\[\d+\.\d+\.\d+\] - \d{4}-\d\d-\d\d", one) for one in headings[1:])
    kinds = set(re.findall(r"^### (.*)$", text("CHANGELOG.md"), re.M))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


def test_lower_bounds_are_of_what_is_required() -> None:
    """.ci/lower_bounds.py reads requirements of this form alone."""
    assert all(re.fullmatch(r"[\w-]+>=[\d.]+", one) for one in PROJECT["dependencies"])


@pytest.mark.parametrize("name", ["CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"])
def test_links_lead_somewhere(name: str) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", text(name)):
        assert link.startswith("https://") or (ROOT / Path(link.partition("#")[0])).exists(), link


def test_every_guide_to_extend_it_is_named() -> None:
    guides = {path.name for path in (ROOT / "docs" / "extend").glob("write_*.md")}
    assert guides <= set(re.findall(r"docs/extend/(\w+\.md)", text("CONTRIBUTING.md")))
