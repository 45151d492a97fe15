"""The one stress and strain that stand for a test, where a law is looked at in a single point.

A uniaxial test has them. For a bulge test a predictor may state its reference stress; else they are those of the
paper's dimple: von Mises stress about 12.5 times the pressure and 30 mm of amplitude per unit of strain (the
one-degree-of-freedom model of that dimple gives 17 to 8 and 45 to 10 mm between first creep and 2 mm). They only
place coordinates and starts, so that a factor of two does no harm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.scales import usable_frames
from creepkit.inverse.together import predictor_for
from creepkit.records import History, Predictor

STRESS_PER_PRESSURE = 12.5
AMPLITUDE_PER_STRAIN = 30.0
"""mm."""


def reference_stresses(history: History, predictor: Predictor | None = None) -> Floats:
    """The reference stresses that a test visits, MPa."""
    reference_stress = None if predictor is None else getattr(predictor_for(predictor, history), "reference_stress", None)
    loads = history.loading.program().values
    if reference_stress is not None:
        return np.atleast_1d(np.asarray(reference_stress(history), float))
    if history.loading.quantity == "stress":
        return loads
    return STRESS_PER_PRESSURE * np.unique(loads[loads > 0])


def reference_end_strain(history: History, predictor: Predictor | None = None) -> float:
    """The largest strain that a test reached, as far as its outputs tell; `using` may know what they mean."""
    reference_strain = None if predictor is None else getattr(predictor_for(predictor, history), "reference_strain", None)
    if reference_strain is not None:
        return max(float(reference_strain(history)), 1e-7)
    if "strain" in history.outputs:
        return max(float(np.max(history.outputs["strain"][usable_frames(history, "strain")], initial=0.0)), 1e-7)
    return max(_output_increase(history)[0] / AMPLITUDE_PER_STRAIN, 1e-7)


def median_log_strain_rate(histories: Sequence[History], predictor: Predictor | None = None) -> float:
    """Median over tests of the log of strain over time: the scale of rates that the data speak of."""
    log_rates = []
    for history in histories:
        if predictor is not None and hasattr(predictor_for(predictor, history), "reference_strain"):
            strain, time = reference_end_strain(history, predictor), float(history.times[history.used][-1])
        elif "strain" in history.outputs:
            last = int(np.flatnonzero(usable_frames(history, "strain"))[-1])
            strain, time = float(history.outputs["strain"][last]), float(history.times[last])
        else:
            increase, time = _output_increase(history)
            strain = increase / AMPLITUDE_PER_STRAIN
        log_rates.append(np.log(max(strain, 1e-9) / time))
    return float(np.median(log_rates))


def median_log_inverse_duration(histories: Sequence[History]) -> float:
    """Median over tests of -ln of how long they lasted, s: the pace of whatever ends them."""
    return float(-np.median([np.log(h.rupture_time or h.times[-1]) for h in histories]))


def _output_increase(history: History) -> tuple[float, float]:
    """How much the output that grows with creep did so between the first and last usable frame, and in which time."""
    output = "amplitude" if "amplitude" in history.outputs else next(iter(history.outputs))
    used = np.flatnonzero(usable_frames(history, output))
    values, times = history.outputs[output][used], history.times[used]
    if used.size < 2:
        return 0.0, float(history.times[-1])
    return abs(float(values[-1] - values[0])), float(times[-1] - times[0])
