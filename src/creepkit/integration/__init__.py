"""The implicit adaptive integration of creep at a material point, and of fibres, in the compiled core.

Names load when first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from creepkit.integration.batch_integration import REASONS, Integration, PointTest, integrate
    from creepkit.integration.fibre_integration import (
        FibreHistory,
        FibreResponse,
        FibreState,
        FibreTest,
        integrate_fibres,
        step_fibres,
    )
    from creepkit.integration.fibre_model import FibreInput, FibreModel, gauss_fibres, gauss_points
    from creepkit.integration.step_control import IntegrationSettings


_OF_POINTS = ["REASONS", "Integration", "IntegrationSettings", "PointTest", "integrate"]


_OF_MODELS = ["FibreInput", "FibreModel", "gauss_fibres", "gauss_points"]


_OF_FIBRES = ["FibreHistory", "FibreResponse", "FibreState", "FibreTest", "integrate_fibres", "step_fibres"]


__all__ = [
    "REASONS",
    "FibreHistory",
    "FibreInput",
    "FibreModel",
    "FibreResponse",
    "FibreState",
    "FibreTest",
    "Integration",
    "IntegrationSettings",
    "PointTest",
    "gauss_fibres",
    "gauss_points",
    "integrate",
    "integrate_fibres",
    "step_fibres",
]


def __getattr__(name: str) -> Any:
    for names, module in (
        (_OF_POINTS, "batch_integration"),
        (_OF_MODELS, "fibre_model"),
        (_OF_FIBRES, "fibre_integration"),
    ):
        if name in names:
            return getattr(import_module(f"creepkit.integration.{module}"), name)
    raise AttributeError(f"module 'creepkit.integration' has no attribute '{name}'")
