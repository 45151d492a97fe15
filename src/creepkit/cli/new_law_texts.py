"""What `creepkit new-law` writes: a law, and the package around it."""

from __future__ import annotations

from string import Template

LAW_TEMPLATE = Template('''\
"""$title: say here in one line what the law describes."""

from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress

A, n = parameters("A n")

$constant = CreepLaw(
    name="$name",
    title="$title",
    terms={"power law": A * stress**n},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0),
        n: Param("stress exponent", bounds=(1, 8)),
    },
    references=("Author (year), journal volume, page",),
)


@hookimpl
def creepkit_laws():
    return [$constant]
''')

PROJECT_TEMPLATE = Template("""\
[build-system]
requires = ["hatchling>=1.26"]
build-backend = "hatchling.build"

[project]
name = "$package"
version = "0.1.0"
description = "$title, a creep law as a plugin of creepkit"
readme = "README.md"
requires-python = ">=3.11"
dependencies = ["creepkit"]

[project.entry-points.creepkit]
$name = "$module"

[tool.hatch.build]
include = ["$module.py"]
""")

README_TEMPLATE = Template("""\
# $package

$title: say here what it describes, and where it was published.

    pip install -e .
    creepkit laws $name
    creepkit check $name
    pytest
""")

TEST_TEMPLATE = Template("""\
import creepkit
from creepkit.testing import check_law


def test_it_keeps_what_every_law_promises() -> None:
    report = check_law(creepkit.law("$name"))
    assert report.ok, str(report)
""")
