"""Linear algebra on one thread while identifying.

Matrices of a test's frames are small: threads of BLAS then only wait for one another, and where cores are shared they
make an inversion of a millisecond one of forty.
"""

from __future__ import annotations

from contextlib import AbstractContextManager

from threadpoolctl import threadpool_limits


def single_threaded_blas() -> AbstractContextManager[object]:
    """Limit BLAS to one thread inside a with statement."""
    manager: AbstractContextManager[object] = threadpool_limits(1, user_api="blas")
    return manager
