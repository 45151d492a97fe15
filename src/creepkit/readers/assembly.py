"""One test as text becomes one History; every file layout ends here."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import HistoryError, SolveError
from creepkit.readers.conditions import (
    END_OF_TEST_TERMS,
    StatedConditions,
    errors_located_at,
    read_loading,
    read_temperature,
)
from creepkit.readers.text_tables import SourceText, TableFrames, TextTable, column_means, read_frames
from creepkit.readers.vocabulary import HeaderVocabulary, Terms
from creepkit.records import History, outputs_of_test, specimen_of

if TYPE_CHECKING:
    from creepkit.language.elastic import Elastic


def assemble_history(
    name: str,
    entries: Mapping[str, SourceText],
    table: TextTable,
    vocabulary: HeaderVocabulary,
    *,
    location: str,
    source: str,
    skipped_columns: Collection[str] = (),
) -> History:
    """Return the history of one test.

    entries : what is said once for the test; location : where that stands; table : its frames, without reading the
    columns in `skipped_columns`; source : what the history says of its origin.
    """
    conditions = StatedConditions(entries, vocabulary, location)
    frames = read_frames(table, vocabulary, conditions.terms, skipped_columns)
    columns = table.location(table.columns_line)
    loading = read_loading(conditions, frames)
    specimen, outputs = _specimen_and_outputs(conditions, frames, loading.quantity, columns)
    strain_measure = conditions.take_choice(
        "strain_measure", ("engineering", "logarithmic"), required="strain" in outputs
    )
    elastic_included = conditions.take_choice("includes_elastic", ("yes", "no"), required="strain" in outputs)
    temperature = read_temperature(conditions, frames)
    used = _used_frames(conditions, frames)
    rupture_time, unruptured = _end_of_test(conditions, frames, used)
    _refuse_unread_columns(frames, {*outputs, loading.quantity, "temperature"}, columns)
    history = History(
        name=conditions.take_text("name", name),
        times=frames.times,
        outputs=outputs,
        loading=loading,
        temperature=temperature,
        specimen=specimen,
        elastic=_elastic(conditions),
        strain_measure="engineering" if strain_measure == "engineering" else "logarithmic",
        includes_elastic=elastic_included == "yes",
        standard_deviation=_standard_deviations(conditions, frames, outputs),
        used=used,
        geometry=conditions.geometry,
        operator=conditions.take_text("operator"),
        alloy=conditions.take_text("alloy"),
        source=source,
        rupture_time=rupture_time,
        unruptured=unruptured,
        stated=conditions.stated,
        # Last: entries that nothing has used by now are refused.
        labels={**conditions.all_labels(), **column_means(table, vocabulary), **_merge_label(frames)},
    )
    _check_operator(history, columns)
    return history


def _check_operator(history: History, location: str) -> None:
    """HistoryError where the operator of a test does not give the outputs that its columns hold."""
    try:
        outputs_of_test(specimen_of(history), replace(history, source=location))
    except SolveError as error:
        raise HistoryError(str(error)) from error


def _merge_label(frames: TableFrames) -> dict[str, str]:
    return {"merged_frames": str(frames.merged_count)} if frames.merged_count else {}


def _specimen_and_outputs(
    conditions: StatedConditions, frames: TableFrames, load: str, location: str
) -> tuple[str, dict[str, Floats]]:
    """The specimen, as named or as outputs and load identify it, and its outputs."""
    named, terms = conditions.take_text("specimen", conditions.default_specimen), conditions.terms
    present = terms.specimens_with(frames.values)
    if named in terms.outputs:
        chosen = [named] if named in present else []
    else:
        chosen = [name for name in present if load in terms.loads.get(name, [load])] or present
    if named and named not in terms.outputs and (near := get_close_matches(named, terms.outputs, 1, cutoff=0.8)):
        raise HistoryError(f"{location}: there is no specimen '{named}'; did you mean '{near[0]}'?")
    if len(chosen) != 1:
        raise _unidentified(named, present if named in terms.outputs else chosen, terms, location)
    outputs = {name: frames.values[name] for name in terms.outputs[chosen[0]] if name in frames.values}
    return named or chosen[0], outputs


def _unidentified(named: str, present: Sequence[str], terms: Terms, location: str) -> HistoryError:
    """Why it is not known which specimen was tested."""
    description = f"outputs of {' and '.join(present)}" if present else "no output"
    if named in terms.outputs:
        known = f"{', '.join(terms.outputs[named])} ({named})"
        return HistoryError(
            f"{location}: missing column: the columns hold {description}, those of {named} are needed: {known}"
        )
    known = "; ".join(f"{', '.join(outputs)} ({name})" for name, outputs in terms.outputs.items())
    advice = f"name one, such as '# specimen: {present[0]}'" if present else "those of one specimen are needed"
    return HistoryError(f"{location}: missing column: the columns hold {description}, {advice}: {known}")


def _refuse_unread_columns(frames: TableFrames, read_columns: Collection[str], location: str) -> None:
    """Refuse a column that would go unread, such as a pressure beside a stress."""
    unread = [name for name in frames.values if name.removesuffix("_sd") not in {"time", "used", *read_columns}]
    if unread:
        read_text = ", ".join(sorted(read_columns))
        raise HistoryError(f"{location}: a column of {unread[0]} has no meaning beside {read_text}; remove it")


def _elastic(conditions: StatedConditions) -> Elastic | None:
    modulus = conditions.take_number("modulus")
    if modulus is None:
        return None
    # Here, not above: the record of elasticity brings sympy, which listing the readers must not wait for.
    from creepkit.language.elastic import Elastic

    poisson = conditions.take_number("poisson")
    with errors_located_at(modulus.location):
        return Elastic(modulus.value) if poisson is None else Elastic(modulus.value, poisson.value)


def _standard_deviations(
    conditions: StatedConditions, frames: TableFrames, outputs: Mapping[str, Floats]
) -> dict[str, Floats]:
    """Standard deviations by output, from a column or one number for all frames."""
    standard_deviations: dict[str, Floats] = {}
    for name in outputs:
        number, column = conditions.take_number(f"{name}_sd"), frames.values.get(f"{name}_sd")
        if number is not None and column is not None:
            raise HistoryError(f"{number.location}: '{number.key}' is also a column of the frames; keep one of them")
        if number is not None:
            standard_deviations[name] = np.full(frames.times.shape, number.value)
        elif column is not None:
            standard_deviations[name] = column
    return standard_deviations


def _used_frames(conditions: StatedConditions, frames: TableFrames) -> Bools:
    """Which frames a fit may use: those marked so, up to the end of the test; later ones saw the unloading."""
    used = np.asarray(frames.values.get("used", np.ones(frames.times.size)) == 1.0)
    end = conditions.take_number("end_time")
    if end is None:
        return used
    after = frames.times > end.value * (1 + 1e-9)
    if after.all():
        raise HistoryError(f"{end.location}: every frame lies after '{end.key}', {end.value:g} s; correct the end time")
    if after.any():
        conditions.labels["frames_after_end"] = str(int(after.sum()))
    return used & ~after


def _end_of_test(conditions: StatedConditions, frames: TableFrames, used: Bools) -> tuple[float | None, bool]:
    """The rupture time, s, if the test ruptured, and whether it was stopped before; neither where nothing is said.

    A test that is said to have ruptured, without a time, did so when its last frame was taken.
    """
    time, ended = conditions.take_number("rupture"), conditions.take_choice("ended", END_OF_TEST_TERMS, required=False)
    if time is not None and ended == "stopped":
        raise HistoryError(
            f"{time.location}: the test was stopped, and '{time.key}' says when it ruptured; keep one of them"
        )
    if time is not None or ended != "ruptured":
        return None if time is None else time.value, ended == "stopped"
    conditions.record_assumption("rupture at the last frame")
    return float(frames.times[used][-1] if used.any() else frames.times[-1]), False
