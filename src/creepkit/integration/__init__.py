"""The implicit adaptive integration of creep at a material point, in the compiled core.

Names load when first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from creepkit.integration.batch_integration import REASONS, Integration, PointTest, integrate
    from creepkit.integration.step_control import IntegrationSettings


__all__ = ["REASONS", "Integration", "IntegrationSettings", "PointTest", "integrate"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'creepkit.integration' has no attribute '{name}'")
    from creepkit.integration import batch_integration

    return getattr(batch_integration, name)
