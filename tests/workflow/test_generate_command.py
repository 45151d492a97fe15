"""`creepkit generate` and `creepkit data`: from a law to a file of samples, and what such a file holds."""

import json
import os
import re
import subprocess

import numpy as np
import pytest
from typer.testing import CliRunner

import creepkit as ck
from creepkit.cli.app import app
from creepkit.cli.generate import design_changes, select_design
from creepkit.errors import DatasetError
from helpers.paths import EXAMPLES
from helpers.written_files import names_in

EXAMPLES = EXAMPLES / "cluster"
BARS = ("norton", "--specimen", "uniaxial", "--interval", "3600", "--seed", "1")


def creepkit(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def sentence(result):
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr.startswith("creepkit: ")
    assert result.stderr.count("\n") == 1
    return result.stderr


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


def test_data_describes_the_file(made):
    to, _ = made
    told, data = json.loads(creepkit("data", to, "--json").stdout), ck.read_dataset(to)
    assert (told["samples"], told["accepted"]) == (300, len(data.accepted))
    rejected = {entry["criterion"]: entry["rejected"] for entry in told["reasons"]}
    assert sum(rejected.values()) + told["accepted"] + told["failed"] == 300
    good = data.accepted
    n = good.parameters[:, good.parameter_names.index("n")]
    assert told["ranges"]["n"] == {"least": n.min(), "median": np.median(n), "most": n.max()}
    assert (told["units"]["A"], told["units"]["stress_1"], told["units"]["Tj"]) == ("1/s", "MPa", "s")
    assert told["provenance"]["seed"] == 1
    assert told["design"] == "conditioned"
    text = creepkit("data", to).stdout
    assert "seed 1" in text
    assert re.search(r"n +1 +\d", text)


def test_data_checks_measured_tests():
    folder = str(ck.example_data("planted bulge test"))
    told = json.loads(creepkit("data", folder, "--json").stdout)
    assert (told["tests"], told["flags"]) == (1, [])
    assert creepkit("data", folder).stdout == "nothing suspect in 1 test\n"
    assert creepkit("data", folder, "--plots", "pictures").exit_code == 2


def test_data_draws_inputs_and_histories(made, tmp_path):
    to, _ = made
    assert creepkit("data", to, "--plots", tmp_path / "plots").exit_code == 0
    pictures = names_in(tmp_path / "plots")
    assert pictures == ["histories.png", "inputs.png"]
    assert all((tmp_path / "plots" / name).read_bytes().startswith(b"\x89PNG") for name in pictures)


def test_the_verbs_of_a_notebook_ask_for_the_same_file(made):
    """The file is the answer as it is: of any other generation it would be refused, as it is to another seed."""
    to, _ = made
    before = to.stat().st_mtime_ns
    data = ck.generate("norton", "uniaxial", seed=1, draws=300, to=to, every=3600.0)
    assert to.stat().st_mtime_ns == before
    with pytest.raises(DatasetError, match="there and here seed is 1 and 2"):
        ck.generate("norton", "uniaxial", seed=2, draws=300, to=to, every=3600.0)
    assert repr(data).startswith("<Dataset: 300 samples of norton on uniaxial")


def test_a_dry_run_simulates_nothing(tmp_path):
    result = creepkit("generate", "combined", "--domain", "paper", "--dry-run", "--to", tmp_path / "a.h5")
    assert result.exit_code == 0, result.output
    assert "criterion" in result.stdout
    assert names_in(tmp_path) == ["a.rates.png"]
    conditioned = creepkit("generate", "combined", "--dry-run", "--json", "--to", tmp_path / "r.h5")
    assert json.loads(conditioned.stdout)["simulated"] > 0.8


def test_ranges_of_conditions_and_what_is_left_out_can_be_said():
    ranges = design_changes(["temperature=1000:1150", "modulus=150e3"], None, None, False)
    design = select_design("dorn", ck.specimen("bulge"), None, ranges, None)
    draws = design.draw(0, 64, seed=0)
    assert (draws.condition("modulus") == 150e3).all()
    assert 1000 <= draws.condition("temperature").min() < draws.condition("temperature").max() <= 1150
    unscreened = select_design("norton", ck.specimen("bulge"), "paper", design_changes([], 6.0, "paper", True), None)
    assert not unscreened.screened
    assert unscreened.grid.end == 6 * 3600


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("generate", "norton"), "--to FILE is missing"),
        (("generate", "norton", "--to", "a.h5"), "say either how many accepted samples"),
        (("generate", "norton", "--to", "a.h5", "--samples", 9, "--part", "0/4"), "--part 0/4 is not K/N"),
        (
            ("generate", "norton", "--to", "a.h5", "--samples", 9, "--domain", "pandora"),
            "there is no sampling domain 'pandora'",
        ),
        (("generate", "nortn", "--to", "a.h5", "--samples", 9), "did you mean 'norton'"),
        (("generate", "norton", "--specimen", "point", "--to", "a.h5", "--samples", 9), "add the attribute conditions"),
        (("generate", "norton", "--to", "", "--samples", 9), "--to is empty; give a value, or leave the option out"),
        (("generate", "norton", "--to", "a.h5", "--samples", 9, "--end-h", "1e9"), "at most 100000 are simulated"),
        (("generate", "norton", "--to", "a.h5", "--samples", 9, "--range", "P1"), "--range P1: write NAME=LOW:HIGH"),
        (("generate", "norton", "--to", "a.h5", "--range", "P9=1:2"), "a bulge test has no condition 'P9'"),
        (("generate", "norton", "--to", "a.h5", "--range", "P1=9:2"), "the range (9, 2) is reversed"),
        (("generate", "norton", "--to", "a.h5", "--range", "P1=5", "--range", "P1=6"), "a condition is given twice"),
        (("generate", "norton", "--range", "end_time=9", "--end-h", 3), "both say when tests end"),
        (("generate", "norton", "--to", "a.h5", "--unscreened"), "--unscreened belongs to --domain paper"),
        (("generate", "dorn", "--to", "a.h5", "--samples", 9), "or --range temperature=1000:1100"),
        (("data", "nowhere.h5"), "nowhere.h5: there is no such file"),
        (("data", "."), "no reader understands it"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    assert message in sentence(creepkit(*words))
    assert names_in(tmp_path) == []


def test_a_job_array_without_slurm_is_one_job(tmp_path):
    env = {**os.environ, "SAMPLES": "1", "FILE": str(tmp_path / "a.h5"), "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    fake = tmp_path / "creepkit"
    fake.write_text('#!/bin/sh\necho "$@"\n')
    fake.chmod(0o755)
    env |= {"SLURM_ARRAY_TASK_ID": "3", "SLURM_ARRAY_TASK_COUNT": "16", "SLURM_CPUS_PER_TASK": "4"}
    done = subprocess.run(["bash", EXAMPLES / "job_array.sh"], env=env, capture_output=True, text=True, check=True)
    words = "--domain conditioned --samples 1 --seed 1 --to"
    assert done.stdout == f"generate combined --specimen bulge {words} {tmp_path}/a.h5 --workers 4 --part 3/16\n"


def test_the_dask_example_is_python():
    compile((EXAMPLES / "dask_slurm.py").read_text(), "dask_slurm.py", "exec")


def test_a_few_samples_cost_a_few_draws(tmp_path):
    """Shards are no larger than what is wanted; a larger set goes on with the shards that are there."""
    for samples in (8, 20):
        result = creepkit("generate", *BARS, "--samples", samples, "--to", tmp_path / "few.h5", "--workers", 1)
        assert result.exit_code == 0, result.output
        data = ck.read_dataset(tmp_path / "few.h5")
        assert len(data) % 8 == 0
        assert samples <= len(data.accepted) < samples + 8
    first = creepkit("generate", *BARS, "--draws", 8, "--to", tmp_path / "draws.h5", "--workers", 1)
    assert first.exit_code == 0, first.output
    assert len(ck.read_dataset(tmp_path / "draws.h5")) == 8
