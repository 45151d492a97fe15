"""The test that options describe: its specimen, its loading and the lengths of its test piece.

A load or a length of a specimen is an option of its name, `--force 250` or `--outer-radius 12`, whether creepkit knows
the specimen or a plugin brings it; `creepkit specimens NAME` lists them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import typer

from creepkit.cli.given_options import CheckedCommand
from creepkit.cli.options import parse_numbers, parse_steps

if TYPE_CHECKING:
    from creepkit.records import Load, Loading, Specimen


LoadTexts = Mapping[str, Sequence[str]]
"""{load: texts} as they were given, such as {"stress": ["80", "3600:90"]}."""


SPECIMEN_OPTIONS = "creepkit.specimen_options"
"""Where a command keeps, in the meta data of its context, options that are those of a specimen."""


COMPONENTS = "components"
"""The load of a material point, which --stress and --strain state with the names of components."""


LOAD_TEXT = re.compile(r"([0-9.]+:)?[+-]?[0-9.]+([eE][+-]?[0-9]+)?")
"""The value of a load: a number, or SECONDS:NUMBER."""


class TestCommand(CheckedCommand):
    """A command that takes the loads and lengths of any specimen as options, beside its own."""

    __test__ = False  # not a test case, whatever its name says to pytest

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Keep options that are none of the command's own for the specimen; each has one value.

        A number behind a flag makes it a load: `--force 250` is one, `--force` alone lets files be replaced.
        """
        own = {name for param in self.params for name in (*param.opts, *param.secondary_opts)} | {"--help"}
        kept: list[str] = []
        others: dict[str, list[str]] = {}
        waiting = list(args)
        while waiting:
            word = waiting.pop(0)
            name, separator, value = word.partition("=")
            flag = name in own and name != "--help" and not _takes_value(self.params, name)
            is_load = flag and (bool(separator) or bool(waiting and LOAD_TEXT.fullmatch(waiting[0])))
            if not name.startswith("--") or name == "--" or (name in own and not is_load):
                kept.append(word)
                if name in own and not separator and _takes_value(self.params, name):
                    kept += [waiting.pop(0)] if waiting else []
                continue
            if not separator:
                value = waiting.pop(0) if waiting else ""
            others.setdefault(name[2:].replace("-", "_"), []).append(value)
        ctx.meta[SPECIMEN_OPTIONS] = others
        return list(super().parse_args(ctx, kept))


def _takes_value(params: Sequence[Any], name: str) -> bool:
    return any(name in param.opts and not getattr(param, "is_flag", False) for param in params)


def specimen_for(loads: LoadTexts, default: str) -> str:
    """The specimen that takes the loads, where none is named: the default if it does, else the first that does."""
    from creepkit.records import known_specimens, loads_of

    names = {COMPONENTS} if any("=" in text for texts in loads.values() for text in texts) else set(loads)
    taking = [name for name, one in known_specimens().items() if names & {load.name for load in loads_of(one)}]
    return default if default in taking or not taking else taking[0]


def further_options(context: typer.Context | None) -> dict[str, list[str]]:
    """{name: texts} of the options of a TestCommand that only a specimen knows."""
    return {} if context is None else context.meta.get(SPECIMEN_OPTIONS, {})


def context_of(context: typer.Context | None) -> typer.Context:
    """The context of a command that has further options."""
    assert context is not None
    return context


def specimen_options(
    specimen: Specimen, context: typer.Context | None
) -> tuple[dict[str, Sequence[str]], dict[str, float]]:
    """The loads and lengths (mm) of a specimen among further options; a usage error for any other."""
    from creepkit.records import dimension_named, dimensions_of, loads_of

    loads = {load.name for load in loads_of(specimen)}
    texts: dict[str, Sequence[str]] = {}
    lengths: dict[str, float] = {}
    for name, values in further_options(context).items():
        option, dimension = f"--{name.replace('_', '-')}", dimension_named(specimen, name)
        if name in loads:
            texts[name] = values
        elif dimension is not None:
            if dimension.name in lengths:
                context_of(context).fail(f"{option}: {dimension.name} is given twice; keep one of them")
            lengths |= parse_numbers([f"{dimension.name}={value}" for value in values], option, f"{option} 12")
        else:
            known = [f"--{each.replace('_', '-')}" for each in (*loads, *(d.name for d in dimensions_of(specimen)))]
            context_of(context).fail(
                f"No such option: {option}; --specimen {specimen.name} takes {', '.join(sorted(known))}"
            )
    return texts, lengths


def check_options(specimen: Specimen, loads: LoadTexts, control: str | None, ramp: float | None) -> None:
    """SolveError for a load, or an option of a load, that a specimen does not take."""
    from creepkit.records import loads_of

    own = [load.name for load in loads_of(specimen)]
    allowed = {"stress", "strain"} if COMPONENTS in own else set(own)
    for name in loads:
        if own and name not in allowed:
            raise _not_of(specimen, f"--{name.replace('_', '-')}", name)
    if own and control is not None and "stress" not in own:
        raise _not_of(specimen, "--control", "stress")
    if own and ramp is not None and not {*own} - {"stress", COMPONENTS}:
        raise _not_of(specimen, "--ramp", "")


