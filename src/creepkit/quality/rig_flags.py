"""What the rig did, in words and numbers: changes of rate at one time, steps of an output, records off the program."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.quality.common_changes import CommonRateChange, Jump
from creepkit.quality.flags import QualityFlag
from creepkit.quality.frames import LOAD_TOLERANCE, TEMPERATURE_TOLERANCE
from creepkit.records import History, growing_output, output_named
from creepkit.records.units import time_text, times_text

ACTIVATION_ENERGY = 400e3
"""J/mol, with which a factor of the rate is put as a step of temperature unless another one is given."""


_GAS_CONSTANT = 8.314462618


_RECORD_FRAMES = 5
"""Frames over which a record must be off the program, by their median: a single reading proves nothing."""


def temperature_step(temperature: float, rate_factor: float, activation_energy: float) -> float:
    """The step, K, from a temperature (K) that multiplies the rate by a factor at an activation energy (J/mol).

    1/T_2 = 1/T_1 - R ln(factor) / Q.
    """
    inverse = 1.0 / temperature - _GAS_CONSTANT * float(np.log(rate_factor)) / activation_energy
    return 1.0 / inverse - temperature if inverse > 0 else float("inf")


def rate_change_flag(histories: Sequence[History], change: CommonRateChange, activation_energy: float) -> QualityFlag:
    """The flag of a change of rate in several tests."""
    factors = {histories[k].name: float(np.exp(change.steps[k].log_factor)) for k in change.shown}
    errors = {histories[k].name: float(np.exp(1.96 * change.steps[k].log_factor_sd)) for k in change.shown}
    steps = {
        histories[k].name: temperature_step(
            float(histories[k].temperature_program().at(change.time)), factors[histories[k].name], activation_energy
        )
        for k in change.shown
    }
    rises = next(iter(factors.values())) > 1
    sizes = ", ".join(f"{n} {f if rises else 1 / f:.2f} ({errors[n]:.2f})" for n, f in factors.items())
    unclear = [histories[k].name for k in change.steps if k not in change.shown]
    kelvin = np.abs(list(steps.values()))
    one = histories[change.shown[0]]
    if change.has_jump:
        step_text = (
            f"its {growing_output(one)} steps with it by {_size_text(one, change.jump)}, as with a step of the load"
        )
        nuisances = '"load step"'
    else:
        limit = _size_text(one, abs(change.jump) + 1.96 * change.jump_sd)
        step_text = f"no elastic jump (less than {limit} on average), so it is no step of the load"
        nuisances = '"temperature step" (or "rate step")'
    scope = "one for all tests" if change.same_factor else "one for each group of tests, since the factors differ"
    return QualityFlag(
        tuple(factors),
        "rate change",
        (),
        f"at {time_text(change.time)} ({times_text(change.earliest, change.latest)}) the creep rate "
        f"{'rises' if rises else 'falls'} at once by a factor (in brackets its nominal 95 % error, as a factor) of "
        f"{sizes}; "
        f"{_kelvin_text(kelvin)} {'warmer' if rises else 'colder'} would do it at {activation_energy / 1e3:g} kJ/mol; "
        f"{step_text}; {abs(change.score):.1f} standard deviations"
        + (f"; not resolved in {', '.join(unclear)}" if unclear else ""),
        time=change.time,
        earliest=change.earliest,
        latest=change.latest,
        rate_factors=factors,
        factor_errors=errors,
        temperature_steps=steps,
        jumps={histories[k].name: change.steps[k].jump for k in change.shown},
        proposal=f"cut the frames after {time_text(change.time)}, model it by the nuisance {nuisances} from then on, "
        f"{scope}, or ignore it if the load or the alloy is known to have done it",
    )


def jump_flags(histories: Sequence[History], jumps: Sequence[Jump]) -> Iterator[QualityFlag]:
    """Flags of steps of an output; those of one gap between frames are one flag."""
    remaining = sorted(jumps, key=lambda jump: (jump.time, jump.test))
    while remaining:
        first = remaining[0]
        kind = histories[first.test].specimen
        together = [
            j for j in remaining if histories[j.test].specimen == kind and j.previous_time < first.time <= j.time
        ]
        remaining = [j for j in remaining if j not in together]
        sizes = {histories[j.test].name: j.size for j in together}
        texts = [f"{_size_text(histories[j.test], j.size)} ({abs(j.score):.0f} times its error)" for j in together]
        yield QualityFlag(
            tuple(sizes),
            "jump",
            (),
            f"{growing_output(histories[first.test])} steps by {', '.join(texts)} from "
            f"{times_text(first.previous_time, first.time)}, though the load does not",
            time=first.time,
            earliest=max(j.previous_time for j in together),
            latest=first.time,
            jumps=sizes,
            proposal=f"take the step off if the observation moved (a bumped camera or extensometer): "
            f"'steps_taken_off = \"{time_text(first.time)}\"' in tests.toml; cut the frames from then on, or ignore it",
        )


def record_flags(history: History, activation_energy: float) -> Iterator[QualityFlag]:
    """Flags of records of load or temperature that are off what was stated of the test."""
    times = history.times[history.used]
    for quantity, stated in history.stated.items():
        is_temperature = quantity == "temperature"
        record = history.temperature_program() if is_temperature else history.loading.program()
        wanted = stated.at(times)
        limit = TEMPERATURE_TOLERANCE if is_temperature else LOAD_TOLERANCE * float(stated.values.max())
        difference = _running_median(record.at(times) - wanted)
        off = np.flatnonzero(np.abs(difference) > limit)
        if not off.size:
            continue
        worst = int(np.argmax(np.abs(difference)))
        unit, name, time = ("K" if is_temperature else "MPa"), history.name, float(times[off[0]])
        text = (
            f"the recorded {quantity} is off the stated one by more than {limit:g} {unit} in {off.size} of "
            f"{times.size} frames, first at {time_text(time)}; most at {time_text(float(times[worst]))}, "
            f"by {difference[worst]:+.3g} {unit}"
        )
        factors, steps = {}, {}
        if is_temperature:
            recorded = float(record.at(times[worst]))
            factors[name] = _arrhenius_factor(float(wanted[worst]), recorded, activation_energy)
            steps[name] = float(difference[worst])
            text += f", a factor of {factors[name]:.2f} on the rate at {activation_energy / 1e3:g} kJ/mol"
        yield QualityFlag(
            (name,),
            "record",
            (),
            text,
            time=time,
            rate_factors=factors,
            temperature_steps=steps,
            proposal="the record is what simulations use: ignore this if it is right; if the sensor is wrong, remove "
            f"its column; if the control failed, cut the frames from {time_text(time)} on",
        )


def _arrhenius_factor(first: float, second: float, activation_energy: float) -> float:
    return float(np.exp(activation_energy / _GAS_CONSTANT * (1.0 / first - 1.0 / second)))


def _running_median(values: Floats) -> Floats:
    if values.size < _RECORD_FRAMES:
        return values
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(values, _RECORD_FRAMES // 2, mode="edge"), _RECORD_FRAMES)
    return np.asarray(np.median(windows, axis=-1))


def _kelvin_text(kelvin: Floats) -> str:
    low, high = float(kelvin.min()), float(kelvin.max())
    return f"{low:.0f} K" if round(low) == round(high) else f"{low:.0f} to {high:.0f} K"


def _size_text(history: History, value: float) -> str:
    output = output_named(growing_output(history), history.specimen)
    return f"{value:.2g} {output.unit}" if output.unit else f"{value:.2g} of {output}"
