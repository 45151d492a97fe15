"""Options that identify and discover share beside the settings: changes of laws, subsets of tests, surrogates."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.generated_options import parsed_number

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.records import History, Predictor


FixOption = Annotated[
    list[str] | None,
    typer.Option("--fix", metavar="NAME=VALUE", help="Fix a parameter, in the law's unit, where a law has it."),
]


BoundOption = Annotated[
    list[str] | None, typer.Option("--bound", metavar="NAME=LOW:HIGH", help="Bounds of a parameter, in the law's unit.")
]


OnlyOption = Annotated[
    list[str] | None,
    typer.Option(
        "--only",
        metavar="LABEL=VALUE",
        help="Tests with this label alone: name, alloy, temperature (K), stress (MPa) or one of the files; may be "
        "given several times.",
    ),
]


SurrogateOption = Annotated[
    str | None, typer.Option(metavar="NAME", help="Identify through a surrogate alone, such as dimple; quicker.")
]


def surrogate_named(name: str | None) -> Predictor | None:
    """The surrogate of this name or file; None for none."""
    if name is None:
        return None
    import creepkit as ck

    return ck.surrogate(name)


def change_laws(laws: Sequence[CreepLaw], fix: Sequence[str] | None, bound: Sequence[str] | None) -> list[CreepLaw]:
    """The laws with parameters bounded and fixed, each where it has them; FitError for one that none has."""
    bounds = _parse_named("--bound", bound, _parse_bounds, "n=1:8")
    values = _parse_named("--fix", fix, _parse_number, "n=5")
    for option, changes in (("--bound", bounds), ("--fix", values)):
        for name in changes:
            _check_parameter(option, name, laws)
    return [law.with_bounds(**_of_law(bounds, law)).fix(**_of_law(values, law)) for law in laws]


def select_by_label(histories: Sequence[History], only: Sequence[str] | None) -> list[History]:
    """The tests that --only names; values of one label are alternatives."""
    from creepkit.errors import FitError
    from creepkit.records.history_selection import select_tests

    labels: dict[str, list[str]] = {}
    for text in only or ():
        label, separator, value = text.partition("=")
        if not separator:
            raise FitError(f"--only {text}: write LABEL=VALUE, such as temperature=1073 or name=test_1")
        labels.setdefault(label.strip(), []).append(value.strip())
    return select_tests(histories, **labels)


def _of_law(changes: Mapping[str, Any], law: CreepLaw) -> dict[str, Any]:
    return {name: change for name, change in changes.items() if name in law.names}


def _check_parameter(option: str, name: str, laws: Sequence[CreepLaw]) -> None:
    from creepkit.errors import FitError, nearest

    names = {known for law in laws for known in law.names}
    if name not in names:
        law_names = ", ".join(law.name for law in laws)
        raise FitError(f"{option} {name}: no parameter of {law_names} is called '{name}'; {nearest(name, names)}")


def _parse_named(option: str, texts: Sequence[str] | None, parse: Callable[[str], Any], example: str) -> dict[str, Any]:
    """{name: value} from texts NAME=VALUE."""
    from creepkit.errors import FitError

    values: dict[str, Any] = {}
    for text in texts or ():
        name, separator, value_text = (part.strip() for part in text.partition("="))
        if separator and name in values:
            raise FitError(f"{option} {text}: {name} is given twice; keep one of them")
        try:
            values[name] = parse(value_text)
        except ValueError:
            raise FitError(f"{option} {text} is not known; write {example}, finite numbers in the law's unit") from None
    return values


def _parse_number(text: str) -> float:
    number = parsed_number(text)
    if not math.isfinite(number):
        raise ValueError(text)
    return number


def _parse_bounds(text: str) -> tuple[float, float]:
    low, high = (_parse_number(end) for end in text.split(":"))
    return low, high
