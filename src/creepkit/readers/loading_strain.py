"""What a strain record holds of the loading: elastic and initial plastic strain, and frames taken while the load rose.

Creep strain is zero when the load has been reached. A record of total strain is not, and its first frame after time
zero is often not the end of loading. ISO 204 calls the strain at the end of loading the initial total extension; keys
state it (`loading_strain`, `includes_loading`), and when loading ended (`loading_time`). Where a file states neither
these nor `includes_elastic`, the first frames decide:

- a strain at time zero that is the stress over the modulus is elastic; any other is subtracted, for part of it is
  plastic or the modulus is off, and creep has had no time yet;
- a strain that jumps to about the stress over the modulus from less than half of it, and then stays while time
  trebles, is elastic strain at the end of loading. Creep rises in that time by 44 % or more: as the cube root of time,
  or faster.

What was decided is recorded, and what looks like loading but is neither, a jump that is not about the stress over the
modulus or has no modulus beside it, is told by the check of data quality. A file that states `includes_elastic` is
taken at its word.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import HistoryError
from creepkit.readers.conditions import StatedConditions
from creepkit.records.recorded_programs import noise_of_readings

ELASTIC_RANGE = (0.9, 1.15)
"""Ratios of a strain at time zero to the stress over the modulus at which it is elastic, and not plastic too."""


PLATEAU_RANGE = (0.6, 1.6)
"""The same of a plateau behind frames of loading, which no frame at time zero tells from creep."""


PLATEAU_GROWTH, PLATEAU_TIMES = 0.25, 3.0
"""By less than this fraction a strain grows after the end of loading while time grows by this factor."""


JUMP_FROM, LARGEST_NOISE = 0.5, 0.2
"""Of the strain at the end of loading: the strain in the frame before, and the noise in which a jump is seen."""


SEARCHED_FRAMES = 20
"""Frames among which the end of loading is looked for."""


SMALLEST_STRAIN, NOISE_FACTOR = 2e-5, 6.0
"""A strain at time zero below it, or below so many standard deviations of the noise, is none."""


@dataclass(frozen=True)
class StrainRecord:
    """A strain record without what loading left in it.

    strain, used : (frames,). includes_elastic : whether the strain still holds the elastic one.
    """

    strain: Floats
    used: Bools
    includes_elastic: bool


def without_loading(
    conditions: StatedConditions, times: Floats, strain: Floats, used: Bools, elastic_strain: float | None
) -> StrainRecord:
    """The strain as its model means it.

    times : (frames,) s. strain : (frames,). used : (frames,) which may be fitted. elastic_strain : stress over modulus
    at the beginning, None where the modulus is not known.
    """
    location = conditions.location_of("includes_loading", "loading_strain", "loading_time", "includes_elastic")
    total, end = conditions.take_number("loading_strain"), conditions.take_number("loading_time")
    includes_loading = conditions.take_choice("includes_loading", ("yes", "no"), required=False)
    stated = conditions.states("includes_elastic")
    if end is not None:
        used = used & (times >= end.value * (1 - 1e-9))
        if not used.any():
            raise HistoryError(f"{end.location}: every frame lies before '{end.key}', {end.value:g} s; correct it")
        conditions.record_assumption(f"frames before the end of loading at {end.value:g} s not used")
    if total is not None:
        conditions.labels["loading_strain"] = f"{total.value:.6g}"
    if not (stated or includes_loading or total is not None):
        return _decided(conditions, times, strain, used, elastic_strain)
    elastic = conditions.take_choice("includes_elastic", ("yes", "no"), required=not includes_loading and total is None)
    first = int(np.argmax(used))
    if total is not None and not (includes_loading or stated):
        includes_loading = "yes" if strain[first] > 0.5 * total.value else "no"
        contained = "contained" if includes_loading == "yes" else "not contained"
        conditions.record_assumption(f"loading strain {contained} (the first strain is {strain[first]:.3g})")
    if includes_loading != "yes":
        return StrainRecord(strain, used, elastic == "yes")
    if elastic == "yes":
        raise HistoryError(
            f"{location}: includes_loading is yes, so the strain at the end of loading is subtracted and no elastic "
            "strain is left; leave out includes_elastic: yes"
        )
    if total is None and end is None and times[first] > 0.0:
        raise HistoryError(
            f"{location}: includes_loading is yes, but not by how much; state loading_strain_pct, the strain at the "
            "end of loading, or loading_time_s, when it ended"
        )
    subtracted = strain[first] if total is None else total.value
    conditions.record_assumption(f"loading strain {subtracted:.3g} subtracted")
    return StrainRecord(strain - subtracted, used, includes_elastic=False)


def _decided(
    conditions: StatedConditions, times: Floats, strain: Floats, used: Bools, elastic_strain: float | None
) -> StrainRecord:
    """What the first frames say, where the file says nothing."""
    frames = np.flatnonzero(used)
    if frames.size > 2 and times[frames[0]] == 0.0:
        first = float(strain[frames[0]])
        if first > max(SMALLEST_STRAIN, NOISE_FACTOR * noise_of_readings(strain[frames[:SEARCHED_FRAMES]])):
            ratio = f"{first / elastic_strain:.2f} of stress over modulus" if elastic_strain else ""
            if elastic_strain and _is_elastic(first, elastic_strain, ELASTIC_RANGE):
                conditions.record_assumption(f"includes_elastic yes (the strain at time 0 is {ratio})")
                return StrainRecord(strain, used, includes_elastic=True)
            conditions.record_assumption(
                f"includes_elastic no (loading strain {first:.3g} at time 0 subtracted{ratio and f'; {ratio}'})"
            )
            return StrainRecord(strain - first, used, includes_elastic=False)
        end = _end_of_loading(times[frames], strain[frames], elastic_strain) if elastic_strain else None
        if end is not None and elastic_strain:
            ratio, time = strain[frames[end]] / elastic_strain, times[frames[end]]
            conditions.record_assumption(
                f"includes_elastic yes and frames before {time:g} s not used (the strain then stays at {ratio:.2f} "
                "of stress over modulus)"
            )
            return StrainRecord(strain, used & (times >= time), includes_elastic=True)
    included = conditions.take_choice("includes_elastic", ("yes", "no"), required=True)
    return StrainRecord(strain, used, included == "yes")


def _end_of_loading(times: Floats, strain: Floats, elastic_strain: float) -> int | None:
    """The first frame of a plateau of about the elastic strain, None where the strain shows none."""
    noise = noise_of_readings(strain[:SEARCHED_FRAMES])
    for k in range(1, min(SEARCHED_FRAMES, times.size - 2)):
        if not _is_elastic(float(strain[k]), elastic_strain, PLATEAU_RANGE):
            continue
        if max(strain[k - 1], noise * JUMP_FROM / LARGEST_NOISE) > JUMP_FROM * strain[k]:
            return None
        after = slice(k + 1, int(np.searchsorted(times, PLATEAU_TIMES * times[k], side="right")))
        covered = times[after].size >= 2 and times[after][-1] >= 0.5 * PLATEAU_TIMES * times[k]
        growth = float(np.median(strain[after][-2:])) - strain[k] if covered else np.inf
        return k if abs(growth) < PLATEAU_GROWTH * strain[k] else None
    return None


def _is_elastic(strain: float, elastic_strain: float, ratios: tuple[float, float]) -> bool:
    return ratios[0] * elastic_strain <= strain <= ratios[1] * elastic_strain
