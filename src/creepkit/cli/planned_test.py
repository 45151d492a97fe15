"""A test that options describe: its specimen, its loading and the lengths of its test piece.

A load or a length of a specimen is an option of its name, `--force 250` or `--outer-radius 12`, whether creepkit knows
the specimen or a plugin brings it; `creepkit list specimens NAME` lists them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from typer.core import TyperCommand

from creepkit.api.options import PlannedTestOptions, elastic_of
from creepkit.cli.command_options import pair, steps
from creepkit.cli.shared import DEFAULT_SPECIMEN
from creepkit.errors import SolveError
from creepkit.forecasts.planned_tests import (
    COMPONENTS,
    load_of_components,
    needs_modulus,
    planned_history,
    stepped_load,
)
from creepkit.records import (
    ZERO_CELSIUS,
    History,
    Program,
    check_geometry,
    dimension_named,
    dimensions_of,
    known_specimens,
    loads_of,
)

if TYPE_CHECKING:
    from creepkit.records import Load, Loading, Specimen

LOAD_TEXT = re.compile(r"([0-9.]+:)?[+-]?[0-9.]+([eE][+-]?[0-9]+)?")
"""The value of a load: a number, or SECONDS:NUMBER."""


class Command(TyperCommand):
    """A command that takes the loads and lengths of any specimen as options, beside its own."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Keep options that are none of the command's own for the specimen; each has one value.

        A number behind a flag makes it a load: `--force 250` is one, `--force` alone lets files be replaced.
        """
        takes_value = {
            name: not getattr(param, "is_flag", False)
            for param in self.params
            for name in (*param.opts, *param.secondary_opts)
        } | {"--help": False}
        kept: list[str] = []
        others: dict[str, list[str]] = {}
        waiting = list(args)
        while waiting:
            word = waiting.pop(0)
            name, separator, value = word.partition("=")
            is_own = name in takes_value
            is_load = is_own and not takes_value[name] and bool(waiting and LOAD_TEXT.fullmatch(waiting[0]))
            if not name.startswith("--") or name == "--" or (is_own and not is_load):
                kept.append(word)
                if is_own and not separator and takes_value[name] and waiting:
                    kept.append(waiting.pop(0))
                continue
            others.setdefault(name[2:].replace("-", "_"), []).append(
                value if separator else waiting.pop(0) if waiting else ""
            )
        ctx.obj = others
        return list(super().parse_args(ctx, kept))

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Name the loads and lengths of all specimens, which are options as well."""
        with formatter.section("Loads, [S:]NUMBER from S seconds on, and lengths, mm, by specimen"):
            rows = [(name, ", ".join(_flags(one))) for name, one in known_specimens().items()]
            formatter.write_dl([(name, text) for name, text in rows if text])


def _flags(specimen: object) -> list[str]:
    """The options of a specimen; a material point has those of stress and strain."""
    loads = [load.name for load in loads_of(specimen)]
    loads = ["stress", "strain"] if COMPONENTS in loads else loads
    return [f"--{name.replace('_', '-')}" for name in (*loads, *(d.name for d in dimensions_of(specimen)))]


@dataclass(frozen=True)
class DescribedTest:
    """What options say of a test; lengths : mm of its test piece, temperature : K, None where nothing is said."""

    options: PlannedTestOptions
    specimen: Specimen
    loading: Loading
    lengths: Mapping[str, float]
    temperature: float | Program | None

    def history(self, temperature: float | Program) -> History:
        """The planned test, without outputs; temperature : K, where the options say none."""
        chosen = self.options
        return planned_history(
            self.specimen,
            self.loading,
            float(chosen.end or 0.0),
            temperature=temperature if self.temperature is None else self.temperature,
            elastic=elastic_of(chosen.modulus),
            lengths=self.lengths,
        )


