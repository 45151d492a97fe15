"""From a specimen that no module knows by name to a data set, a network, and an identification by it."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.jobs.worker_pools import ParallelExecution
from helpers.cantilever import Cantilever
from helpers.command_line import creepkit

NORTON, BEAM, HOUR = ck.law("norton"), Cantilever(), 3600.0
ONE_PROCESS = ParallelExecution(workers=1)


pytestmark = pytest.mark.usefixtures("one_torch_thread")


def beam_deflection(values, conditions, times):
    """mm, in closed form; the ramp of 5 s from one force to the other by the integral of a power."""
    A, n = values["A"], values["n"]
    b, h, span = conditions.get("breadth", 10.0), conditions.get("height", 2.0), conditions.get("span", 50.0)
    section = b * h ** (2 + 1 / n) / (2 ** (1 + 1 / n) * (2 + 1 / n))
    first, second, jump = (conditions[name] for name in ("force_1", "force_2", "jump_time"))
    early, ramp = np.minimum(times, jump), np.clip(times - jump, 0.0, 5.0)
    late = np.maximum(times - jump - 5.0, 0.0)
    force = first + (second - first) * ramp / 5.0
    ramped = (force ** (n + 1) - first ** (n + 1)) / ((n + 1) * (second - first) / 5.0)
    integral = first**n * early + ramped + second**n * late
    return A * section**-n * span ** (n + 2) / (n + 2) * integral


@pytest.fixture(scope="module")
def beams(tmp_path_factory):
    to = tmp_path_factory.mktemp("beams") / "beams.h5"
    return ck.generate("norton", BEAM, 256, seed=3, to=to, every=6 * HOUR / 5, height=(1.8, 2.2), execution=ONE_PROCESS)


def test_samples_of_a_cantilever_are_its_closed_form(beams):
    assert beams.condition_names == ("force_1", "force_2", "jump_time", "height")
    assert len(beams.accepted) / len(beams) > 0.9
    for row in range(0, 40, 7):
        expected = beam_deflection(beams.values_of(row), beams.conditions_of(row), beams.times(row))
        np.testing.assert_allclose(beams.values[row, :, 0], expected, rtol=2e-6)
    assert set(str(beams).split()) >= {"force_1", "N", "height", "mm", "deflection"}


def test_samples_of_a_bar_in_relaxation_are_its_closed_form(tmp_path):
    """Norton: sigma^(1-n) grows by (n - 1) A E t while the strain is held."""
    data = ck.generate(
        "norton", "relaxation", draws=16, seed=3, to=tmp_path / "r.h5", every=2 * HOUR, execution=ONE_PROCESS
    )
    assert data.condition_names == ("modulus", "strain_1", "strain_2", "jump_time")
    for row in range(8):
        values, conditions, times = data.values_of(row), data.conditions_of(row), data.times(row)
        A, n, E = values["A"], values["n"], conditions["modulus"]
        early = times < conditions["jump_time"]
        start = E * conditions["strain_1"]
        expected = (start ** (1 - n) + (n - 1) * A * E * times[early]) ** (1 / (1 - n))
        np.testing.assert_allclose(data.values[row, early, 0], expected, rtol=1e-4)


def test_the_command_line_generates_and_trains_for_a_specimen_of_a_plugin_file(tmp_path):
    from creepkit.registry import default_registry

    default_registry.cache_clear()
    try:
        ck.load_plugin(Path(sys.modules["helpers.cantilever"].__file__))
        to, model = tmp_path / "beams.h5", tmp_path / "beam.safetensors"
        ranges = "--interval 7200 --range force=6:12 --range span=40:60"
        made = creepkit(f"surrogate generate norton --specimen cantilever --samples 16 {ranges} --to {to} --workers 1")
        assert made.exit_code == 0, made.output
        assert "norton on cantilever" in made.output
        sizes = "--hidden 4 --layers 1 --epochs 2 --target log"
        trained = creepkit(f"surrogate train {to} --to {model} {sizes}")
        assert trained.exit_code == 0, trained.output
        assert "parameter-gru of cantilever" in ck.surrogate(model).name
    finally:
        default_registry.cache_clear()


SCRIPT = """
import sys
from dataclasses import dataclass
import creepkit as ck

@dataclass(frozen=True)
class Rod(ck.PerTest):
    name, title = "rod", "A rod that a script wrote"
    outputs = (ck.Output("elongation", "length", noise=0.001),)
    loads = (ck.Load("force", "force"),)
    conditions = {"force": (500.0, 1000.0)}
    area: float = 10.0

    def reference_stress(self, history):
        return history.loading.program().values / self.area

    def growth_per_strain(self, history):
        return 100.0

    def one(self, law, values, history, nuisances):
        stress = history.loading.program().values[0] / self.area
        return {"elongation": 100.0 * values["A"] * stress ** values["n"] * history.times}

data = ck.generate("norton", Rod(), draws=8, seed=1, to=sys.argv[1], every=14400)
print(len(data), ck.read_dataset(sys.argv[1]).specimen)
"""


def test_a_specimen_of_the_main_script_is_simulated_where_it_is(tmp_path):
    """No other process could read its class."""
    script = tmp_path / "rods.py"
    script.write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, script, tmp_path / "rods.h5"], capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "8 Rod(area=10.0)\n"
