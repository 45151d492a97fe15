"""The elastic part of what is observed, for readings that were taken without it, as after unloading."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from creepkit.arrays import Floats
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.records import History, specimen_of
from creepkit.records.specimen_lookup import outputs_of


def with_elastic_part(plan: History, outputs: Mapping[str, Floats], say: Callable[[str], None]) -> dict[str, Floats]:
    """Outputs (frames,) that were read without their elastic part, with it; `say` is told what was added.

    outputs : {name: (frames,)}. A specimen predicts both together, under the load and with the elastic data of `plan`.
    What does not grow is kept.
    """
    specimen = specimen_of(plan)
    growing = [one for one in outputs_of(specimen) if one.grows and one in outputs]
    if specimen is None or not growing:
        return dict(outputs)
    shown = " and ".join(growing)
    if plan.elastic is None:
        say(f"the elastic part in {shown} all the same; no modulus tells how large it is")
        return dict(outputs)
    (A,) = parameters("A")
    law = CreepLaw("elastic", {"creep": A * stress}, {A: Param("no creep", unit="1/s", bounds=(1e-60, 1), scale="log")})
    found = specimen.predict(law, law.to_internal({"A": 1e-50})[None], [plan])
    part = dict(zip(found.outputs, found.values[0, 0].T, strict=True))
    largest = " and ".join(f"{np.nanmax(np.abs(part[one])):.2g} {one.unit}".rstrip() for one in growing)
    say(f"the elastic part under the load added to {shown}: {largest}")
    return {**outputs, **{str(one): outputs[one] + part[one] for one in growing}}
