"""`creepkit generate` and `creepkit data`: from a law to a file of samples, and what such a file holds."""

import json
import os
import re
import subprocess

import pytest
from typer.testing import CliRunner

from creepkit.cli.app import app
from helpers.paths import EXAMPLES
from helpers.written_files import names_in

EXAMPLES = EXAMPLES / "cluster"
BARS = ("norton", "--specimen", "uniaxial", "--interval", "3600", "--seed", "1")


def creepkit(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    to = tmp_path_factory.mktemp("made") / "bars.h5"
    result = creepkit("generate", *BARS, "--draws", 300, "--to", to, "--workers", 1)
    assert result.exit_code == 0, result.output
    return to, result


def test_generate_tells_what_it_made_and_how_far_it_was(made):
    to, result = made
    assert re.search(r"^300 samples of norton on uniaxial: \d+ accepted", result.stdout)
    assert f"wrote {to}" in result.stdout
    assert re.search(r"draws: 512 of 512 \(.*/s, 0 s left, \d+ % accepted\)", result.stderr)


def test_a_dry_run_simulates_nothing(tmp_path):
    result = creepkit("generate", "combined", "--domain", "paper", "--dry-run", "--to", tmp_path / "a.h5")
    assert result.exit_code == 0, result.output
    assert "criterion" in result.stdout
    assert names_in(tmp_path) == ["a.rates.png"]
    conditioned = creepkit("generate", "combined", "--dry-run", "--json", "--to", tmp_path / "r.h5")
    assert json.loads(conditioned.stdout)["simulated"] > 0.8


def test_a_job_array_without_slurm_is_one_job(tmp_path):
    env = {**os.environ, "SAMPLES": "1", "FILE": str(tmp_path / "a.h5"), "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    fake = tmp_path / "creepkit"
    fake.write_text('#!/bin/sh\necho "$@"\n')
    fake.chmod(0o755)
    env |= {"SLURM_ARRAY_TASK_ID": "3", "SLURM_ARRAY_TASK_COUNT": "16", "SLURM_CPUS_PER_TASK": "4"}
    done = subprocess.run(["bash", EXAMPLES / "job_array.sh"], env=env, capture_output=True, text=True, check=True)
    words = "--domain conditioned --samples 1 --seed 1 --to"
    assert done.stdout == f"generate combined --specimen bulge {words} {tmp_path}/a.h5 --workers 4 --part 3/16\n"
