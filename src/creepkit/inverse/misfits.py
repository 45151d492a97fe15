"""How well each test is met at the optimum: ln strain of fitted frames, errors of every output over all frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.findings import OutputMisfit, RuptureMisfit, TestMisfit
from creepkit.inverse.measures import Errors, errors
from creepkit.inverse.objective import Objective
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.scales import LOGARITHMIC, noise_of, usable
from creepkit.inverse.together import outputs_of
from creepkit.records import History, Prediction


def misfits(
    objective: Objective, residuals: Residuals, effects: tuple[Floats, Floats], full: Sequence[History],
    found: Prediction, ruptures: Sequence[RuptureMisfit | None],
) -> tuple[TestMisfit, ...]:  # fmt: skip
    """One TestMisfit for each test.

    effects : offsets (tests, outputs) and ln rate factors (tests,); found : the prediction of the `full` histories;
    ruptures : how each of them ended.
    """
    offsets, log_factors = effects
    entries = objective.entries
    ratios = _log_ratios(objective, residuals, np.take_along_axis(offsets, entries.output, axis=1))
    logarithmic = entries.spread([float(name in LOGARITHMIC) for name in entries.outputs]) > 0
    answer = []
    for k, history in enumerate(full):
        r = ratios[k][np.isfinite(ratios[k])]
        rms, bias = (float(np.sqrt(np.mean(r**2))), float(np.mean(r))) if r.size else (np.nan, np.nan)
        linear = int((entries.present[k] & ~logarithmic[k]).sum())
        own = {name: float(v) for name, v in zip(entries.outputs, offsets[k], strict=True)}
        outputs = tuple(
            _of_output(history, name, found.of(k)[:, found.outputs.index(name)], own[name])
            for name in outputs_of(objective.using, history) if name in own and usable(history, name).any()
        )  # fmt: skip
        factor, weight = float(np.exp(log_factors[k])), float(residuals.trust[k])
        answer.append(
            TestMisfit(
                history.name, history.condition, r.size + linear, rms, bias, factor, weight, outputs, ruptures[k]
            )
        )
    return tuple(answer)


def _of_output(history: History, name: str, predicted: Floats, offset: float) -> OutputMisfit:
    used, noise = usable(history, name), noise_of(history, name)
    met = errors(history.outputs[name][used], predicted[used] + offset, noise[used])
    return OutputMisfit(name, met, offset, float(np.median(noise[used])))


def _log_ratios(objective: Objective, residuals: Residuals, offset: Floats) -> Floats:
    """ln((predicted + the test's offset) / measured) where the measured strain is above twice the floor, else NaN.

    For tests compared over their whole life, the distance instead.
    """
    entries = objective.entries
    floor = entries.spread([s.floor if n in LOGARITHMIC else np.inf for n, s in zip(entries.outputs, entries.scales,
                                                                                  strict=True)])  # fmt: skip
    vertical = np.where(entries.whole[:, None], 0.0, residuals.values)
    predicted = entries.backward(vertical + objective.compared) + offset
    above = entries.present & (entries.measured > 2 * floor)
    measured = np.where(above, entries.measured, 1.0)
    shown = np.where(above, np.maximum(predicted, floor), 1.0)
    near = np.where(entries.whole[:, None], residuals.values + residuals.slopes * offset, np.log(shown / measured))
    return np.where(above, near, np.nan)


def pooled_rms(found: Sequence[TestMisfit]) -> float:
    """Root mean square of ln strain over the fitted strains of all tests; NaN without any."""
    with_strain = [m for m in found if np.isfinite(m.rms)]
    frames = np.array([m.frames for m in with_strain], float)
    if not frames.sum() > 0:
        return float("nan")
    return float(np.sqrt((frames * np.array([m.rms**2 for m in with_strain])).sum() / frames.sum()))


def pooled_errors(full: Sequence[History], found: Prediction, tests: Sequence[TestMisfit]) -> Mapping[str, Errors]:
    """{output: errors over all used frames of all tests}, offsets included."""
    names = dict.fromkeys(one.output for m in tests for one in m.outputs)
    answer = {}
    for name in names:
        measured, predicted, noise = [], [], []
        for k, (history, misfit) in enumerate(zip(full, tests, strict=True)):
            for one in (o for o in misfit.outputs if o.output == name):
                used = usable(history, name)
                measured.append(history.outputs[name][used])
                predicted.append(found.of(k)[used, found.outputs.index(name)] + one.offset)
                noise.append(noise_of(history, name)[used])
        answer[name] = errors(*(np.concatenate(v) for v in (measured, predicted, noise)))
    return answer
