"""What tests of campaigns share: a small one with processes or without, what it leaves behind, what it makes."""

from contextlib import nullcontext
from dataclasses import dataclass, field

import numpy as np
import pytest

from creepkit.dataset import generation
from creepkit.dataset.dataset import COLUMNS
from creepkit.dataset.generation import generate
from creepkit.dataset.shards import Campaign
from creepkit.jobs.worker import run_task
from helpers.planted_sampling import BAR, Planted

ROWS = 16


def run(to, design=None, **how):
    """A campaign with worker processes."""
    how = {"samples": 40, "seed": 0, "workers": 2, "rows": ROWS, **how}
    return generate(design or Planted(), BAR, to=to, **how)


@dataclass
class Here:
    """A worker that is this very process: where no process matters, none is started."""

    generation: Campaign
    asked: list = field(default_factory=list)

    @property
    def free(self):
        return 1 - len(self.asked)

    def submit(self, number):
        self.asked.append(number)

    def answers(self, timeout):
        found = [run_task(self.campaign, number) for number in self.asked]
        self.asked.clear()
        return found


def run_here(to, design=None, **how):
    """The same campaign without processes."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(generation, "_crew", lambda one, workers, cluster: nullcontext(Here(one)))
        return run(to, design, **how)


def assert_same(one, other):
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    assert dict(one.failures) == dict(other.failures)


def shards_of(to):
    return sorted(to.with_name(f"{to.name}.parts").glob("[0-9]*.h5"))


def left_behind(folder):
    """Temporary files and claims."""
    return [p.name for p in folder.rglob("*") if p.name.endswith(".part") or p.name.endswith(".claim")]


def whole_of(tmp_path_factory):
    """The data set as it is when nothing goes wrong."""
    return run_here(tmp_path_factory.mktemp("whole") / "a.h5")
