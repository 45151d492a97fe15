"""Loading and temperature of a test: stated in its head, recorded in columns, or both.

A column of nominal levels is steps; a column that was recorded is straight pieces. What the file leaves open is decided
and recorded, or asked for.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from itertools import pairwise
from math import erf
from typing import Literal

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import HistoryError, quoted
from creepkit.readers.conditions import (
    StatedConditions,
    StatedNumber,
    TimeValuePairs,
    ask_of_remarks,
    errors_located_at,
)
from creepkit.readers.frames import TableFrames
from creepkit.readers.questions import ANSWERS_FILE
from creepkit.readers.vocabulary import COMPONENT_LOADING_KINDS, Terms
from creepkit.records import Loading, PointLoading, Program, TwoLevels, loading_of
from creepkit.records.quantities import TEMPERATURE, QuantityKind
from creepkit.records.reading_noise import noise_of_readings
from creepkit.records.recorded_programs import LOAD_RECORD_TOLERANCE, TEMPERATURE_RECORD_TOLERANCE, recorded_program
from creepkit.records.units import time_text

_PROGRAM_FORMS = ("steps", "program")


_LOADING_SUFFIXES = ("", "_1", *(f"_{form}" for form in _PROGRAM_FORMS))


LARGEST_GAP = 0.1
"""Of the shorter of two steps: a change of load between two frames farther apart must be stated."""


LARGEST_BARE_STRAIN = 0.05
"""A held strain without a unit above it is as likely a percentage."""


RAMP_NOISE = 4.0
"""Standard deviations of what is held by which a straight ramp is off a line at most."""


HELD_RANGE, OUTLIERS = 0.02, 0.02
"""Of its median: a quantity that is held varies by less, but for this fraction of its frames."""


CONSTANT_RATE, RISING, LARGEST_MODULUS = 0.05, 0.97, 1e6
"""Of the median: a rate of strain between the first frame and any other that is as near is constant, and a stress below
this part of its median is still rising; MPa."""


LONGEST_RAMP, SUSTAINED, PAUSE, STRAIGHT = 0.1, 0.5, 0.1, 0.1
"""Of the duration of a test the ramp to what is held; of the largest stress what one that was imposed does not fall
below, and below what a load is off; of its range by how much a strain imposed by its rate is off a straight line."""


def read_temperature(conditions: StatedConditions, frames: TableFrames) -> float | Program:
    """The temperature, K."""
    result = _stated_loading(conditions, frames, "temperature")
    if result is None:
        advice = "write temperature_C or temperature_K, or a column of that name"
        raise conditions.missing_error("temperature", advice, "temperature_C")
    return Program.steps(result) if isinstance(result, tuple) else result


def read_loading(conditions: StatedConditions, frames: TableFrames) -> Loading:
    """The loading: by components, by what has steps and programs alone, else by the first load that is stated."""
    terms, load_kinds = conditions.terms, conditions.terms.load_kinds
    _ask_of_relaxation(conditions, frames)
    quantities = (*load_kinds, *COMPONENT_LOADING_KINDS)
    with errors_located_at(
        conditions.location_of(*(f"{quantity}{form}" for quantity in quantities for form in _LOADING_SUFFIXES))
    ):
        loading = _component_loading(conditions)
        likely = {load for one in conditions.terms.specimens_with(frames.values) for load in terms.loads.get(one, ())}
        for name in sorted(load_kinds, key=lambda name: (name in terms.number_kinds, name not in likely)):
            loading = loading or _loading_by(name, conditions, frames)
        if loading is not None and loading.quantity == "strain" and conditions.text_of("control") == "strain":
            conditions.take_text("control")
    if loading is None:
        stated = sorted(likely) or [*load_kinds]
        wanted = " or ".join(name for name in stated if name in load_kinds)
        key = "stress_MPa" if "stress" in stated else ""
        raise conditions.missing_error(f"loading (no {wanted})", _loading_advice(terms, stated), key)
    return loading


_REMAINING = re.compile(
    "remaining|residual|relaxed|relaxation|rest-?spannung|résiduelle|restante|residua|rimanente", re.IGNORECASE
)


def _ask_of_relaxation(conditions: StatedConditions, frames: TableFrames) -> None:
    """Ask for the strain that was held in a test whose column is called the remaining stress, or is all it recorded."""
    written = next((frames.table.as_written(k) for k, c in enumerate(frames.table.columns) if c[:6] == "stress"), "")
    known = {name for outputs in conditions.terms.outputs.values() for name in outputs}
    is_alone = known & frames.values.keys() == {"stress"} and np.ptp(frames.values["stress"]) > 0.0
    if not (_REMAINING.search(written) or is_alone) or "strain" in frames.values:
        return
    if conditions.states_load("strain"):
        conditions.take_number("stress")  # the initial one, which is the first that is recorded
        return
    modulus, stress = conditions.number_of("modulus"), float(frames.values["stress"][0])
    what = f"'{quoted(written, 60)}' is that of a test whose strain was held, which is not stated; how large was it?"
    likely = [] if modulus is None else [float(f"{100.0 * stress / modulus.value:.4g}")]
    raise conditions.question(what, "strain_pct", *likely)


def _loading_advice(terms: Terms, loads: Sequence[str]) -> str:
    """What to write, for each of these loads."""
    units = {name: next(iter(terms.load_kinds[name].units)) for name in loads if name in terms.load_kinds}
    forms = [f"{name}_{unit}, or {name}_steps" if unit else f"{name}_steps" for name, unit in units.items()]
    return f"write {'; or '.join(forms)}"


def _loading_by(quantity: str, conditions: StatedConditions, frames: TableFrames) -> Loading | None:
    """The loading by one quantity, if it is stated or recorded."""
    value: float | TimeValuePairs | Program | TwoLevels | None = _stated_loading(conditions, frames, quantity)
    value = _step_change(conditions, quantity) if value is None else value
    return None if value is None else _loading_of(conditions, quantity, value, float(frames.times[-1]))


def _loading_of(
    conditions: StatedConditions, quantity: str, value: float | TimeValuePairs | Program | TwoLevels, end: float
) -> Loading:
    control: Literal["load", "stress"] = "load"
    if quantity == "stress" and _control(conditions, varies=not isinstance(value, float)) == "stress":
        control = "stress"
    ramp = None if isinstance(value, (Program, tuple)) else conditions.take_number("ramp")
    return loading_of(quantity, value, control=control, ramp=None if ramp is None else ramp.value, end=end)


def _component_loading(conditions: StatedConditions) -> Loading | None:
    """The stresses and strains of a material point."""
    programs: dict[str, dict[str, Program]] = {"stress": {}, "strain": {}}
    for name, kind in COMPONENT_LOADING_KINDS.items():
        if (stated := _stated_form(conditions, name, kind)) is not None:
            quantity, _, component = name.partition("_")
            programs[quantity][component] = _as_program(stated)
    return PointLoading(**programs) if programs["stress"] or programs["strain"] else None


def _stated_form(
    conditions: StatedConditions, quantity: str, kind: QuantityKind, number: StatedNumber | None = None
) -> float | TimeValuePairs | Program | None:
    """What stands in the head: a number, steps or a program."""
    steps, breakpoints = (conditions.take_pairs(f"{quantity}_{form}", kind) for form in ("steps", "program"))
    is_answer = steps and ANSWERS_FILE in conditions.location_of(f"{quantity}_steps")
    if steps and number and is_answer and np.isclose(number.value, steps[0][1], rtol=1e-4):
        number = None  # of the first step
    forms = [form for form in (number, steps, breakpoints) if form is not None]
    if len(forms) > 1:
        what = f"{quantity} is given {len(forms)} times, as a number, {quantity}_steps or {quantity}_program; keep one"
        raise HistoryError(f"{conditions.location}: the {what}")
    if number is not None:
        _check_bare_strain(conditions, quantity, kind, number)
        return number.value
    return steps if breakpoints is None else Program(*np.array(breakpoints).T)


def _control(conditions: StatedConditions, *, varies: bool) -> str:
    """Whether the load or the true stress follows what is stated; an engineering stress is a load.

    varies : whether the stress changes, so that the two differ by more than what happens to the cross-section.
    """
    location = conditions.location_of("stress_measure")
    measure = conditions.take_choice("stress_measure", ("engineering", "true"), required=False)
    meant = {"engineering": "load", "true": "stress", "": ""}[measure]
    if meant and not conditions.states("control"):
        conditions.record_assumption(f"control {meant}, for the stress is the {measure} one")
        return meant
    held = [(k, text) for k, text in conditions.labels.items() if _TRUE_STRESS_HELD.search(text)]
    if held and not meant and not conditions.states("control"):
        what = f"'{held[0][0]}' says '{held[0][1]}'; was the true stress held, or the load?"
        raise conditions.question(what, "control", "stress", "load", is_free=False)
    control = conditions.take_choice("control", ("load", "stress"), required=True)
    if varies and meant and control != meant:
        what = f"stress_measure is {measure} and control is {control}, but an engineering stress that changes is a load"
        raise HistoryError(f"{location}: {what}, and a true one a stress; keep one of the two")
    return control


_TRUE_STRESS_HELD = re.compile(
    r"constant (?:true )?stress|konstante[rn]? (?:wahre[rn]? )?spannung|contrainte (?:vraie )?constante", re.IGNORECASE
)


def _step_change(conditions: StatedConditions, quantity: str) -> TwoLevels | None:
    """First value, second value and time of the change, when all three are given."""
    first = conditions.take_number(f"{quantity}_1")
    if first is None:
        return None
    values = [first.value]
    for name in (f"{quantity}_2", "jump_time"):
        number = conditions.take_number(name)
        if number is None:
            what = f"'{first.key}' needs {name} beside it (with its unit), which is missing"
            raise HistoryError(f"{first.location}: {what}")
        values.append(number.value)
    return TwoLevels(*values)


def _stated_loading(
    conditions: StatedConditions, frames: TableFrames, quantity: str
) -> float | TimeValuePairs | Program | None:
    """The value given for a quantity: a number, steps as (time, value), or a Program.

    A column that differs from what is stated beside it is what was recorded, and is used; the rest is kept as stated.
    """
    kind = TEMPERATURE if quantity == "temperature" else conditions.terms.load_kinds[quantity]
    column = _imposed_column(conditions, frames, quantity)
    stated = _stated_form(conditions, quantity, kind, conditions.take_number(quantity))
    earlier = conditions.take_pairs(f"stated_{quantity}_program", kind)
    if earlier is not None:
        conditions.stated[quantity] = Program(*np.array(earlier).T)
    noise = _noise_of_level(column) if isinstance(stated, tuple) and column is not None else 0.0
    if column is None and isinstance(stated, float):
        ask_of_remarks(conditions, frames, quantity, stated)
    if column is None or (stated is not None and _agrees(_as_program(stated), frames.times, column, noise)):
        return stated
    if stated is None:
        jump = _step_change(conditions, quantity) if quantity != "temperature" else None
        stated = None if jump is None else _loading_of(conditions, quantity, jump, jump.time).program()
    if stated is not None:
        conditions.stated[quantity] = _as_program(stated)
    return _recorded(conditions, frames, quantity, column)


def _agrees(program: Program, times: Floats, column: Floats, noise: float) -> bool:
    """Whether a column says what was stated, at every frame; at a jump, the value before or after it."""
    later, before = program.at(times), program.at(np.nextafter(times, -np.inf).clip(0.0))
    same = [np.isclose(column, stated, rtol=1e-9, atol=noise) for stated in (later, before)]
    return bool(np.logical_or(*same).all())


def _check_bare_strain(conditions: StatedConditions, quantity: str, kind: QuantityKind, number: StatedNumber) -> None:
    """Ask for the unit of a held strain that may be a fraction or a percentage."""
    if "pct" not in kind.units or number.unit:
        return
    if abs(number.value) > LARGEST_BARE_STRAIN:
        what = f"'{number.key}' is {number.value:g} without a unit; write {quantity}_pct for a percentage"
        raise HistoryError(f"{number.location}: {what}, or {quantity}_steps: 0 s {number.value:g} for a fraction")
    conditions.record_assumption(f"{quantity} {number.value:g} as a fraction")


def _imposed_column(conditions: StatedConditions, frames: TableFrames, quantity: str) -> Floats | None:
    """The column of a load or of the temperature, unless it is an output."""
    terms, column = conditions.terms, frames.values.get(quantity)
    if column is None or quantity == "temperature":
        return column
    if terms.own_outputs:
        is_output = quantity in terms.own_outputs and quantity not in terms.own_loads
        return None if is_output or quantity not in (*terms.number_kinds, *terms.own_loads) else column
    others = [
        other
        for one, loads in terms.loads.items()
        for other in terms.outputs[one]
        if quantity in loads
        and other in frames.values
        and any(other in terms.loads[two] and quantity in terms.outputs[two] for two in terms.loads)
    ]
    if others:
        return column if _imposed_of(conditions, frames, quantity, others[0]) == quantity else None
    return column if quantity in terms.number_kinds else None


def _imposed_of(conditions: StatedConditions, frames: TableFrames, first: str, second: str) -> str:
    """Which of two quantities was imposed, where each may be the answer to the other: the stated or the held one.

    A quantity is held where it stays once a ramp has reached it. Of two that change, a stress that stays but for pauses
    without load, or never falls below half of its largest, was imposed, else a strain that grows by a constant rate;
    else it is asked for.
    """
    pair = sorted((first, second))
    stated = [q for q in pair if conditions.states_load(q)]
    control = conditions.text_of("control")
    if "strain" in pair and control == "strain":
        stated = ["strain"]
    elif control and set(pair) == {"strain", "stress"}:
        stated = ["stress"]
    if len(stated) == 1:
        return stated[0]
    columns = {q: frames.values[q] for q in pair}
    if pair == ["strain", "stress"] and _is_strained_at_constant_rate(frames.times, **columns):
        conditions.record_assumption("strain imposed (its rate is constant)")
        return "strain"
    held = [q for q, column in columns.items() if hold_begins(frames.times, column) is not None] or [
        q for q, column in columns.items() if _level_starts(column, LOAD_RECORD_TOLERANCE * float(np.ptp(column)))
    ]
    if len(held) == 1:
        conditions.record_assumption(f"{held[0]} imposed (its column is held)")
        return held[0]
    load = next(q for q in pair if q in conditions.terms.number_kinds)
    other, on = pair[1 - pair.index(load)], under_load(columns[load])
    why = "both columns are held" if held else ""
    if not held and not on.all() and hold_begins(frames.times[on], columns[load][on]) is not None:
        why = "its column is held but for pauses"
    elif columns[load].min() >= SUSTAINED * columns[load].max():
        why = why or "it never falls below half of its largest"
    if why:
        conditions.record_assumption(f"{load} imposed ({why})")
        return load
    if _grows_steadily(frames.times, columns[other]):
        conditions.record_assumption(f"{other} imposed (its rate is constant)")
        return other
    raise conditions.question(
        f"{load} and {other} both change, and nothing says which was imposed; write 'specimen: uniaxial' for an "
        "imposed stress, 'specimen: relaxation' for an imposed strain",
        "specimen",
        *("uniaxial", "relaxation"),
        location=frames.table.location(frames.table.columns_line),
        is_free=False,
    )


def hold_begins(times: Floats, column: Floats) -> int | None:
    """The first frame from which on a column is held, perhaps after a ramp; None where it is not.

    times, column : (frames,) s, and in any unit. It stays then within HELD_RANGE, or four standard deviations of its
    noise, of its median over the last half.
    """
    late = column[column.size // 2 :]
    level = float(np.median(late))
    band = max(HELD_RANGE * abs(level), 4.0 * noise_of_readings(late))
    inside = np.abs(column - level) <= band
    outside_later = np.cumsum(~inside[::-1])[::-1]
    begins = np.flatnonzero(inside[:-1] & inside[1:] & (outside_later[:-1] <= OUTLIERS * column.size))
    start = int(begins[0]) if begins.size else column.size
    if level == 0.0 or band > 0.25 * abs(level) or column.size - start < 2:
        return None
    is_ramp = bool((np.diff(column[: start + 1]) > -band).all()) and column[0] < level + band
    is_short = start < 2 or times[start] - times[0] <= LONGEST_RAMP * (times[-1] - times[0])
    return start if is_ramp and is_short else None


def under_load(column: Floats) -> Bools:
    """(frames,) Whether a load is on, or not yet: False in pauses at almost none after which its level returns.

    column : (frames,) in any unit.
    """
    is_off, is_on = column < PAUSE * column.max(), column > SUSTAINED * column.max()
    had_begun = np.logical_or.accumulate(is_on)
    returns = np.logical_or.accumulate(is_on[::-1])[::-1]
    return np.asarray(~(is_off & had_begun & returns))


def unloaded(frames: TableFrames, terms: Terms) -> Bools:
    """(frames,) Whether a recorded load is off in a pause."""
    loads = [column for name, column in frames.values.items() if name in terms.number_kinds and column.max() > 0.0]
    return np.asarray(np.any([np.zeros(frames.times.size), *(~under_load(one) for one in loads)], axis=0))


def _grows_steadily(times: Floats, column: Floats) -> bool:
    """Whether a column is a straight line over time, but for STRAIGHT of its range."""
    line = np.polyval(np.polyfit(times, column, 1), times)
    return bool(np.ptp(column) > 0.0 and np.abs(column - line).max() <= STRAIGHT * np.ptp(column))


def _is_strained_at_constant_rate(times: Floats, strain: Floats, stress: Floats) -> bool:
    """Whether strain grows by one rate from rest or the first frame on, while the stress rises.

    Creep, even steady one, is slower at the lower stress of a ramp, whose elastic strain is not that of creep; where
    the stress rises by more than any modulus times the strain, that is creep strain alone.
    """
    times, strain, stress = _from_rest(times, strain, stress)
    rates, level = (strain[1:] - strain[0]) / (times[1:] - times[0]), float(np.median(stress))
    is_constant = np.abs(rates - np.median(rates)).max() <= CONSTANT_RATE * np.median(rates)
    is_elastic = stress[1] - stress[0] <= LARGEST_MODULUS * (strain[1] - strain[0])
    return bool(is_constant and is_elastic and stress[0] <= 0.05 * level and stress[1] < RISING * level)


def _from_rest(times: Floats, strain: Floats, *others: Floats) -> list[Floats]:
    """Times, strains and others (frames,) with zeros before the first frame, where the test had begun by then."""
    is_late = times[0] > 0.0 and strain[0] > 0.0
    return [np.append(0.0, one) if is_late else one for one in (times, strain, *others)]


def _recorded(
    conditions: StatedConditions, frames: TableFrames, quantity: str, column: Floats
) -> float | TimeValuePairs | Program:
    """A column as a number, as steps where it holds nominal levels, else as the program of a record."""
    if np.ptp(column) == 0.0:
        return float(column[0])
    is_temperature = quantity == "temperature"
    start = hold_begins(frames.times, column) if quantity == "strain" else None
    tolerance = TEMPERATURE_RECORD_TOLERANCE if is_temperature else LOAD_RECORD_TOLERANCE * float(np.abs(column).max())
    if start is not None and start < column.size - 2 and not _drifts(column[start:], tolerance):
        held = np.maximum(column, 0.0)
        if not start:
            return float(held.mean())
        if frames.times[0] == 0.0:
            return _ramp_and_hold(frames.times, held, start)
        conditions.record_assumption(f"strain 0 at time 0 (the ramp is read from {frames.times[0]:g} s on)")
        return _ramp_and_hold(np.append(0.0, frames.times), np.append(0.0, held), start + 1)
    starts = _level_starts(column, tolerance, np.flatnonzero(np.isin(frames.lines, [*frames.marked])))
    if not starts:
        begun, record = _from_rest(frames.times, column) if quantity == "strain" else (frames.times, column)
        program = recorded_program(begun, record, tolerance)
        return program if column.min() < 0.0 else Program(program.times, np.maximum(program.values, 0.0))
    bounds, off = [*starts, column.size], unloaded(frames, conditions.terms)
    levels = [float(np.median(column[first:last])) for first, last in pairwise(bounds)]
    times = [0.0, *(float(frames.times[frame]) for frame in starts[1:])]
    for k, (before, frame, after) in enumerate(zip(bounds, bounds[1:-1], bounds[2:], strict=False), 1):
        if int(frames.lines[frame]) in frames.marked:
            continue
        shorter = min(frames.times[frame - 1] - frames.times[before], frames.times[after - 1] - frames.times[frame])
        early, late = float(frames.times[frame - 1]), times[k]
        step = levels[k] - levels[k - 1]
        share = (_share_behind_kink if is_temperature else _steps_early)(frames, quantity, (before, frame, after), step)
        unit = "K" if is_temperature else next(iter(conditions.terms.load_kinds[quantity].units))
        is_idle = is_temperature and bool(off[frame - 1 : frame + 1].any())  # nothing creeps in a pause
        if late - early > LARGEST_GAP * shorter and share is None and not is_idle:
            steps = [[*times[:k], time, *times[k + 1 :]] for time in (early, late)]
            texts = ["; ".join(f"{t:g} s {v:g} {unit}" for t, v in zip(one, levels, strict=True)) for one in steps]
            raise conditions.question(
                f"the {quantity} changes from {levels[k - 1]:g} to {levels[k]:g} {unit} between {early:g} s and "
                f"{late:g} s; state when",
                f"{quantity}_steps",
                *texts,
                location=frames.location(frame),
            )
        is_extra = late - early < 0.5 * float(np.median(np.diff(frames.times[before:after])))
        times[k] = late if is_extra else late - (0.5 if share is None else share) * (late - early)
        if times[k] != late or late - early > LARGEST_GAP * shorter:
            which = "as what was measured shows" if share is not None else "between the readings before and after it"
            conditions.record_assumption(f"{quantity} {levels[k]:g} {unit} from {time_text(times[k])} on ({which})")
    if times[1:] == [float(frames.times[frame]) for frame in starts[1:]]:
        conditions.record_assumption(f"steps of {quantity} from the first frame of each level on")
    return tuple(zip(times, levels, strict=True))


TYPICAL_MODULUS, NEAR = 150e3, 0.5
"""MPa; ratio of two distances above which none is the nearer one."""


NEAREST_READINGS, OFF = 5, 3.0
"""On either side of a step, whose lines meet at it; standard deviations of where they meet, beyond which out of the gap
thermal expansion has moved the second one."""


def _share_behind_kink(frames: TableFrames, quantity: str, bounds: tuple[int, int, int], step: float) -> float | None:
    """The share of the time between two frames that is behind a step of temperature, as what creeps shows.

    Lines through the readings before and after it meet at the step: the mean of where within their noise they may meet
    in the gap. None where the second is not the steeper one of a rise, or they meet outside; bounds : first frames of
    two levels, and the end.
    """
    before, frame, after = bounds
    names = [n for n in frames.values if n not in ("time", "used", quantity) and n[-3:] != "_sd"]
    sides = slice(max(before, frame - NEAREST_READINGS), frame), slice(frame, min(after, frame + NEAREST_READINGS))
    if not names or min(side.stop - side.start for side in sides) < 3:
        return None
    y, times = frames.values["strain" if "strain" in names else names[0]], frames.times - frames.times[frame]
    gap = -float(times[frame - 1])
    fits = [np.polyfit(times[side], y[side], 1, cov="unscaled") for side in sides]
    (first, level), (second, other) = (line for line, _ in fits)
    if (second - first) * np.sign(step) <= 0.0:
        return None
    met = (level - other) / (second - first)
    spread = sum(covariance[1, 1] + 2.0 * met * covariance[0, 1] + met**2 * covariance[0, 0] for _, covariance in fits)
    sd = max(noise_of_readings(y, order=3) * float(np.sqrt(spread)) / abs(second - first), 1e-3 * gap)
    ends = np.array([-gap - met, -met]) / sd
    if ends[0] > OFF or ends[1] < -OFF:
        return None
    density, below = np.exp(-0.5 * ends**2) * np.sqrt(2.0 / np.pi), [erf(end) for end in ends / np.sqrt(2.0)]
    return float(-(met - sd * (density[1] - density[0]) / (below[1] - below[0])) / gap)


def _steps_early(frames: TableFrames, quantity: str, bounds: tuple[int, int, int], step: float) -> bool | None:
    """Whether a load was changed at the earlier of two frames, as what is observed grows between them.

    bounds : first frames of two levels, and the end. None where neither the rate before nor that behind, each perhaps
    with the elastic strain of the step, is clearly nearer to that between them, or noise is as large.
    """
    before, frame, after = bounds
    names = [n for n in frames.values if n not in ("time", "used", "temperature", quantity) and n[-3:] != "_sd"]
    first, last = max(before, frame - 4), min(after - 1, frame + 2)
    if quantity == "strain" or not names or first > frame - 2 or last == frame:
        return None
    y, times = frames.values["strain" if "strain" in names else names[0]], frames.times
    gap, growth = times[frame] - times[frame - 1], y[frame] - y[frame - 1]
    slow = gap * (y[frame - 1] - y[first]) / (times[frame - 1] - times[first])
    fast = gap * (y[last] - y[frame]) / (times[last] - times[frame])
    elastic = step / TYPICAL_MODULUS if quantity == "stress" and "strain" in names else 0.0
    if (fast - slow) * np.sign(step) <= 4.0 * noise_of_readings(y, order=3):
        return None
    late, early = (min(abs(growth - rate - extra) for extra in (0.0, elastic)) for rate in (slow, fast))
    return None if min(late, early) > NEAR * max(late, early) else bool(early < late)


def _drifts(held: Floats, tolerance: float) -> bool:
    """Whether what was held changed from its first to its last third by more than a tolerance and than noise can do."""
    third = max(held.size // 3, 1)
    early, late = held[:third], held[-third:]
    noise = float(np.hypot(early.std(), late.std())) / third**0.5
    return bool(abs(float(late.mean() - early.mean())) > max(tolerance, 3.0 * noise))


def _ramp_and_hold(times: Floats, column: Floats, start: int) -> Program:
    """The program of a quantity that a ramp reached and that was held from frame `start` on, as its mean.

    A ramp that is straight but for the noise of what was held is a line, which ends where it meets the level.
    """
    level, noise = float(np.mean(column[start:])), float(np.std(column[start:]))
    before, ramp = times[:start], column[:start]
    slope, offset = np.polyfit(before, ramp, 1) if start > 2 else (0.0, 0.0)
    straight = start > 2 and np.abs(ramp - slope * before - offset).max() <= RAMP_NOISE * noise and slope > 0.0
    if not straight:
        return Program(np.append(times[: start + 1], times[-1]), np.append(ramp, (level, level)))
    end = float(np.clip((level - offset) / slope, before[-1], times[start]))
    first = max(offset + slope * before[0], 0.0)
    return Program(np.array([before[0], end, times[-1]]), np.array([first, level, level]))


def _noise_of_level(column: Floats) -> float:
    """Within which readings of one level lie: eight standard deviations, by the median of what changes at once."""
    return 8.0 * 1.05 * float(np.median(np.abs(np.diff(column))))


def _level_starts(column: Floats, tolerance: float, marked: Collection[int] = ()) -> list[int]:
    """First frames of nominal levels; [] where a column holds no such.

    Each but the last, and but those that begin at a frame whose change is marked, is of two frames or more.
    """
    tolerance = max(tolerance, _noise_of_level(column))
    starts = [0, *(np.flatnonzero(np.abs(np.diff(column)) > tolerance) + 1).tolist()]
    parts = [column[first:last] for first, last in pairwise([*starts, column.size])]
    are_long = all(one.size > 1 or first in marked for first, one in zip(starts[:-1], parts[:-1], strict=True))
    held = are_long and all(np.ptp(one) <= tolerance for one in parts)
    return starts if held and len(starts) > 1 else []


def _as_program(stated: float | TimeValuePairs | Program) -> Program:
    if isinstance(stated, Program):
        return stated
    return Program.steps(stated) if isinstance(stated, tuple) else Program.constant(stated)
