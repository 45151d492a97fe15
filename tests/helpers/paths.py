"""Where things lie that tests read."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests" / "golden"
EXAMPLES = ROOT / "examples"
SHARED = ROOT.parent / "shared" / "data"
"""Measured data and reference numbers that are not published with the package; tests that read them skip without."""

NO_SHARED_DATA = "the data of ../shared are not beside this checkout"
needs_shared_data = pytest.mark.skipif(not SHARED.is_dir(), reason=NO_SHARED_DATA)
