"""A single implicit stage of a material point in six components, as the core solves it."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.core import address, function
from creepkit.integration.core_structures import TensorStructure, write_addresses
from creepkit.kernels.interface import CompiledLaw


class ConstitutiveResponse(NamedTuple):
    """What follows from a strain at the end of a stage.

    vector : (7 + S,) creep strains, equivalent creep strain and states after the stage.
    stress : (6,) MPa. tangent : (6, 6) MPa, consistent derivative of the stress to the strain.
    """

    vector: Floats
    stress: Floats
    tangent: Floats


def constitutive_response(
    law: CompiledLaw,
    theta: Floats,
    elastic: tuple[float, float],
    strain: Floats,
    base: Floats,
    time: float,
    temperature: float,
    weight: float,
) -> ConstitutiveResponse | None:
    """What follows from a strain at the end of a stage; None where there is no solution.

    theta : (P,) internal parameters. elastic : E, MPa, and nu. strain : (6,) total strain, tensor components.
    base : (7 + S,) creep strains, equivalent creep strain and states that the stage starts from.
    time, temperature : s and K, at the end. weight : s, of the stage.
    """
    theta, strain, base = (np.array(values, dtype=float) for values in (theta, strain, base))
    material = TensorStructure(update=law.update.address, states=law.states, modulus=elastic[0], ratio=elastic[1])
    write_addresses(material, {"theta": theta})
    found = ConstitutiveResponse(np.zeros(base.size), np.zeros(6), np.zeros((6, 6)))
    solved = function("creepkit_tensor_response")(
        ctypes.byref(material),
        address(strain),
        address(base),
        *(ctypes.c_double(number) for number in (time, temperature, weight)),
        *(address(array) for array in found),
    )
    return found if solved == 1 else None
