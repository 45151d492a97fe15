"""Histories before an identification: copies and suspect frames left out, then what must hold of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from creepkit.arrays import single_threaded_blas
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import compared_outputs
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.reference_conditions import detect_creep
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import CreepLaw
from creepkit.quality import check_loading_strain, check_rig, exclude_suspect_frames, repeated_row_notes, without_copies
from creepkit.quality.curve_shapes import CUT_LABEL
from creepkit.records import History, Predictor, dimension_named, is_logarithmic, output_named
from creepkit.records.specimen_lookup import lengths_by_default

SUSPECT_LABEL = "suspect"
"""Label of a history that says which of its frames were left out, and why."""


SIGNIFICANT_GROWTH = 5.0
"""Increase of an output, in units of its noise, that is creep."""


def without_suspect_frames(histories: Sequence[History], settings: IdentificationSettings) -> list[History]:
    """The histories with suspect frames unused, unless settings keep them; those with a label stay."""
    if settings.suspect_frames == "keep":
        return list(histories)
    return [h if SUSPECT_LABEL in h.labels else exclude_suspect_frames([h])[0] for h in histories]


def sound_tests(
    histories: Sequence[History], settings: IdentificationSettings
) -> tuple[list[History], tuple[str, ...]]:
    """The tests that count: copies of others left out and suspect frames unused, unless settings keep them; and notes.

    The notes say which tests are copies, a sentence each, and that rows of tables repeat others, which count.
    """
    if settings.suspect_frames == "keep":
        return list(histories), ()
    kept, reasons = without_copies(histories)
    left_out = (f"left out: {name}: {why}" for name, why in reasons.items())
    return without_suspect_frames(kept, settings), (*left_out, *repeated_row_notes(kept))


def truncated_at_strain(histories: Sequence[History], limit: float) -> list[History]:
    """The histories with frames up to a strain alone; without curves that have fewer than two of them.

    How a test ended is forgotten, also of those that never came so far: all are compared over the same part of life.
    One without any frames stays.
    """
    truncated = [
        h.up_to("strain", limit).replace(
            rupture_time=None, unruptured=False, labels={**h.labels, CUT_LABEL: f"{limit:g}"}
        )
        if "strain" in h.outputs
        else h
        for h in histories
    ]
    return [h for h in truncated if not h.outputs or int((h.used & (h.times > 0)).sum()) >= 2]


def suspect_frames_note(histories: Sequence[History]) -> tuple[str, ...]:
    """The tests of which suspect frames were left out, how many and why, in one sentence."""
    described = [
        f"{np.count_nonzero(~h.used)} of {h.used.size} of '{h.name}' ({h.labels[SUSPECT_LABEL]})"
        for h in histories
        if SUSPECT_LABEL in h.labels and not h.used.all()
    ]
    return (f"suspect frames were left out: {', '.join(described)}",) if described else ()


def rig_notes(histories: Sequence[History], settings: IdentificationSettings) -> tuple[str, ...]:
    """What the rig did, one sentence each, unless a nuisance parameter of a step or drift models it."""
    if any(n.kind in ("temperature step", "rate step", "load step") for n in settings.nuisances):
        return ()
    sound = exclude_suspect_frames(histories) if settings.suspect_frames == "keep" else histories
    with single_threaded_blas():
        return tuple(f"the rig: {flag}" for flag in check_rig(sound))


def loading_notes(histories: Sequence[History]) -> tuple[str, ...]:
    """Strain of loading that histories seem to hold, which a fit takes for creep: one sentence for all of them."""
    flags = check_loading_strain(histories)
    if not flags:
        return ()
    others = f" (also: {', '.join(flag.history for flag in flags[1:])})" if len(flags) > 1 else ""
    return (f"{flags[0]}{others}",)


LENGTHS_BY_DEFAULT = "stresses rest on lengths by default"
"""How the note on lengths of test pieces begins that no file states."""


def length_notes(histories: Sequence[History], using: Predictor | Mapping[str, Predictor]) -> tuple[str, ...]:
    """The lengths of test pieces that neither the files of the tests nor what predicts them state, in one sentence."""
    found = list[str]()
    for history in (one for one in histories if one.source):
        predictor = using if isinstance(using, Predictor) else using[history.specimen]
        for name, length in lengths_by_default(history.specimen, history.geometry).items():
            own = dimension_named(predictor.for_history(history), name)
            found += [name.replace("_", " ")] if own is None or own.default == length else []
    named = ", ".join(dict.fromkeys(found))
    return (f"{LENGTHS_BY_DEFAULT}, for no file states them: {named}; write them into the files",) if found else ()


def check_creep(observations: ObservationVector, histories: Sequence[History]) -> None:
    """Some strain must rise above the floor of its transform, or some other output grow beyond its noise.

    A minimum rate, and a rupture, are creep.
    """
    if (observations.single_value_mask & ~observations.stopped_ends).any():
        return
    for position, (name, transform) in enumerate(zip(observations.outputs, observations.transforms, strict=True)):
        mask = observations.leading_output & (observations.output_index == position)
        if is_logarithmic(name):
            if (mask & (np.abs(observations.values) > 2 * transform.floor)).any():
                return
            continue
        for k, history in enumerate(histories):
            values = observations.values[k, mask[k]]
            if (
                values.size
                and np.ptp(values) > SIGNIFICANT_GROWTH * observations.noise[position]
                and _creeps_under_load(history, name)
            ):
                return
    output_names = dict.fromkeys(
        observations.outputs[k] for k in observations.output_index[observations.leading_output]
    )
    raise FitError(
        f"no {' or '.join(output_names)} of these histories rises above its noise while the load is held; there is no "
        "creep to identify a law from"
    )


def _creeps_under_load(history: History, output: str) -> bool:
    """Whether an output grows while the load is held: a jump of the load alone moves it elastically.

    An output that falls with creep is not judged.
    """
    return not output_named(output, history.specimen).grows or detect_creep(history, output).shows_creep


def check_outputs_agree(histories: Sequence[History]) -> None:
    """FitError where outputs of one name are other quantities in other specimens: they would share one noise."""
    known: dict[str, tuple[str, str]] = {}
    for history in histories:
        for name in history.outputs:
            output = output_named(name, history.specimen)
            quantity, specimen = known.setdefault(name, (output.quantity, history.specimen))
            if quantity != output.quantity:
                raise FitError(
                    f"'{name}' is a {quantity} of specimen '{specimen}' and a {output.quantity} of "
                    f"'{history.specimen}'; outputs of one name share their noise in a fit: rename one of them"
                )


def check_histories(law: CreepLaw, histories: Sequence[History], predictor: Predictor) -> None:
    """There must be parameters, and named histories with enough finite outputs to find them from."""
    if not histories:
        raise FitError(f"law '{law.name}': there are no histories to identify it from")
    if not law.params:
        raise FitError(f"law '{law.name}' has no parameter left to identify")
    check_outputs_agree(histories)
    names = [h.name for h in histories]
    for history in histories:
        if names.count(history.name) > 1:
            raise FitError(f"two histories are called '{history.name}'; give each its own name")
        _check_outputs(history, predictor)
    values = sum(_value_count(history) for history in histories)
    if values <= len(law.params):
        raise FitError(
            f"law '{law.name}' has {len(law.params)} parameters and the histories only {values} frames, minimum rates "
            "and rupture times"
        )


def _value_count(history: History) -> int:
    """Used frames; of a test without frames how many of minimum rate and end are known."""
    return int(history.used.sum()) if history.outputs else (history.minimum_rate is not None) + history.end_known


def _check_outputs(history: History, predictor: Predictor) -> None:
    """Frames without a number are left out, output by output; an infinite one is a mistake."""
    if not history.outputs:
        _check_without_frames(history, predictor)
        return
    outputs = compared_outputs(predictor, history)
    if not outputs:
        known = ", ".join(predictor.for_history(history).outputs_of_test(history)) or "nothing"
        raise FitError(
            f"history '{history.name}' has none of the outputs that are predicted ({known}); "
            f"it has {', '.join(history.outputs) or 'none'}"
        )
    used = history.used & (history.times > 0)
    if int((used & history.frames_with_data).sum()) < 2:
        raise FitError(f"history '{history.name}' has fewer than two usable frames after time zero")
    for name in outputs:
        if np.isinf(history.outputs[name][used]).any():
            raise FitError(f"history '{history.name}' has an infinite {name}; mark the frame unused")


def _check_without_frames(history: History, predictor: Predictor) -> None:
    """A test without frames has a minimum rate, or an end that is predicted."""
    if history.minimum_rate is None and not history.end_known:
        raise FitError(
            f"history '{history.name}' has no frames, no minimum rate and no known end: nothing to identify a law from"
        )
    if history.minimum_rate is None and not predictor.for_history(history).follows_to_rupture:
        raise FitError(
            f"history '{history.name}' has its end alone, and {predictor.for_history(history).label} follows no test "
            "to rupture; leave the test out"
        )


def check_explicit_nuisances(
    kinds: Sequence[str], observations: ObservationVector, histories: Sequence[History], predictor: Predictor
) -> None:
    """Explicit nuisances have no place yet where tests are followed to rupture."""
    if not kinds or not observations.followed_to_rupture.any():
        return
    history = histories[int(np.argmax(observations.followed_to_rupture))]
    name = predictor.for_history(history).label
    raise FitError(
        f"nuisance '{kinds[0]}' cannot be fitted beside tests that are followed to their end ('{history.name}', "
        f"{name}); leave it out, or drop how they ended: history.replace(rupture_time=None, unruptured=False)"
    )
