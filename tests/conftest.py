"""What all tests share."""

import hashlib
import os
from pathlib import Path

SOURCES = Path(__file__).parents[1] / "src" / "creepkit"


def _cache_of_these_sources() -> str:
    """numba looks at the file of a compiled function alone, not at those it calls: one cache for each state of them."""
    digest = hashlib.sha256()
    for pattern in ("integration/*.py", "kernels/*.py", "fem/*.py", "specimens/gaussian_*.py"):
        for path in sorted(SOURCES.glob(pattern)):
            digest.update(path.read_bytes())
    return str(SOURCES.parents[1] / ".venv" / "numba" / digest.hexdigest()[:12])


os.environ.setdefault("NUMBA_CACHE_DIR", _cache_of_these_sources())
