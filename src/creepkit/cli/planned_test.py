"""A test that options describe: its specimen, its loading and the lengths of its test piece.

A load or a length of a specimen is an option of its name, `--pressure 8` or `--outer-radius 12`, whether creepkit knows
the specimen or a plugin brings it; `creepkit list specimens NAME` lists them. Any load may be written by its name as
well, `--load force=250`: that of a load whose name another option has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import make_dataclass
from typing import Any

from creepkit.cli.command_options import Levels
from creepkit.errors import SolveError
from creepkit.forecasts.planned_tests import (
    COMPONENTS,
    DescribedTest,
    PlannedTestOptions,
    specimen_taking,
    stated_temperature,
)
from creepkit.options import Options, option
from creepkit.records import Specimen, check_geometry, dimension_named, dimensions_of, known_specimens, loads_of

OF_COMMANDS = ("force", "load")
"""Names of options that every command has, or that are written by --load."""


class LoadsAndLengths(Options, title="loads and lengths"):
    """Base of a record with a field for each load and length of all specimens."""


def loads_and_lengths() -> type[Options]:
    """The record of the loads and lengths of the specimens that are known now, by name."""
    owners: dict[str, list[str]] = {}
    for specimen, one in known_specimens().items():
        for name in _names(one):
            owners.setdefault(name, []).append(specimen)
    lengths = {d.name for one in known_specimens().values() for d in dimensions_of(one)}
    fields = [
        (name, Levels, option((), f"{'mm, of' if name in lengths else 'Of'} {', '.join(known)}."))
        for name, known in owners.items()
        if name not in OF_COMMANDS
    ]
    return make_dataclass("LoadsAndLengths", fields, bases=(LoadsAndLengths,), frozen=True)


def _names(specimen: object) -> list[str]:
    """Loads and lengths of a specimen; a material point has those of stress and strain."""
    loads = [load.name for load in loads_of(specimen)]
    return [*(["stress", "strain"] if COMPONENTS in loads else loads), *(d.name for d in dimensions_of(specimen))]


def _flag(name: str) -> str:
    return f"--load {name}" if name in OF_COMMANDS else f"--{name.replace('_', '-')}"


def described_test(given: Mapping[str, Any], *others: Mapping[str, Levels] | None) -> DescribedTest:
    """The test of options and of loads and lengths by name; SolveError where they contradict each other."""
    import creepkit as ck

    options, stated = PlannedTestOptions().changed(given), dict[str, Levels]()
    for name, levels in (item for part in others if part for item in part.items()):
        stated[name] = (*stated.get(name, ()), *levels)
    loaded = (f"{name}_{one[0]}".rstrip("_") for name, levels in stated.items() for one in levels)
    specimen = ck.specimen(options.specimen or specimen_taking([*loaded]))
    own = {load.name: load for load in loads_of(specimen)}
    loads: dict[str, list[tuple[float, float]]] = {}
    lengths: dict[str, float] = {}
    for name, levels in stated.items():
        dimension = dimension_named(specimen, name)
        if name in own or (name in ("stress", "strain") and COMPONENTS in own):
            for component, start, value in levels:
                if COMPONENTS in own and not component:
                    raise SolveError(f"--{name} {value:g}: name the component, such as 11={value:g}")
                if component and COMPONENTS not in own:
                    raise SolveError(
                        f"{component} is a component of {name}, which --specimen {specimen.name} has not; give "
                        "--specimen point"
                    )
                loads.setdefault(f"{name}_{component}" if component else name, []).append((start, value))
        elif dimension is None:
            taken = ", ".join(map(_flag, _names(specimen)))
            raise SolveError(f"there is no option {_flag(name)}; --specimen {specimen.name} takes {taken or 'none'}")
        elif len(levels) > 1 or dimension.name in lengths:
            raise SolveError(f"{_flag(name)}: {dimension.name} is given twice; keep one of them")
        else:
            lengths[dimension.name] = levels[0][2]
    if not loads:
        named = "component" if COMPONENTS in own else " or ".join(own) or "load"
        ways = [f"{_flag(name)}, such as {_usual_level(specimen, name)}" for name in own]
        way = "--stress 11=100, or --strain 12=0.001" if COMPONENTS in own else " or ".join(ways)
        raise SolveError(f"specimen '{specimen.name}' needs a {named}: give {way}")
    check_geometry(specimen, lengths, "a length")
    return DescribedTest(specimen, options, loads, lengths, stated_temperature(options.temperature))


def _usual_level(specimen: Specimen, load: str) -> str:
    low, high = specimen.conditions.get(load, (100.0, 100.0))
    return f"{float(f'{(low * high) ** 0.5:.1g}'):g}"
