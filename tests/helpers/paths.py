"""Where things lie that tests read."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests" / "golden"
EXAMPLES = ROOT / "examples"
SHARED = ROOT.parent / "shared" / "data"
"""Measured data and reference numbers that are not published with the package; tests that read them skip without."""
