"""Lowering of laws, each name once."""

from .interface import CompiledLaw as CompiledLaw
from .lowering import ArrayKernel as ArrayKernel
from .lowering import RateDerivatives as RateDerivatives
from .lowering import lower as lower
from .lowering import tension_point as tension_point
