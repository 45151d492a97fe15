"""Load and extension of a plain bar as stress and strain, and its modulus from the ramp by which it was loaded.

    stress = load / initial area,    strain = extension / gauge length,    E = d(stress) / d(strain) on the ramp.

A file that states another specimen, lengths of a notch or outputs of another specimen is left as it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.readers.conditions import StatedConditions
from creepkit.readers.frames import TableFrames

PLAIN = ("", "uniaxial", "relaxation")
"""Specimens, as files state them, that are plain bars; "" where a file states none."""


RAMP_RANGE, CREEP_RANGE = (0.05, 1.02), 0.6
"""Of the stress at the end of a ramp: between them the ramp is elastic; below CREEP_RANGE alone where creep shows."""


CREEP_SHOWS = 0.01
"""Fraction of the stress that is lost within one frame of the ramp after its end, above which it bends the ramp."""


FEWEST_RAMP_FRAMES = 3


def as_plain_bar(conditions: StatedConditions, frames: TableFrames) -> TableFrames:
    """The frames with stress and strain in the place of load and extension; HistoryError for lengths that lack."""
    values, terms = dict(frames.values), conditions.terms
    foreign = {name for outputs in terms.outputs.values() for name in outputs} - {
        "elongation",
        "strain",
        "stress",
        "force",
    }
    notch = {name for name in conditions.geometry if name.startswith("notch")}
    has_load = "force" in values or conditions.states("force")
    if conditions.text_of("specimen") not in PLAIN or notch or foreign & values.keys():
        return frames
    if "elongation" not in values and not (has_load and "strain" in values):
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
    if length is None:
        raise conditions.question(
            "an extension is a strain by its gauge length, which is not stated; write gauge_length_mm (or 'specimen: "
            "notched-bar' with its lengths)",
            "gauge_length_mm",
            location=frames.table.location(frames.table.columns_line),
        )
    values["strain"] = elongation / length
    return [f"strain = extension / gauge length {length:g} mm"]


def _with_stress(conditions: StatedConditions, frames: TableFrames, values: dict[str, Floats]) -> list[str]:
    """Put the stress in the place of the load, and say so; a load beside a stress is redundant."""
    column = values.pop("force", None)
    stated = conditions.take_number("force")
    area, how = _area(conditions)
    if "stress" in values or conditions.states_load("stress"):
        return ["the load beside the stress not used"]
    if area is None:
        where = stated.location if stated is not None else frames.table.location(frames.table.columns_line)
        raise conditions.question(
            "a load is a stress by the cross-section, which is not stated; write diameter_mm, or width_mm and "
            "thickness_mm, or area_mm2, or the stress itself",
            "diameter_mm",
            location=where,
        )
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


def modulus_of_ramp(strain: Floats, stress: Floats) -> tuple[float, str] | None:
    """Young's modulus, MPa, of the frames of a loading ramp, and what is said of it; None where too few show it.

    strain, stress : (frames,) of the program that was imposed, without the noise of its record, and MPa. The line is
    fitted by least squares; its 95 % interval is that of Student's t.
    """
    end = int(np.argmax(strain >= strain.max())) + 1
    low, high = (part * float(stress[end - 1]) for part in RAMP_RANGE)
    if stress.size > end and stress[end] < (1.0 - CREEP_SHOWS) * stress[end - 1]:
        high = CREEP_RANGE * float(stress[end - 1])
    kept = np.flatnonzero((stress[:end] >= low) & (stress[:end] <= high) & (np.diff(strain[:end], prepend=-1.0) > 0.0))
    if kept.size < FEWEST_RAMP_FRAMES:
        return None
    from scipy.stats import linregress, t

    line = linregress(strain[kept], stress[kept])
    modulus, half = float(line.slope), float(t.ppf(0.975, kept.size - 2) * line.stderr)
    if not modulus > 0.0 or half > 0.25 * modulus:
        return None
    value, least, most = (f"{1e-3 * one:.4g}" for one in (modulus, modulus - half, modulus + half))
    return modulus, f"modulus {value} GPa of {kept.size} frames of the loading ramp (95 %: {least} to {most})"
