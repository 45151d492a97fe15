"""What is published beside the code says the same as the code: versions, systems, steps, licence."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml

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


@pytest.mark.parametrize("name", ["CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"])
def test_links_lead_somewhere(name: str) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", text(name)):
        assert link.startswith("https://") or (ROOT / Path(link.partition("#")[0])).exists(), link
