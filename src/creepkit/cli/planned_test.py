"""Options that describe a test, of simulate and predict, and the history that they describe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit.cli.options import (
    BULGE,
    MATERIAL_POINT,
    RELAXATION,
    UNIAXIAL,
    check_options,
    parse_loading,
    parse_numbers,
    parse_steps,
)

if TYPE_CHECKING:
    from creepkit.records import History, Program, Specimen


StressOption = Annotated[
    list[str] | None,
    typer.Option(metavar="[NN=][S:]MPA", help="Of a bar, from S seconds on; of a point, of component NN (11=80)."),
]


StrainOption = Annotated[
    list[str] | None,
    typer.Option(metavar="[NN=][S:]STRAIN", help="Total strain of a bar in relaxation, or of a point's component."),
]


PressureOption = Annotated[
    list[str] | None, typer.Option(metavar="[S:]MPA", help="On a dimple, from S seconds on, after a ramp of 5 s.")
]


ModulusOption = Annotated[
    float | None, typer.Option(help="Young's modulus, GPa; a dimple and a prescribed strain need it.")
]


GeometryOption = Annotated[
    list[str] | None, typer.Option(metavar="NAME=MM", help="A length of the dimple, such as apex_thickness=0.48.")
]


ControlOption = Annotated[str | None, typer.Option(help="Of a bar: load (held in each step) or stress (true).")]


RampOption = Annotated[float | None, typer.Option(min=0, help="Of a strain: s in which each is reached.")]


PLANNED_FRAMES = 100
"""Of a planned test, half spread over time and half over its logarithm."""


LONGEST_TEST = 1e9
"""h."""


def check_duration(hours: float) -> None:
    """SolveError for what is no duration of a test in h."""
    from creepkit.errors import SolveError

    if not 0 < hours < LONGEST_TEST:
        raise SolveError(f"--end-h {hours:g} is not a time above zero (and below {LONGEST_TEST:.0e} h)")


def check_modulus(specimen: str, modulus_gpa: float | None, strain: Sequence[str] | None) -> None:
    """SolveError where a test cannot be simulated without a modulus, and none is given."""
    from creepkit.errors import SolveError

    if modulus_gpa is None and (specimen in (BULGE, RELAXATION) or (specimen == MATERIAL_POINT and strain)):
        requirement = "a dimple" if specimen == BULGE else "a prescribed strain"
        raise SolveError(f"{requirement} needs a modulus: give --modulus-gpa, such as 150")


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


def with_geometry(specimen: Specimen, texts: Sequence[str] | None) -> Specimen:
    """The specimen with its lengths changed."""
    lengths = parse_lengths(specimen, texts)
    return specimen.replace(**lengths) if lengths else specimen  # type: ignore[attr-defined]


def parse_lengths(specimen: Specimen, texts: Sequence[str] | None) -> dict[str, float]:
    """{length: mm} of texts such as apex_thickness=0.48."""
    from creepkit.errors import SolveError, nearest

    lengths = parse_numbers(texts or (), "--geometry", "apex_thickness=0.48")
    known_lengths = getattr(getattr(specimen, "geometry", None), "lengths", ())
    for name in lengths:
        if name not in known_lengths:
            raise SolveError(f"--geometry: no length is called '{name}'; {nearest(name, known_lengths)}")
    return lengths


@dataclass(frozen=True)
class TestOptions:
    """The options that describe a test, as they were given; end_h : h, temperature : K."""

    __test__ = False  # not a test case, whatever its name says to pytest

    end_h: float
    temperature: float | Program
    specimen: str | None = None
    stress: Sequence[str] | None = None
    strain: Sequence[str] | None = None
    pressure: Sequence[str] | None = None
    modulus_gpa: float | None = None
    geometry: Sequence[str] | None = None
    control: str | None = None
    ramp: float | None = None


def planned_test(options: TestOptions) -> History:
    """The history of a test that is described by options, without outputs."""
    import numpy as np

    import creepkit as ck
    from creepkit.language import Elastic
    from creepkit.records import History

    stress, strain, pressure = options.stress, options.strain, options.pressure
    kind = options.specimen or (BULGE if pressure else RELAXATION if strain and not stress else UNIAXIAL)
    record = ck.specimen(kind)
    given = {"--stress": stress, "--strain": strain, "--pressure": pressure, "--control": options.control}
    check_options(kind, {**given, "--ramp": options.ramp, "--geometry": options.geometry})
    check_duration(options.end_h)
    check_modulus(kind, options.modulus_gpa, strain)
    end, half = 3600.0 * options.end_h, PLANNED_FRAMES // 2
    times = np.union1d(np.geomspace(1e-3 * end, end, half), np.linspace(end / half, end, half))
    return History(
        name="planned test",
        times=times,
        outputs={},
        loading=parse_loading(kind, stress, strain, pressure, options.control, options.ramp, end),
        temperature=options.temperature,
        specimen=kind,
        elastic=None if options.modulus_gpa is None else Elastic(1e3 * options.modulus_gpa),
        geometry=parse_lengths(record, options.geometry),
    )
