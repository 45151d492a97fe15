"""What specimens say of themselves, for layers below the registry and for those that know a name only."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

from creepkit.errors import SolveError, nearest
from creepkit.records.specimen_record import Dimension, Load, Output

Registered = Any
"""A predictor; the interfaces of specimens and histories stand above this module."""


class StatedTest(Protocol):
    """What is read of a history here."""

    @property
    def specimen(self) -> str: ...  # noqa: D102
    @property
    def outputs(self) -> Mapping[str, Any]: ...  # noqa: D102
    @property
    def loading(self) -> Any: ...  # noqa: D102
    @property
    def origin(self) -> str: ...  # noqa: D102


def known_specimens() -> Mapping[str, Registered]:
    """{name: specimen} that the registry knows, when a name is looked up: it is a layer above this one."""
    from creepkit.registry import default_registry

    return default_registry().known_specimens()


def specimen_of(history: StatedTest) -> Registered | None:
    """The registered specimen that a history names; None where there is none of this name."""
    return known_specimens().get(history.specimen)


def outputs_of(predictor: Registered | None) -> tuple[Output, ...]:
    """The outputs of a predictor, then its optional ones; those of which it gives the names alone are numbers."""
    if predictor is None:
        return ()
    stated = dict.fromkeys((*predictor.outputs, *predictor.optional_outputs))
    known = {name: output for name in predictor.specimen.outputs if isinstance(output := name, Output)}
    return tuple(o if isinstance(o, Output) else known.get(o, Output(o)) for o in stated)


def outputs_of_tests(predictor: Registered, histories: Iterable[StatedTest]) -> tuple[str, ...]:
    """The outputs that a predictor gives of any of the tests, or of none: its `outputs`."""
    every = dict.fromkeys(name for history in histories for name in predictor.outputs_of_test(history))
    return tuple(every) or tuple(predictor.outputs)


def loads_of(predictor: Registered | None) -> tuple[Load, ...]:
    """The loads that a specimen, or a predictor that stands for one, takes; () where it does not say."""
    return () if predictor is None else tuple(predictor.specimen.loads)


def dimensions_of(predictor: Registered | None) -> tuple[Dimension, ...]:
    """The lengths of a specimen's test piece, with its own as defaults; () where it does not say."""
    return () if predictor is None else tuple(predictor.specimen.dimensions)


def lengths_by_default(specimen: str, geometry: Mapping[str, float]) -> dict[str, float]:
    """{length of a test piece that is not stated, which stresses rest on all the same: mm}."""
    pieces = [one for one in dimensions_of(known_specimens().get(specimen)) if one.of_piece]
    return {one.name: one.default for one in pieces if not {*one.names, one.name} & geometry.keys()}


def dimension_named(predictor: Registered, name: str) -> Dimension | None:
    """The length of a specimen's test piece of this name or alias; None where it has none."""
    return next((d for d in dimensions_of(predictor) if name in d.names), None)


def output_named(name: str, specimen: str = "") -> Output:
    """What is known of an output: what it says itself, the specimen of that name, or any that has such an output.

    An output that no known specimen has is a number.
    """
    if isinstance(name, Output):
        return name
    known = known_specimens()
    own = [known[specimen]] if specimen in known else []
    for candidate in (*own, *known.values()):
        for output in outputs_of(candidate):
            if output == name:
                return output
    return Output(name)


def output_unit(output: str, specimen: str = "") -> str:
    """The unit of an output, "" for a number without one."""
    return output_named(output, specimen).unit


def is_logarithmic(output: str) -> bool:
    """Whether tests scatter, and are compared, by the logarithm of an output."""
    return output_named(output).logarithmic


def growing_output(history: StatedTest) -> str:
    """The output of a history that shows creep best: the first that grows with it, else the first; "" for none."""
    stated = outputs_of(specimen_of(history))
    grows = [o for o in stated if o.grows and o in history.outputs]
    return str(next(iter([*grows, *history.outputs]), ""))


def load_named(quantity: str, specimen: str = "") -> Load | None:
    """What is known of a load: from the specimen of that name, else from any that takes such a load."""
    known = known_specimens()
    own = [known[specimen]] if specimen in known else []
    return next((load for one in (*own, *known.values()) for load in loads_of(one) if load.name == quantity), None)


def load_unit(history: StatedTest) -> str:
    """The unit of what is imposed in a test, MPa where no specimen says."""
    load = load_named(history.loading.quantity, history.specimen)
    return "MPa" if load is None else load.unit


def all_dimensions() -> dict[str, Dimension]:
    """{name or alias: length} over all registered specimens."""
    return {name: d for one in known_specimens().values() for d in dimensions_of(one) for name in d.names}


def check_load(predictor: Registered, history: StatedTest) -> None:
    """SolveError unless a specimen takes the load of a history."""
    loads = loads_of(predictor)
    if not loads or history.loading.quantity in (load.name for load in loads):
        return
    allowed = " or ".join(f"{load.name} ({load.unit})" if load.unit else load.name for load in loads)
    advice = " or ".join(_LOADINGS[load.quantity] for load in loads if load.quantity in _LOADINGS)
    raise SolveError(
        f"{history.origin}: specimen '{predictor.specimen.label}' is loaded by {allowed}, found "
        f"{history.loading.quantity}; use {advice or 'load_steps or constant_load'}"
    )


_LOADINGS = {
    "stress": "StressSteps or constant_stress",
    "strain": "StrainSteps or constant_strain",
    "pressure": "PressureJump",
}
"""{quantity of a load: how it is written}."""


def check_geometry(predictor: Registered, names: Iterable[str], where: str) -> None:
    """SolveError for a length that the test piece of a specimen does not have."""
    known = [d.name for d in dimensions_of(predictor)]
    for name in names:
        if known and name not in known:
            raise SolveError(f"{where}: no length of the test piece is called '{name}'; {nearest(name, known)}")