def described_test(given: Mapping[str, Any], others: Mapping[str, Sequence[str]]) -> DescribedTest:
    """The test of options and of loads and lengths by name; SolveError where they contradict each other."""
    import creepkit as ck

    options = PlannedTestOptions().changed(given)
    specimen = ck.specimen(options.specimen or _specimen_for(others))
    own = {load.name: load for load in loads_of(specimen)}
    loads: dict[str, Sequence[str]] = {}
    lengths: dict[str, float] = {}
    for name, texts in others.items():
        dimension = dimension_named(specimen, name)
        flag = f"--{name.replace('_', '-')}"
        if name in own or (name in ("stress", "strain") and COMPONENTS in own):
            loads[name] = texts
        elif dimension is None:
            taken = ", ".join(_flags(specimen))
            raise SolveError(f"there is no option {flag}; --specimen {specimen.name} takes {taken or 'none'}")
        elif len(texts) > 1 or dimension.name in lengths:
            raise SolveError(f"{flag}: {dimension.name} is given twice; keep one of them")
        else:
            ((_, lengths[dimension.name]),) = steps_of(texts, flag)
    check_geometry(specimen, lengths, "a length")
    end = float(options.end or 0.0)
    loading = _components(specimen, loads) if COMPONENTS in own else _loading(specimen, own, loads, options, end)
    if options.modulus is None and needs_modulus(specimen, loading):
        raise SolveError(f"specimen '{specimen.name}' needs a modulus: give --modulus-gpa, such as 150")
    temperature: float | Program | None = None
    if options.temperature:
        if options.temperature[0][0] != 0.0:
            raise SolveError("--temperature-c: nothing is said of the time before; give the first one from 0 s on")
        levels = [(start, celsius + ZERO_CELSIUS) for start, celsius in options.temperature]
        temperature = levels[0][1] if len(levels) == 1 else Program.steps(levels)
    return DescribedTest(options, specimen, loading, lengths, temperature)


def _specimen_for(others: Mapping[str, Sequence[str]]) -> str:
    """The specimen that takes the loads, where none is named: a bar if it does, else the first that does."""
    names = {COMPONENTS} if any("=" in text for texts in others.values() for text in texts) else set(others)
    taking = [name for name, one in known_specimens().items() if names & {load.name for load in loads_of(one)}]
    return DEFAULT_SPECIMEN if DEFAULT_SPECIMEN in taking or not taking else taking[0]


def steps_of(texts: Sequence[str], flag: str) -> list[tuple[float, float]]:
    """(start in s, value) pairs from texts such as 100 and 3600:120."""
    try:
        return list(steps(texts))
    except ValueError:
        raise SolveError(f"{flag} {' '.join(texts)}: write a number, or SECONDS:NUMBER for a later step") from None


def _loading(
    specimen: Specimen,
    own: Mapping[str, Load],
    loads: Mapping[str, Sequence[str]],
    options: PlannedTestOptions,
    end: float,
) -> Loading:
    """One load by steps; its ramp is the load's own where none is given."""
    if len(loads) != 1:
        flags = [f"--{name.replace('_', '-')}" for name in (loads or own or ("stress",))]
        if loads:
            raise SolveError(f"{' and '.join(flags)} are different loads of one test; leave all but one out")
        level = _usual_level(specimen, next(iter(own), ""))
        named = " or ".join(own) or "load"
        raise SolveError(f"specimen '{specimen.name}' needs a {named}: give {' or '.join(flags)}, such as {level}")
    ((name, texts),) = loads.items()
    component = next((text for text in texts if "=" in text), None)
    if component is not None:
        raise SolveError(
            f"{component} names a component, which --specimen {specimen.name} has not; give --specimen point"
        )
    flag = f"--{name.replace('_', '-')}"
    unknown = "control" if name != "stress" else "ramp"
    if getattr(options, unknown) is not None:
        raise SolveError(f"--{unknown} does not belong to {flag} of --specimen {specimen.name}; leave it out")
    try:
        return stepped_load(name, own[name], steps_of(texts, flag), control=options.control, ramp=options.ramp, end=end)
    except SolveError as error:
        raise SolveError(f"{flag} {' '.join(texts)}: {error}" if flag not in str(error) else str(error)) from None


def _usual_level(specimen: Specimen, load: str) -> str:
    low, high = specimen.conditions.get(load, (100.0, 100.0))
    return f"{float(f'{(low * high) ** 0.5:.1g}'):g}"


def _components(specimen: Specimen, loads: Mapping[str, Sequence[str]]) -> Loading:
    """Stresses and strains of components; until its first step a component is at rest."""
    if not loads:
        raise SolveError(f"specimen '{specimen.name}' needs a component: give --stress 11=100, or --strain 12=0.001")
    components: dict[str, dict[str, list[tuple[float, float]]]] = {"stress": {}, "strain": {}}
    for kind, texts in loads.items():
        for text in texts:
            try:
                name, value = pair(text)
            except ValueError:
                raise SolveError(f"--{kind} {text}: name the component, such as 11={text}") from None
            components[kind].setdefault(name, []).extend(steps_of([value], f"--{kind}"))
        for name, pairs in components[kind].items():
            if sorted(pairs) != pairs:
                raise SolveError(f"--{kind}: the steps of component {name} must follow one another in time")
    return load_of_components(components)
