"""Stress and strain of a plain bar from load and extension; a strain without what loading and interruptions left.

    stress = load / initial area,    strain = extension / gauge length,    E = d(stress) / d(strain) on the ramp.

A file that states another specimen, lengths of a notch or outputs of another specimen is left as it is.

What a strain record holds of the loading: elastic and initial plastic strain, and frames taken while the load rose.

Creep strain is zero when the load has been reached. A record of total strain is not, and its first frame after time
zero is often not the end of loading. ISO 204 calls the strain at the end of loading the initial total extension; keys
state it (`loading_strain`, `includes_loading`), and when loading ended (`loading_time`). Where a file states neither
these nor `includes_elastic`, the record of the load and the first frames decide:

- a load that was raised in sight, over three frames or more, has loaded the test piece: strain that is straight over
  the stress is elastic, with a modulus of its own, any other at the end of the ramp is subtracted, and frames before
  the end are not used;
- a strain at time zero that is the stress over the modulus is elastic; any other is subtracted, for part of it is
  plastic or the modulus is off, and creep has had no time yet;
- a strain that jumps to about the stress over the modulus from less than half of it, and then stays while time
  trebles, is elastic strain at the end of loading. Creep rises in that time by 44 % or more: as the cube root of time,
  or faster.

What was decided is recorded, and what looks like loading but is neither, a jump that is not about the stress over the
modulus or has no modulus beside it, is told by the check of data quality. A file that states `includes_elastic` is
taken at its word.

An extensometer that was bumped or set anew, as in an interruption, adds a step to all later readings. Its size is the
distance, midway between the frames around it, of straight lines through the frames before and after it; where the
temperature steps between them, at that time. A coefficient of thermal expansion takes off alpha (T - T at the start).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import HistoryError
from creepkit.readers.conditions import StatedConditions, StatedNumber
from creepkit.readers.ends_of_tests import INTERRUPTED, RUPTURED, STOPPED, end_said_by
from creepkit.readers.frames import UNUSED, TableFrames, column_question
from creepkit.readers.imposed import OUTLIERS, PAUSE, hold_begins, under_load, unloaded
from creepkit.readers.table import SourceText
from creepkit.readers.vocabulary import split_written_name, value_in
from creepkit.readers.weak_sources import LOAD_AGREEMENT
from creepkit.records.loading import Program
from creepkit.records.quantities import LENGTH, STRAIN, TIME
from creepkit.records.reading_noise import noise_of_readings
from creepkit.records.specimen_record import Output
from creepkit.records.units import time_text

# ---- load and extension of a plain bar -------------------------------------------------------------------------------


OF_BAR = frozenset(("elongation", "strain", "stress", "force"))
"""What columns hold of a plain bar."""


PLAIN = ("", "uniaxial", "relaxation")
"""Specimens, as files state them, that are plain bars; "" where a file states none."""


RAMP_RANGE, CREEP_RANGE = (0.05, 1.02), 0.6
"""Of the stress at the end of a ramp: between them the ramp is elastic; below CREEP_RANGE alone where creep shows."""


STRAIGHT = 0.8
"""Slope of the second half of a straight ramp over that of the first, from which on it is one."""


CREEP_SHOWS = 0.01
"""Fraction of the stress that is lost within one frame of the ramp after its end, above which it bends the ramp."""


PRELOAD, SHORT_RAMP, SOFTEST, JUMP = 0.02, 1e-3, 20e3, 0.1
"""Of the largest stress, a preload at most; of the duration, a ramp in which creep is none; MPa, of a modulus; of the
range of strains before, one that rises while the load is lost, as at a rupture."""


FEWEST_RAMP_FRAMES, RAMP_FROM = 3, 0.2
"""Before the end of a ramp; part of the stress that is held at which a ramp that loading shows begins at most."""


NEAR_LENGTH = 0.1
"""Of a stated length, by which the first reading of it may differ."""


def with_changes_of_lengths(conditions: StatedConditions, frames: TableFrames) -> TableFrames:
    """The frames with the change of a length in the place of its readings, or of its relative change.

    A diameter of a plain bar is a strain at constant volume, (d0/d)^2 - 1, whose sign is that of the test. A length
    counts from its first reading where that was taken at time zero, else from what is stated.
    """
    values = dict(frames.values)
    for name in [one for one in values if one in conditions.terms.length_kinds]:
        output, is_relative = _change_of(conditions, frames, name), conditions.terms.length_kinds[name] is STRAIN
        if not output and conditions.text_of("specimen") not in PLAIN:
            continue
        column, length = values.pop(name), output.change_of.lstrip("-") if output else "diameter"
        stated, first = conditions.geometry.get(length), float(column[0])
        if is_relative and not output:
            if any(map(_HOOP.search, frames.table.written or frames.table.columns)):
                what = "a hoop strain is that of a tube under internal pressure, not of a bar; which specimen is it?"
                raise conditions.question(what, "specimen", "tube", "open-tube")
            column = -abs(column)
        elif stated is None and (is_relative or frames.times[0] > 0.0):
            what = f"the {name} counts from the {length} before the test, which is not stated; how many mm is it?"
            raise conditions.question(what, f"{length}_mm", *([] if is_relative else [first]))
        elif not is_relative and abs(first - (stated or first)) >= NEAR_LENGTH * (stated or first):
            columns = enumerate(frames.table.columns)
            written = frames.table.as_written(next(k for k, c in columns if name in c or c[0] in "DØ⌀"))
            what = f"'{written}' begins at {first:g} mm, which is no {length}; what does it hold?"
            choices = [{written: f"{output or 'elongation'} (mm)"}, {written: UNUSED}]
            raise column_question(frames.table, what, *choices)
        initial = first if not is_relative and (stated is None or frames.times[0] == 0.0) else stated or 1.0
        relative = column if is_relative else column / initial - 1.0
        if output:
            values[output] = (-initial if output.change_of.startswith("-") else initial) * relative
        else:
            strain = (1.0 + relative) ** -2 - 1.0
            strain *= np.sign(strain[np.argmax(abs(strain))])
            is_true = conditions.text_of("strain_measure") == "logarithmic"
            values["strain"] = np.log1p(strain) if is_true else strain
        if output or not is_relative:
            conditions.geometry.setdefault(length, initial)
        what = name if is_relative else f"{name} from {initial:g} mm on"
        conditions.record_assumption(f"{output or 'strain at constant volume'} by the {what}")
    return replace(frames, values=values)


_HOOP = re.compile("hoop|circumferential|umfang|tangential|circonférentielle", re.IGNORECASE)


def _change_of(conditions: StatedConditions, frames: TableFrames, name: str) -> Output | None:
    """The output that is the change of a length; a force alone is that of a plain bar, where no specimen is named."""
    for specimen, output in conditions.terms.changes:
        length, loads = output.change_of.lstrip("-"), {*conditions.terms.loads.get(specimen, ())} - {"force"}
        is_meant = f"_{length}".endswith(f"_{'diameter' if name == 'diametral_strain' else name}")
        is_loaded = any(conditions.states_load(load) or load in frames.values for load in loads)
        if is_meant and (conditions.terms.own_outputs or length in conditions.geometry or is_loaded):
            return output
    return None


def as_plain_bar(conditions: StatedConditions, frames: TableFrames) -> TableFrames:
    """The frames with stress and strain in the place of load and extension; HistoryError for lengths that lack."""
    values, terms = dict(frames.values), conditions.terms
    foreign = {name for outputs in terms.outputs.values() for name in outputs} - OF_BAR
    notch = {name for name in conditions.geometry if name.startswith("notch")}
    has_load = "force" in values or conditions.states("force")
    if conditions.text_of("specimen") not in PLAIN or notch or foreign & values.keys():
        return frames
    is_held = conditions.states_load("strain") or conditions.text_of("specimen") == "relaxation"
    if "elongation" not in values and not (has_load and "strain" in values) and not ("force" in values and is_held):
        return frames
    what = list[str]()
    if "elongation" in values:
        what += _with_strain(conditions, frames, values)
    if has_load:
        what += _with_stress(conditions, frames, values)
    conditions.record_assumption(f"a plain bar: {' and '.join(what)}", first=True)
    return replace(frames, values=values)


def _with_strain(conditions: StatedConditions, frames: TableFrames, values: dict[str, Floats]) -> list[str]:
    """Put the strain in the place of the extension, and say so."""
    elongation, length = values.pop("elongation"), conditions.geometry.get("gauge_length")
    if "strain" in values:
        return ["the extension beside the strain not used"]
    conditions.ask_of_label(_COMPLIANCE, "leaves open whether the extension is without the machine's part; if it is")
    if length is None:
        what = "an extension is a strain by its gauge length, which is not stated; write gauge_length_mm (or 'specimen:"
        place = frames.table.location(frames.table.columns_line)
        said = (length_said(*one) for one in conditions.labels.items() if _LENGTH_NAME.search(one[0]))
        what = f"{what} notched-bar' with its lengths)"
        raise conditions.question(what, "gauge_length_mm", *filter(None, said), location=place)
    values["strain"] = elongation / length
    return [f"strain = extension / gauge length {length:g} mm"]


_LEVER = re.compile("lever|hebel|levier", re.IGNORECASE)
_COMPLIANCE = re.compile("compliance|nachgiebigkeit|complaisance", re.IGNORECASE)
_LENGTH_NAME = re.compile("length|länge|longueur", re.IGNORECASE)


def length_said(head: str, text: str) -> float | None:
    """mm, of a label that is a number with a unit of length in it or in its head; None of others."""
    return value_in(text, LENGTH, split_written_name(head)[1])


def _with_stress(conditions: StatedConditions, frames: TableFrames, values: dict[str, Floats]) -> list[str]:
    """Put the stress in the place of the load, and say so; a load beside a stress is redundant."""
    column = values.pop("force", None)
    stated = conditions.take_number("force")
    area, how = _area(conditions)
    nominal = conditions.number_of("stress")
    on = None if column is None else under_load(column)
    held = hold_begins(frames.times[on], column[on]) if column is not None else None
    if "stress" not in values and nominal is not None and column is not None and held and held >= FEWEST_RAMP_FRAMES:
        # A load that was raised in sight is recorded better than the one number that says what was held.
        if area is None:
            area = float(np.median(column[on][held:])) / nominal.value
            how = f" by which the load that was held is {nominal.value:g} MPa"
    elif "stress" in values or conditions.states_load("stress"):
        has_lever = any(map(_LEVER.search, conditions.labels))
        if nominal is not None and stated is not None and area is not None and not has_lever:
            of_load = stated.value / area
            if abs(of_load - nominal.value) > LOAD_AGREEMENT * nominal.value:
                what = f"the load makes {of_load:.4g} MPa on {area:.4g} mm2{how}, and {nominal.location} says"
                raise HistoryError(f"{stated.location}: {what} {nominal.value:g} MPa; correct one of them")
        return ["the load beside the stress not used"]
    conditions.ask_of_label(_LEVER, "leaves open whether the load is that on the specimen; if it is")
    if area is None:
        where = stated.location if stated is not None else frames.table.location(frames.table.columns_line)
        what = "a load is a stress by the cross-section, which is not stated; write diameter_mm, or width_mm and"
        what = f"{what} thickness_mm, or area_mm2, or the stress itself"
        raise conditions.question(what, "diameter_mm", location=where)
    if column is not None:
        values["stress"] = np.where((column < 0.0) & (column >= -0.01 * column.max()), 0.0, column) / area
    elif stated is not None:
        conditions.put_number("stress", replace(stated, value=stated.value / area))
    return [f"stress = load / area {area:.4g} mm2{how}"]


def _area(conditions: StatedConditions) -> tuple[float | None, str]:
    """The initial area, mm2, and of which lengths it is."""
    lengths: Mapping[str, float] = conditions.geometry
    stated = conditions.take_number("area")
    if stated is not None:
        return stated.value, ""
    if "diameter" in lengths:
        return 0.25 * math.pi * lengths["diameter"] ** 2, f" of diameter {lengths['diameter']:g} mm"
    thickness = lengths.get("thickness", lengths.get("apex_thickness"))
    if "width" in lengths and thickness is not None:
        return lengths["width"] * thickness, f" of {lengths['width']:g} mm x {thickness:g} mm"
    return None, ""


def without_unloaded_readings(conditions: StatedConditions, frames: TableFrames) -> TableFrames:
    """The frames without single ones at which the load was off: how long it was, and how cold it was then, none says.

    Several such frames one after another show a pause, which is part of the program.
    """
    off = unloaded(frames, conditions.terms)
    alone = off & ~np.roll(off, 1) & ~np.roll(off, -1) & ~np.isin(frames.lines, [*frames.marked])
    if not 0 < alone.sum() <= max(1.0, OUTLIERS * alone.size):
        return frames
    places = " and ".join(time_text(float(time)) for time in frames.times[alone])
    conditions.record_assumption(f"the reading without load at {places} left out")
    return replace(frames, values={n: one[~alone] for n, one in frames.values.items()}, lines=frames.lines[~alone])


def from_loading_on(conditions: StatedConditions, frames: TableFrames) -> TableFrames:
    """The frames from the last one on in which a bar bears its preload alone; time counts from there."""
    stress = frames.values.get("stress")
    if stress is None or any(conditions.states(f"stress_{form}") for form in ("steps", "program", "1")):
        return frames
    before = int(np.argmax(stress > PRELOAD * stress.max())) - 1
    if before < 1 or stress.size - before < 3:
        return frames
    start, values = float(frames.times[before]), {name: one[before:] for name, one in frames.values.items()}
    what = f"time counts from the end of a preload of {stress[before]:.3g} MPa at {time_text(start)}"
    conditions.record_assumption(what)
    return replace(frames, values={**values, "time": values["time"] - start}, lines=frames.lines[before:])


def up_to_rupture(conditions: StatedConditions, frames: TableFrames, name: str) -> TableFrames:
    """The frames up to the last one under load of a bar that broke: a logger goes on after that.

    A load that falls to almost nothing for good while the strain jumps is asked about, where nothing says how it ended.
    """
    load, strain = (frames.values.get(one, np.zeros(1)) for one in ("stress", "strain"))
    count = int(np.flatnonzero(load >= PAUSE * load.max())[-1]) + 1
    if not 2 < count < load.size == strain.size:
        return frames
    said = {conditions.text_of("ended"), conditions.end_terms.get(name.casefold(), "")}
    for text in (text for label, text in conditions.labels.items() if label != "assumed"):
        said.add(conditions.end_terms.get(text.casefold(), "") or end_said_by(text))
    is_marked = int(frames.lines[count]) in frames.marked  # the reading under load at that time was left out
    if RUPTURED not in said and not conditions.states("rupture"):
        is_open = said.isdisjoint((STOPPED, INTERRUPTED)) and not is_marked
        if is_open and strain[count] - strain[count - 1] > JUMP * np.ptp(strain[:count]):
            what = (
                f"the load is lost at {time_text(float(frames.times[count]))} and the strain jumps; did the test break?"
            )
            raise conditions.question(what, "ended", RUPTURED, STOPPED, location=frames.location(count), is_free=False)
        return frames
    if is_marked and not conditions.states("rupture"):
        conditions.put_number("rupture", StatedNumber(float(frames.times[count]), "", frames.location(count)))
    conditions.record_assumption("readings without load after the rupture left out")
    return replace(frames, values={n: one[:count] for n, one in frames.values.items()}, lines=frames.lines[:count])


def _frames_of_ramp(times: Floats, stress: Floats) -> int:
    """The number of frames before a stress that was raised from nothing is held; 0 where the record shows no ramp."""
    on = under_load(stress)  # pauses come after it
    end = hold_begins(times[on], stress[on])
    is_short = end is not None and times[end] - times[0] <= SHORT_RAMP * (times[-1] - times[0])
    fewest = 1 if is_short else FEWEST_RAMP_FRAMES
    is_raised = end is not None and end >= fewest and stress[0] <= RAMP_FROM * stress[end]
    return int(end) if end is not None and is_raised else 0


def modulus_of_ramp(strain: Floats, stress: Floats) -> tuple[float, str] | None:
    """Young's modulus, MPa, of the frames of a loading ramp, and what is said of it; None where too few show it.

    strain, stress : (frames,) of the program that was imposed, without the noise of its record, and MPa. The line is
    fitted by least squares; its 95 % interval is that of Student's t. Where a ramp bends, as in a tension test that is
    pulled on, its beginning counts as far as it is straight.
    """
    end = int(np.argmax(strain >= strain.max())) + 1
    low, high = (part * float(stress[end - 1]) for part in RAMP_RANGE)
    if stress.size > end and stress[end] < (1.0 - CREEP_SHOWS) * stress[end - 1]:
        high = CREEP_RANGE * float(stress[end - 1])
    kept = np.flatnonzero((stress[:end] >= low) & (stress[:end] <= high) & (np.diff(strain[:end], prepend=-1.0) > 0.0))
    from scipy.stats import linregress, t

    while kept.size >= FEWEST_RAMP_FRAMES:
        halves = kept[: (kept.size + 1) // 2], kept[kept.size // 2 :]
        first, second = (linregress(strain[half], stress[half]) for half in halves)
        if second.slope >= STRAIGHT * first.slope:
            break
        kept = kept[: kept.size // 2]
    if kept.size < FEWEST_RAMP_FRAMES:
        return None
    line = linregress(strain[kept], stress[kept])
    modulus, half = float(line.slope), float(t.ppf(0.975, kept.size - 2) * line.stderr)
    if not modulus > 0.0 or half > 0.25 * modulus:
        return None
    value, least, most = (f"{1e-3 * one:.4g}" for one in (modulus, modulus - half, modulus + half))
    return modulus, f"modulus {value} GPa of {kept.size} frames of the loading ramp (95 %: {least} to {most})"


# ---- what loading left -----------------------------------------------------------------------------------------------


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


SMALLEST_STRAIN, NOISE_FACTOR, OFFSET, FEWEST_OF_CURVE = 2e-5, 6.0, 0.1, 5
"""A strain at time zero below it, or below so many standard deviations of the noise, is none; part of its range below
which a negative one is that of a transducer that was not set to zero; readings that show the noise about a curve."""


@dataclass(frozen=True)
class StrainRecord:
    """A strain record without what loading left in it.

    strain, used : (frames,). includes_elastic : whether the strain still holds the elastic one. modulus : MPa, that the
    loading ramp shows where none is stated.
    """

    strain: Floats
    used: Bools
    includes_elastic: bool
    modulus: float | None = None


def without_loading(
    conditions: StatedConditions,
    times: Floats,
    strain: Floats,
    used: Bools,
    stress: Floats | None,
    modulus: float | None,
) -> StrainRecord:
    """The strain as its model means it.

    times : (frames,) s. strain : (frames,). used : (frames,) which may be fitted. stress : (frames,) MPa that was
    imposed, None where another load was; modulus : MPa at the beginning, None where it is not known.
    """
    location = conditions.location_of("includes_loading", "loading_strain", "loading_time", "includes_elastic")
    total, end = conditions.take_number("loading_strain"), conditions.take_number("loading_time")
    includes_loading = conditions.take_choice("includes_loading", ("yes", "no"), required=False)
    stated = conditions.states("includes_elastic")
    if total is not None and ", column '" in conditions.location_of("includes_elastic"):
        if conditions.take_text("includes_elastic") == "yes":  # "Total strain" holds all of it (ISO 204)
            includes_loading = includes_loading or "yes"
        stated = False
    if end is not None:
        used = used & (times >= end.value * (1 - 1e-9))
        if not used.any():
            raise HistoryError(f"{end.location}: every frame lies before '{end.key}', {end.value:g} s; correct it")
        conditions.record_assumption(f"frames before the end of loading at {end.value:g} s not used")
    if total is not None:
        conditions.labels["loading_strain"] = f"{total.value:.6g}"
    if not (stated or includes_loading or total is not None):
        record = None if stress is None else _loaded_by_ramp(conditions, times, strain, used, stress, modulus)
        elastic_strain = None if stress is None or modulus is None else float(stress[0]) / modulus
        return record or _decided(conditions, times, strain, used, elastic_strain)
    elastic = conditions.take_choice("includes_elastic", ("yes", "no"), required=not includes_loading and total is None)
    first = int(np.argmax(used))
    if total is not None and not (includes_loading or stated):
        includes_loading = "yes" if strain[first] > 0.5 * total.value else "no"
        contained = "contained" if includes_loading == "yes" else "not contained"
        conditions.record_assumption(f"loading strain {contained} (the first strain is {strain[first]:.3g})")
    if includes_loading != "yes":
        return StrainRecord(strain, used, elastic == "yes")
    if elastic == "yes":
        what = "includes_loading is yes, which leaves no elastic strain; leave out includes_elastic: yes"
        raise HistoryError(f"{location}: {what}")
    if total is None and end is None and times[first] > 0.0:
        what = "includes_loading is yes, but not by how much; state loading_strain_pct or loading_time_s, its end"
        raise HistoryError(f"{location}: {what}")
    subtracted = strain[first] if total is None else total.value
    conditions.record_assumption(f"loading strain {subtracted:.3g} subtracted")
    return StrainRecord(strain - subtracted, used, includes_elastic=False)


def _loaded_by_ramp(
    conditions: StatedConditions, times: Floats, strain: Floats, used: Bools, stress: Floats, modulus: float | None
) -> StrainRecord | None:
    """What a recorded loading ramp says; None where there is none, or the strain does not rise with it.

    A strain that is straight over the stress up to the end of the ramp is elastic, with the modulus that is stated or
    else with that of the ramp; any other at its end is subtracted.
    """
    end = _frames_of_ramp(times, stress)
    noise = _noise_of_creep(times[end:], strain[end:])
    if not end or strain[end] - strain[0] < max(SMALLEST_STRAIN, NOISE_FACTOR * noise):
        return None
    used = used & (times >= times[end])
    until = f"frames before the end of the loading ramp at {times[end]:g} s not used"
    found = None if modulus is not None else modulus_of_ramp(strain[: end + 1], stress[: end + 1])
    elastic = modulus if modulus is not None else found[0] if found is not None else None
    if elastic is not None and _is_elastic(float(strain[end]), float(stress[end]) / elastic, ELASTIC_RANGE):
        conditions.record_assumption(f"includes_elastic yes (the strain rises with the load) and {until}")
        if found is not None:
            conditions.record_assumption(found[1])
        return StrainRecord(strain, used, True, None if found is None else found[0])
    if end < FEWEST_RAMP_FRAMES and stress[end] < SOFTEST * (strain[end] - strain[0]):
        return None
    on = under_load(stress)
    until += "" if on.all() else ", nor those of pauses, without the elastic part"
    what = f"includes_elastic no (loading strain {strain[end]:.3g} subtracted) and {until}"
    conditions.record_assumption(what.replace(",", ""))
    return StrainRecord(strain - strain[end], used & on, includes_elastic=False)


def _decided(
    conditions: StatedConditions, times: Floats, strain: Floats, used: Bools, elastic_strain: float | None
) -> StrainRecord:
    """What the first frames say, where the file says nothing."""
    frames = np.flatnonzero(used)
    if frames.size > 2 and times[frames[0]] == 0.0:
        first = float(strain[frames[0]])
        least = max(SMALLEST_STRAIN, NOISE_FACTOR * _noise_of_creep(times[frames], strain[frames]))
        if first > least or first < -max(SMALLEST_STRAIN, OFFSET * float(np.ptp(strain[frames]))):
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


def _noise_of_creep(times: Floats, strain: Floats) -> float:
    """The noise of the first frames under load, whose curve is not even in time; times, strain : (frames,) s and -."""
    searched = slice(int(times[0] == 0.0), SEARCHED_FRAMES)
    if strain[searched].size < FEWEST_OF_CURVE:
        return noise_of_readings(strain)
    return noise_of_readings(strain[searched], times[searched], order=3)


def _end_of_loading(times: Floats, strain: Floats, elastic_strain: float) -> int | None:
    """The first frame of a plateau of about the elastic strain, None where the strain shows none."""
    noise = _noise_of_creep(times, strain)
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


# ---- steps that are taken off ----------------------------------------------------------------------------------------


FITTED_FRAMES = 6
"""Frames on either side of a step through which a straight line is laid."""


_EXPANSION = re.compile(r"([\d.]+(?:[eE]-?\d+)?) ?([uµμ]m/m/K|ppm/K|(?:10\^?|1e)-6 ?/K|1?/K|K\^?-1|)")


def _expansion(conditions: StatedConditions) -> float:
    """The stated coefficient of thermal expansion, 1/K, 0 where none is; HistoryError for what cannot be one."""
    if (entry := conditions.take_entry("thermal_expansion")) is None:
        return 0.0
    found = _EXPANSION.fullmatch(entry.text)
    value = float(found[1]) * (1e-6 if found[2][:-2] not in ("", "1", "K", "K^") else 1.0) if found else 0.0
    if not 0.0 < value < 1e-3:
        what = f"thermal_expansion is '{entry.text}'; write it per kelvin, such as 14e-6 1/K"
        raise HistoryError(f"{entry.location}: {what}")
    return value


def without_steps(
    conditions: StatedConditions, times: Floats, outputs: Mapping[str, Floats], used: Bools, imposed: float | Program
) -> dict[str, Floats]:
    """The outputs (frames,) without thermal expansion and steps that are to be taken off, which is recorded.

    times : (frames,) s. outputs : {name: (frames,)}. used : (frames,) those that a line may be laid through.
    imposed : K, the temperature.
    """
    results, alpha = dict(outputs), _expansion(conditions)
    program = imposed if isinstance(imposed, Program) else Program.constant(imposed)
    if alpha and np.ptp(program.values) > 0.0 and "strain" in results:
        results["strain"] = results["strain"] - alpha * (program.at(times) - program.values[0])
        conditions.record_assumption(f"thermal expansion of {alpha:.3g}/K from the first temperature on taken off")
    steps = program.times[1:][np.diff(program.times) == 0.0]
    entry = conditions.take_entry("steps_taken_off")
    if entry is None:
        return results
    for time in _times_in(entry):
        first = int(np.searchsorted(times, time * (1 - 1e-9)))
        if not 0 < first < times.size:
            raise HistoryError(f"{entry.location}: no frames lie before and after a step at {time_text(time)}")
        middle = 0.5 * (times[first - 1] + times[first])
        middle = next((step for step in steps if times[first - 1] < step <= times[first]), middle)
        indices = np.arange(times.size)
        before, after = indices[used & (indices < first)], indices[used & (indices >= first)]
        sizes = list[str]()
        for name, values in results.items():
            ends = [_line_at(middle, times, values, one) for one in (before[-FITTED_FRAMES:], after[:FITTED_FRAMES])]
            results[name] = np.where(indices >= first, values - (ends[1] - ends[0]), values)
            sizes.append(f"{ends[1] - ends[0]:.3g} of {name}")
        conditions.record_assumption(f"a step of {' and '.join(sizes)} at {time_text(time)} taken off")
    return results


def _times_in(entry: SourceText) -> list[float]:
    """s; HistoryError for what is no times with units."""
    times = [value_in(item, TIME) for item in entry.text.split(";")]
    if None in times:
        what = f"steps_taken_off is '{entry.text}'; write times such as 36.75 h; 120 h"
        raise HistoryError(f"{entry.location}: {what}")
    return sorted(filter(None, times))


def _line_at(time: float, times: Floats, values: Floats, frames: Ints) -> float:
    """A straight line through some frames, a mean of few, at a time."""
    if frames.size < 3:
        return float(np.mean(values[frames])) if frames.size else 0.0
    return float(np.polynomial.Polynomial.fit(times[frames], values[frames], 1)(time))
