"""Planted values are found again from data of finer meshes and smaller steps, a length of each piece estimated too."""

from __future__ import annotations

import numpy as np
import pytest
from creepkit_specimens.notched_bar import NotchedBar
from creepkit_specimens.plate_bulge import PlateBulge
from creepkit_specimens.tube import Tube

import creepkit as ck

PLANTED = {"A": 3e-16, "n": 4.6}
CASES = {
    "tube": (Tube(), "pressure", (14.0, 20.0, 26.0), "thickness", 0.02),
    "plate-bulge": (PlateBulge(), "pressure", (0.35, 0.5, 0.7), "thickness", 0.02),
    "notched bar": (NotchedBar(), "force", (4000.0, 5000.0, 6500.0), "notch_radius", 0.1),
}


@pytest.mark.parametrize("case", CASES)
def test_planted_values_are_found_again(case: str) -> None:
    """Within three standard deviations and 1 % for the error of the mesh; so are the lengths that were planted."""
    specimen, load, levels, length, spread = CASES[case]
    random = np.random.default_rng(20260)
    default = next(each.default for each in specimen.dimensions if each.name == length)
    tests, lengths = [], []
    for k, level in enumerate(levels):
        lengths.append(default * (1.0 + spread * (-1.0) ** k))
        piece = specimen.refined().replace(**{length: lengths[-1]})
        run = ck.simulate(
            "norton", piece, PLANTED, loading=ck.constant_load(load, level), elastic=ck.Elastic(E=150e3),
            temperature=1000.0, times=np.geomspace(600.0, 2e5, 25),
        )  # fmt: skip
        noisy = {name: run.outputs[name] + random.normal(0.0, name.noise, run.times.size) for name in specimen.outputs}
        geometry = {name: value for name, value in run.geometry.items() if name != length}
        tests.append(run.replace(name=f"{case} {k}", outputs=noisy, geometry=geometry))
    length_prior = ck.Nuisance(length, sd=2 * spread * default)
    fit = ck.identify("norton", tests, specimen, nuisances=[length_prior], starts=1, usual_errors="none")
    for estimate in fit.estimates:
        half = 0.5 * (np.log(estimate.high) - np.log(estimate.low))
        assert abs(np.log(estimate.value / PLANTED[estimate.name])) <= 1.5 * half + 0.01, estimate
        assert half < (0.1 if estimate.name == "n" else 1.0), estimate
    for estimate, planted in zip(fit.nuisances, lengths, strict=True):
        assert abs(estimate.value - planted) <= 3.0 * estimate.sd
        assert estimate.sd < 2 * spread * default
