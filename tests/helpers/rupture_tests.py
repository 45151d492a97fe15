"""Planted creep tests to rupture: rates and lives scatter from test to test, and some tests are stopped before."""

from __future__ import annotations

import numpy as np

from creepkit.records import History, constant_stress
from creepkit.specimens.uniaxial import Uniaxial

BAR = Uniaxial()
LIFE_FRACTIONS = np.concatenate([np.geomspace(3e-3, 0.3, 10), 1 - np.geomspace(0.6, 3e-3, 14)])
"""Times of frames over the time to rupture."""
SCATTER = {"rate": 0.15, "life": 0.08, "noise": 2e-5}
"""Standard deviations: of the logarithm of rate and of life between tests, and of a strain."""


def campaign(law, values, stresses, seed, stopped=()):
    """Histories of tests with factors on their rate and on their life; those in `stopped` end at half their life."""
    rng, tests = np.random.default_rng(seed), []
    for k, stress in enumerate(stresses):
        plan = History(f"t{k}", np.array([1e8]), {}, constant_stress(stress), 1000.0, strain_measure="engineering")
        life = float(BAR.predict_to_rupture(law, law.to_internal(values), [plan]).times_to_strain.rupture_times[0, 0])
        life_factor, rate_factor = (np.exp(SCATTER[name] * rng.standard_normal()) for name in ("life", "rate"))
        fractions = LIFE_FRACTIONS
        times = life * (
            fractions[fractions < 0.5] if k in stopped else fractions[life * fractions < life * life_factor]
        )
        strain = BAR.predict(law, law.to_internal(values), [plan.replace(times=times)]).of(0)[:, 0]
        strain = strain + SCATTER["noise"] * rng.standard_normal(times.size)
        end = {"unruptured": True} if k in stopped else {"rupture_time": life * life_factor / rate_factor}
        tests.append(plan.replace(times=times / rate_factor, outputs={"strain": strain}, **end))
    return tests
