"""Some mutations of every format's sample; tests/benchmarks/reader_fuzz.py reads thousands, with limits."""

import signal
import sys
from pathlib import Path

import pytest

from helpers.paths import ROOT
from helpers.reader_samples import all_samples

sys.path.insert(0, str(ROOT / "tests" / "benchmarks"))

from reader_fuzz import FAULTS, Hang, outcome

COUNT = 40
SAMPLES = all_samples()


@pytest.fixture(autouse=True)
def hangs_stop():
    def stop(number, frame):
        raise Hang

    before = signal.signal(signal.SIGPROF, stop)
    yield
    signal.signal(signal.SIGPROF, before)


@pytest.mark.parametrize("name", SAMPLES)
def test_mutated_files(name: str, tmp_path: Path):
    """Seeds of their own: the program begins at 0."""
    sample = SAMPLES[name]
    good = sample.read(sample.write(tmp_path))
    found = {seed: outcome(sample, good, seed, tmp_path) for seed in range(-1000, COUNT - 1000)}
    assert {seed: one for seed, one in found.items() if one[1] in FAULTS} == {}
