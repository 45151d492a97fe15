"""What tests of generations share: a small one with processes or without, what it leaves behind, what it makes."""

from contextlib import nullcontext
from dataclasses import dataclass, field

import numpy as np
import pytest

from creepkit.dataset.dataset import COLUMNS
from creepkit.dataset.generation import generate
from creepkit.dataset.shards import GenerationJob
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


@dataclass
class Here:
    """A worker that is this very process: where no process matters, none is started."""

    job: GenerationJob
    submitted: list = field(default_factory=list)

    @property
    def free_slots(self):
        return 1 - len(self.submitted)

    def submit(self, number):
        self.submitted.append(number)

    def results(self, timeout):
        results = [run_task(self.job, number) for number in self.submitted]
        self.submitted.clear()
        return results


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
