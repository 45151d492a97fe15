"""Options that describe a test, of simulate and predict, and the history that they describe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit import limits
from creepkit.cli.described_test import (
    check_modulus,
    check_options,
    further_options,
    parse_lengths,
    parse_loading,
    specimen_for,
    specimen_options,
)
from creepkit.cli.options import DEFAULT_SPECIMEN, parse_steps

if TYPE_CHECKING:
    from creepkit.records import History, Loading, Program, Specimen


StressOption = Annotated[
    list[str] | None,
    typer.Option(metavar="[NN=][S:]MPA", help="Of a bar, from S seconds on; of a point, of component NN (11=80)."),
]


StrainOption = Annotated[
    list[str] | None,
    typer.Option(metavar="[NN=][S:]STRAIN", help="Total strain of a bar in relaxation, or of a point's component."),
]


PressureOption = Annotated[
    list[str] | None, typer.Option(metavar="[S:]MPA", help="Gas pressure, from S seconds on, after a ramp of 5 s.")
]


ModulusOption = Annotated[
    float | None, typer.Option(help="Young's modulus, GPa; a bulge and a prescribed strain need it."), limits.GIGAPASCAL
]


GeometryOption = Annotated[
    list[str] | None, typer.Option(metavar="NAME=MM", help="A length of the test piece, such as apex_thickness=0.48.")
]


ControlOption = Annotated[str | None, typer.Option(help="Of a bar: load (held in each step) or stress (true).")]


RampOption = Annotated[float | None, typer.Option(help="s in which each level of a load is reached."), limits.RAMP]


def parse_temperature(texts: Sequence[str]) -> float | Program:
    """K, a number or a program, of texts such as 800 and 3600:820 in C."""
    from creepkit.errors import SolveError
    from creepkit.records import ZERO_CELSIUS, Program

    levels = [(start, celsius + ZERO_CELSIUS) for start, celsius in parse_steps(texts, "--temperature-c")]
    if levels[0][0] != 0.0:
        raise SolveError(
            f"--temperature-c {texts[0]}: nothing is said of the time before; give the first one from 0 s on"
        )
    return levels[0][1] if len(levels) == 1 else Program.steps(levels)


@dataclass(frozen=True)
class TestOptions:
    """The options that describe a test, as they were given; end_h : h, temperature : K, None where the law has none.

    context : of the command, which keeps options that only the specimen knows, its loads and lengths.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    end_h: float
    specimen: str | None = None
    stress: Sequence[str] | None = None
    strain: Sequence[str] | None = None
    pressure: Sequence[str] | None = None
    modulus_gpa: float | None = None
    geometry: Sequence[str] | None = None
    control: str | None = None
    ramp: float | None = None
    context: typer.Context | None = None


@dataclass(frozen=True)
class DescribedTest:
    """The specimen, the loading and the lengths, mm, of a test that options describe."""

    specimen: Specimen
    loading: Loading
    lengths: Mapping[str, float]


def described_test(options: TestOptions) -> DescribedTest:
    """What the options say of a test; SolveError where they contradict each other or leave out what is needed."""
    import creepkit as ck
    from creepkit.errors import SolveError

    usual = {"stress": options.stress, "strain": options.strain, "pressure": options.pressure}
    loads = {name: texts for name, texts in usual.items() if texts}
    specimen = ck.specimen(
        options.specimen or specimen_for({**loads, **further_options(options.context)}, DEFAULT_SPECIMEN)
    )
    further, lengths = specimen_options(specimen, options.context)
    loads |= further
    check_options(specimen, loads, options.control, options.ramp)
    for name, value in parse_lengths(specimen, options.geometry).items():
        if name in lengths:
            raise SolveError(f"--geometry {name}: {name} is given twice; keep one of them")
        lengths[name] = value
    loading = parse_loading(specimen, loads, options.control, options.ramp, 3600.0 * options.end_h)
    check_modulus(specimen, options.modulus_gpa, loads)
    return DescribedTest(specimen, loading, lengths)


def planned_test(options: TestOptions, temperature: float | Program) -> History:
    """The history of a test that is described by options, without outputs; temperature : K."""
    from creepkit.api.planned_tests import planned_history
    from creepkit.language import Elastic

    test = described_test(options)
    elastic = None if options.modulus_gpa is None else Elastic(1e3 * options.modulus_gpa)
    return planned_history(
        test.specimen,
        test.loading,
        3600.0 * options.end_h,
        temperature=temperature,
        elastic=elastic,
        lengths=test.lengths,
    )
