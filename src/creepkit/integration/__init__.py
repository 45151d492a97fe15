"""The implicit adaptive integration of creep at a material point, compiled once for any law."""

from __future__ import annotations

from creepkit.integration.batch import Integration, PointTest, integrate
from creepkit.integration.point import Settings

__all__ = ["Integration", "PointTest", "Settings", "integrate"]
