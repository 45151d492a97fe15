"""Strain of loading that a record of creep strain seems to hold still: a jump, then hardly any growth.

Creep strain is zero at the end of loading, and then rises at least as the fourth root of time or so: by 32 % while time
trebles, as a cube root by 44 %. What begins with a strain that grows much less, and faster later, began with loading.
"""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats
from creepkit.quality.flags import QualityFlag
from creepkit.quality.frames import noise_standard_deviation
from creepkit.records import History, Program

FLATTEST_EXPONENT, STEEPENING = 0.15, 3.0
"""Exponent of time below which first frames are no creep, and the factor by which it must rise later: logarithmic
creep, whose exponent falls, is none of loading."""


WINDOW = 3.0
"""Factor of time over which the first exponent is taken, at least."""


JUMP_FROM, SEARCHED_FRAMES = 0.5, 20
"""Of the strain after a jump: that before it at most; and the frames among which it is looked for."""


SMALLEST_STRAIN, NOISE_FACTOR = 1e-4, 6.0
"""A strain below it, or below so many standard deviations of the noise, is not questioned."""


GROWTH_MARGIN = 3.0
"""Standard deviations of the noise by which the first growth may be larger than it seems."""


ELASTIC_RANGE = (0.9, 1.15)
"""Ratios of a strain to the stress over the modulus at which it is elastic alone."""


def unstated_loading_strain(history: History) -> QualityFlag | None:
    """A flag at the frame at which loading seems to end; None where nothing of loading is left.

    A strain that includes the elastic one is questioned where it differs from the stress over the modulus.
    """
    if "strain" not in history.outputs or "loading_strain" in history.labels or history.loading.quantity != "stress":
        return None
    strain = history.outputs["strain"]
    frames = np.flatnonzero(history.used & (history.times > 0) & np.isfinite(strain))
    if frames.size < 5:
        return None
    times, values = history.times[frames], strain[frames]
    k = _end_of_jump(times, values)
    if k is None:
        return None
    ratio = _ratio_to_elastic(history, float(times[k]), float(values[k]))
    if history.includes_elastic and (ratio is None or ELASTIC_RANGE[0] <= ratio <= ELASTIC_RANGE[1]):
        return None
    growth = 3 ** _exponent(times, values, k, _after(times, k)) - 1
    about = "" if ratio is None else f", {ratio:.2f} of stress over modulus"
    part = "more than the elastic part" if history.includes_elastic and ratio and ratio > 1 else "loading strain"
    reason = (
        f"the strain is {values[k]:.3g} at {times[k]:.4g} s{about}, and grows by {100 * growth:.0f} % while time "
        f"trebles: it looks like {part}"
    )
    advice = "state loading_strain_pct, with loading_time_s where frames were taken before, or includes_loading"
    return QualityFlag((history.name,), "loading", (int(frames[k]),), reason, proposal=advice)


def _end_of_jump(times: Floats, values: Floats) -> int | None:
    """The first frame behind a jump, that of the first frame after zero included, if hardly any growth follows."""
    # Of few frames the noise may come out much too small.
    first = noise_standard_deviation(times[:SEARCHED_FRAMES], values[:SEARCHED_FRAMES])
    noise = float(np.nan_to_num(np.fmax(first, noise_standard_deviation(times, values))))
    smallest = max(SMALLEST_STRAIN, NOISE_FACTOR * noise)
    for k in range(min(SEARCHED_FRAMES, times.size - 3)):
        if k and values[k - 1] > JUMP_FROM * values[k]:
            return None
        after = _after(times, k)
        if values[k] <= smallest or after + 1 >= times.size:
            continue
        first = _exponent(times, values, k, after, GROWTH_MARGIN * noise)
        if first < FLATTEST_EXPONENT and _largest_later(times, values, after) > max(STEEPENING * first, 0.2):
            return k
    return None


def _after(times: Floats, k: int) -> int:
    return max(k + 2, int(np.searchsorted(times, WINDOW * times[k])))


def _exponent(times: Floats, values: Floats, a: int, b: int, margin: float = 0.0) -> float:
    """That of time between two frames, of a growth larger by `margin`; 0 of a strain that falls."""
    growth = max(values[b] + margin, values[a]) / values[a]
    return max(0.0, float(np.log(growth) / np.log(times[b] / times[a])))


def _largest_later(times: Floats, values: Floats, start: int) -> float:
    """The largest exponent between frames a factor of time apart."""
    largest, k = 0.0, start
    while (after := _after(times, k)) < times.size:
        largest, k = max(largest, _exponent(times, values, k, after)), after
    return max(largest, _exponent(times, values, k, times.size - 1)) if k < times.size - 1 else largest


def _ratio_to_elastic(history: History, time: float, strain: float) -> float | None:
    if history.elastic is None:
        return None
    temperature = history.temperature
    start = float(temperature.values[0]) if isinstance(temperature, Program) else float(temperature)
    elastic = float(history.loading.program().at(time)) / float(history.elastic.at(start).E)
    return strain / elastic if elastic else None
