"""What tests of generations share: a small one with processes or without, what it leaves behind, what it makes."""

from concurrent.futures import Future
from contextlib import nullcontext

import numpy as np
import pytest

from creepkit.dataset.dataset import COLUMNS
from creepkit.dataset.generation import GenerationJob, generate
from creepkit.jobs.worker_pools import ParallelExecution
from creepkit.jobs.worker_process import run_task
from helpers.planted_sampling import BAR, Planted

ROWS = 16
EXECUTION = {"workers", "cluster", "part", "shard_rows"}


def run(to, design=None, **how):
    """A generation with worker processes."""
    how = {"samples": 40, "seed": 0, "workers": 2, "shard_rows": ROWS, **how}
    execution = ParallelExecution(**{name: how.pop(name) for name in EXECUTION & how.keys()})
    return generate(design or Planted(), BAR, to=to, execution=execution, **how)


class Here:
    """A worker that is this very process: where no process matters, none is started."""

    size = 1

    def __init__(self, job: GenerationJob) -> None:
        self.job = job

    def submit(self, number):
        done = Future()
        done.set_result(run_task(self.job, number))
        return done


def run_here(to, design=None, **how):
    """The same generation without processes."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(ParallelExecution, "start", lambda execution, job: nullcontext(Here(job)))
        return run(to, design, **how)


def assert_same(one, other):
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    assert dict(one.failures) == dict(other.failures)


def shards_of(to):
    return sorted(to.with_name(f"{to.name}.parts").glob("[0-9]*.h5"))


def left_behind(folder):
    """Temporary files and locks."""
    return [p.name for p in folder.rglob("*") if p.name.endswith(".part") or p.name.endswith(".lock")]


def whole_of(tmp_path_factory):
    """The data set as it is when nothing goes wrong."""
    return run_here(tmp_path_factory.mktemp("whole") / "a.h5")
