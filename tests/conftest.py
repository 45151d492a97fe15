"""What all tests share."""

from creepkit.cli import set_numba_cache

set_numba_cache()
