"""Lowering of laws: the log form of each term, its derivatives, and kernels for NumPy, torch and compiled code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.kernels.lowering import ArrayKernel, RateDerivatives, lower


__all__ = ["ArrayKernel", "CompiledLaw", "RateDerivatives", "lower"]


def __getattr__(name: str) -> Any:
    if name == "CompiledLaw":
        from creepkit.kernels.interface import CompiledLaw

        return CompiledLaw
    if name in __all__:
        from creepkit.kernels import lowering

        return getattr(lowering, name)
    raise AttributeError(f"module 'creepkit.kernels' has no attribute '{name}'")
