"""What all tests share."""

from creepkit.cli.compiled import set_numba_cache

set_numba_cache()
