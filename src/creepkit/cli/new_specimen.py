"""`creepkit new-specimen`: a specimen plugin to start from, as an installable package or as one file."""

from __future__ import annotations

from typing import Annotated

import typer

from creepkit.cli.new_package import PackageKind, write_plugin
from creepkit.errors import SolveError

SPECIMEN = PackageKind(
    "specimen",
    SolveError,
    edit="its lengths, outputs and one()",
    check="creepkit check $file",
    use="creepkit specimens\ncreepkit check $name",
    module='''\
"""$title: say here in one line what is loaded, and what is observed."""

from dataclasses import dataclass

import numpy as np

import creepkit as ck


@dataclass(frozen=True)
class ${class_name}Specimen(ck.PerTest):
    """A round bar under a force at its ends, observed by its elongation; put your test piece in its place."""

    gauge_length: float = ck.dimension(50.0)  # mm
    diameter: float = ck.dimension(8.0, tolerance=0.002)

    name = "$name"
    title = "$title"
    outputs = (ck.Output("elongation", "length", noise=0.002),)  # mm
    loads = (ck.Load("force", "force"),)  # N

    def one(self, law, values, history, nuisances):
        """One candidate in one test, {output: (times,)}: the elongation, mm, of a bar under dead weight."""
        force = history.loading.program()
        nominal = ck.RecordedLoading(ck.Program(force.times, force.values / self.area), "stress")
        bar = history.replace(loading=nominal, outputs={}, geometry={}, strain_measure="engineering")
        found = ck.specimen("uniaxial").predict(law, law.to_internal(values), [bar])
        elongation = self.gauge_length * found.of(0)[:, 0]
        return ck.OneTest({"elongation": elongation}, ck.Status(int(found.status[0, 0])), found.end_times[0, 0])

    @property
    def area(self):
        """Of the cross-section, mm^2."""
        return np.pi * self.diameter**2 / 4

    def reference_stress(self, history):
        """The von Mises stress, MPa, that stands for a test."""
        return float(np.max(history.loading.program().values)) / self.area


@ck.hookimpl
def creepkit_specimens():
    return [${class_name}Specimen()]
''',
    test='''\
import numpy as np
import pytest

import creepkit as ck

VALUES = {"A": 1e-16, "n": 4.0}
TIMES = np.linspace(3600.0, 3.6e6, 20)


def simulated(force: float) -> ck.History:
    return ck.simulate("norton", "$name", VALUES, loading=ck.constant_load("force", force), times=TIMES)


def test_it_keeps_what_every_specimen_promises() -> None:
    report = ck.check_specimen(ck.specimen("$name"))
    assert report.passed, str(report)


def test_it_is_the_closed_form_of_norton_creep_under_dead_weight() -> None:
    """d(ln l)/dt = A (s l/L)^n has the solution l = L (1 - n A s^n t)^(-1/n)."""
    specimen = ck.specimen("$name")
    stress = specimen.reference_stress(simulated(4000.0))
    stretch = (1 - VALUES["n"] * VALUES["A"] * stress ** VALUES["n"] * TIMES) ** (-1 / VALUES["n"])
    elongation = specimen.gauge_length * (stretch - 1)
    np.testing.assert_allclose(simulated(4000.0).outputs["elongation"], elongation, rtol=1e-5)


def test_the_values_that_made_a_test_are_found_from_it() -> None:
    tests = [simulated(force).replace(name=f"{force:g} N") for force in (3000.0, 4000.0, 5000.0)]
    fit = ck.identify("norton", tests, "$name", starts=1, nuisances=[])
    assert fit.values["n"] == pytest.approx(VALUES["n"], rel=1e-3)
''',
)


def command(
    name: Annotated[str, typer.Argument(help="Name of the specimen, such as 'my-beam'.")],
    file: Annotated[bool, typer.Option("--file", help="One file, for --plugin and CREEPKIT_PLUGINS.")] = False,
) -> None:
    """Write a specimen to start from, as a package."""
    from creepkit.registry import default_registry

    write_plugin(SPECIMEN, name, default_registry().specimens(), one_file=file)