def _not_of(specimen: Specimen, option: str, load: str) -> Exception:
    """The error for an option of specimens that take a load; "" for one other than a stress."""
    from creepkit.errors import SolveError
    from creepkit.records import known_specimens, loads_of

    def takes(one: object) -> bool:
        names = {each.name for each in loads_of(one)}
        if load in ("stress", "strain") and option != "--control":
            return bool({load, COMPONENTS} & names)
        return load in names if load else bool(names - {"stress", COMPONENTS})

    others = [name for name, one in known_specimens().items() if takes(one)]
    allowed = f"--specimen {' or '.join(others)}" if others else "another specimen"
    return SolveError(f"{option} belongs to {allowed}, found --specimen {specimen.name}; leave one of them out")


def check_modulus(specimen: Specimen, modulus_gpa: float | None, loads: LoadTexts) -> None:
    """SolveError where a test cannot be simulated without a modulus, and none is given."""
    from creepkit.errors import SolveError
    from creepkit.records import loads_of

    of_components = COMPONENTS in {load.name for load in loads_of(specimen)}
    needed = "modulus" in getattr(specimen, "conditions", {}) or (of_components and "strain" in loads)
    if modulus_gpa is None and needed:
        raise SolveError(f"specimen '{specimen.name}' needs a modulus: give --modulus-gpa, such as 150")


def parse_loading(specimen: Specimen, loads: LoadTexts, control: str | None, ramp: float | None, end: float) -> Loading:
    """The loading of a test that ends at `end`, s."""
    from creepkit.errors import SolveError
    from creepkit.records import loads_of

    own = loads_of(specimen)
    component_texts = [text for texts in loads.values() for text in texts if "=" in text]
    takes_components = COMPONENTS in {load.name for load in own}
    if component_texts and own and not takes_components:
        raise SolveError(
            f"{component_texts[0]} names a component, which --specimen {specimen.name} has not; give --specimen point"
        )
    if component_texts or takes_components:
        return _component_loading(specimen, loads)
    if not loads:
        raise _no_load(specimen, own)
    if len(loads) > 1:
        options = " and ".join(f"--{name.replace('_', '-')}" for name in loads)
        raise SolveError(f"{options} are different loads of one test; leave all but one out")
    ((name, texts),) = loads.items()
    return _load(next((load for load in own if load.name == name), None), name, texts, control, ramp, end)


def _no_load(specimen: Specimen, own: Sequence[Load]) -> Exception:
    """The error that says what a specimen is loaded by, with an example of each load."""
    from creepkit.errors import SolveError

    if not own:
        return SolveError(f"specimen '{specimen.name}' needs a load: give one, such as --stress 100")
    forms = []
    for load in own:
        low, high = getattr(specimen, "conditions", {}).get(load.name, (1.0, 1.0))
        number = float(f"{(low * high) ** 0.5:.1g}")
        forms.append(f"--{load.name.replace('_', '-')}, such as {number:g}, or 7200:{1.2 * number:g} for a later step")
    names = " or ".join(load.name for load in own)
    return SolveError(f"specimen '{specimen.name}' needs a {names}: give {', or '.join(forms)}")


def _load(
    load: Load | None, name: str, texts: Sequence[str], control: str | None, ramp: float | None, end: float
) -> Loading:
    """One load by steps; its ramp is the load's own where none is given."""
    from creepkit.api.planned_tests import stepped_load
    from creepkit.errors import SolveError

    option = f"--{name.replace('_', '-')}"
    steps = parse_steps(texts, option)
    try:
        return stepped_load(name, load, steps, control=control, ramp=ramp, end=end)
    except SolveError as error:
        given = "--" if str(error).startswith("control") else f"{option} {' '.join(texts)}: "
        raise SolveError(f"{given}{error}") from None


def _component_loading(specimen: Specimen, loads: LoadTexts) -> Loading:
    from creepkit.errors import SolveError
    from creepkit.records import PointLoading

    if not loads:
        raise SolveError(f"specimen '{specimen.name}' needs a component: give --stress 11=100, or --strain 12=0.001")
    return PointLoading(*(_component_steps(loads.get(kind, ()), f"--{kind}") for kind in ("stress", "strain")))


def _component_steps(texts: Sequence[str], option: str) -> dict[str, list[tuple[float, float]]]:
    """Steps by component, in the order in which they were given."""
    from creepkit.errors import SolveError

    steps_by_component: dict[str, list[tuple[float, float]]] = {}
    for text in texts:
        name, separator, value_text = text.partition("=")
        if not separator:
            raise SolveError(f"{option} {text}: name the component of a material point, such as 11={text}")
        steps_by_component.setdefault(name.strip(), []).extend(parse_steps([value_text], option))
    for name, pairs in steps_by_component.items():
        if pairs[0][0] != 0.0:
            pairs.insert(0, (0.0, 0.0))  # until its first step a component is at rest
        if sorted(pairs) != pairs:
            raise SolveError(f"{option}: the steps of component {name} must follow one another in time")
    return steps_by_component


def parse_lengths(specimen: Specimen, texts: Sequence[str] | None) -> dict[str, float]:
    """{length: mm} of texts such as apex_thickness=0.48."""
    from creepkit.errors import SolveError
    from creepkit.records import check_geometry, dimensions_of

    known = [d.name for d in dimensions_of(specimen)]
    lengths = parse_numbers(texts or (), "--geometry", f"{known[0] if known else 'span'}=0.48")
    if lengths and not known:
        raise SolveError(f"--geometry: specimen '{specimen.name}' has no lengths; leave it out")
    check_geometry(specimen, lengths, "--geometry")
    return lengths
